// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "file.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "npz_arrays.hpp"

namespace gsnav::io {

Status save_driver(const std::filesystem::path& path, const DriverFrames& frames) {
  return detail::guarded(path.string(), [&]() -> Status {
    const auto bad = [&](const std::string& what) {
      return Status(Errc::invalid_argument, path.string() + ": DriverFrames." + what);
    };
    if (!(frames.frame_rate > 0) || !std::isfinite(frames.frame_rate))
      return bad("frame_rate must be positive");
    const std::size_t joints = frames.joints, count = joints == 0 ? 0 : frames.matrices.size() / joints;
    if (count == 0 || frames.matrices.size() != count * joints) {
      return bad("matrices has " + std::to_string(frames.matrices.size()) + " values: no multiple of " +
                 std::to_string(joints) + " joints");
    }
    const std::size_t capsules = frames.capsules.empty() ? 0 : frames.capsules[0].size();
    if (!frames.capsules.empty() && frames.capsules.size() != count)
      return bad("capsules has another number of frames than matrices");
    std::vector<float> mats, proxies;
    mats.reserve(16 * frames.matrices.size());
    for (std::size_t at = 0; at < frames.matrices.size(); ++at) {
      const Affine3<double>& m = frames.matrices[at];
      if (!is_finite(m.translation)) return bad("matrices is not finite");
      if (!detail::is_rigid(m)) {
        return bad("matrices: frame " + std::to_string(at / joints) + ", joint " +
                   std::to_string(at % joints) + " is not rigid");
      }
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) mats.push_back(static_cast<float>(m.linear(i, k)));
        mats.push_back(static_cast<float>(m.translation[i]));
      }
      mats.insert(mats.end(), {0.0f, 0.0f, 0.0f, 1.0f});
    }
    for (const auto& row : frames.capsules) {
      if (row.size() != capsules) return bad("capsules has frames of different numbers");
      for (const Capsule<double>& c : row) {
        if (!is_finite(c.p0) || !is_finite(c.p1) || !(c.radius >= 0) || !is_finite(c.radius)) {
          return bad("capsules has one that is not finite or of a negative radius");
        }
        for (const double v : {c.p0.x, c.p0.y, c.p0.z, c.p1.x, c.p1.y, c.p1.z, c.radius})
          proxies.push_back(static_cast<float>(v));
      }
    }
    const std::array<double, 1> rate{frames.frame_rate};
    const std::array<std::int64_t, 1> version{1}, joint_count{static_cast<std::int64_t>(joints)},
        capsule_count{static_cast<std::int64_t>(capsules)};
    std::vector<NpzEntry> entries{{"joint_mats", {count, joints, 4, 4}, mats},
                                  {"joint_mats_space", {}, std::string("smpl_with_trans")},
                                  {"joint_mats_version", {1}, version},
                                  {"joint_mats_fps", {1}, rate},
                                  {"joint_mats_joint_count", {1}, joint_count}};
    if (capsules != 0) {
      entries.push_back({"proxy_capsules", {count, capsules, 7}, proxies});
      entries.push_back({"proxy_capsules_version", {1}, version});
      entries.push_back({"proxy_capsules_fps", {1}, rate});
      entries.push_back({"proxy_capsules_count", {1}, capsule_count});
    }
    return save_npz(path, entries);
  });
}

}  // namespace gsnav::io
