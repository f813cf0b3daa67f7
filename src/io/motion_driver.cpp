// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <utility>

#include "file.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "npz_arrays.hpp"

namespace gsnav::io {
namespace {

using detail::NpzArrays;

/// Reads joint_mats_fps or fps. If both are present they must agree.
Result<double> frame_rate(const NpzArrays& arrays) {
  double rate = 0;
  for (const char* key : {"joint_mats_fps", "fps"}) {
    if (!arrays.file().contains(key)) continue;
    const auto v = arrays.number(key);
    if (!v) return v;
    const std::string what = arrays.file().source() + ": " + key + " is " + std::to_string(*v);
    if (!(*v > 0)) return {Errc::invalid_file, what + ", must be positive"};
    if (rate != 0 && std::fabs(rate - *v) > 1e-6 * rate) {
      return {Errc::invalid_file, what + ", but joint_mats_fps is " + std::to_string(rate)};
    }
    rate = *v;
  }
  if (rate == 0)
    return {Errc::invalid_file, arrays.file().source() + ": there is neither joint_mats_fps nor fps"};
  return rate;
}

/// Checks that an optional number, if present, is `want`.
Status check_number(const NpzArrays& arrays, const char* key, double want, Errc code) {
  if (!arrays.file().contains(key)) return {};
  const auto v = arrays.number(key);
  if (!v) return v.status();
  if (*v == want) return {};
  return {code, arrays.file().source() + ": " + key + " is " + std::to_string(*v) + ", must be " +
                    std::to_string(want)};
}

Status read_capsules(const NpzArrays& arrays, std::size_t frames, LoadedDriver& out) {
  const auto a = arrays.read("proxy_capsules", {});
  if (!a) return a.status();
  const std::string what = arrays.file().source() + ": proxy_capsules";
  if (a->shape.size() != 3 || a->shape[0] != frames || a->shape[2] != 7) {
    return {Errc::invalid_file, what + " has the shape " + detail::shape_text(a->shape) + ", must be [" +
                                    std::to_string(frames) + ", C, 7]"};
  }
  for (std::size_t t = 0; t < frames; ++t) {
    std::vector<Capsule<double>>& row = out.capsules.emplace_back();
    for (std::size_t c = 0; c < a->shape[1]; ++c) {
      const double* v = &a->values[7 * (t * a->shape[1] + c)];
      if (!(v[6] >= 0)) {
        return {Errc::invalid_file, what + ": frame " + std::to_string(t) + ", capsule " +
                                        std::to_string(c) + " has the radius " + std::to_string(v[6])};
      }
      row.push_back({{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, v[6]});
    }
  }
  return {};
}

Result<LoadedDriver> read_driver(const NpzArrays& arrays, const Skeleton& skeleton) {
  const NpzFile& file = arrays.file();
  const std::string& source = file.source();
  if (file.contains("joint_mats_space")) {
    const auto space = file.read_text("joint_mats_space");
    if (!space) return space.status();
    if (*space != "smpl_with_trans") {
      return {Errc::unsupported, source + ": joint_mats_space is " + detail::in_quotes(*space) +
                                     ", only 'smpl_with_trans' is read"};
    }
  }
  const double joints = static_cast<double>(skeleton.size());
  if (Status s = check_number(arrays, "joint_mats_version", 1, Errc::unsupported); !s) return s;
  if (Status s = check_number(arrays, "joint_mats_joint_count", joints, Errc::invalid_file); !s)
    return s;
  const auto rate = frame_rate(arrays);
  if (!rate) return rate.status();
  const auto a = arrays.read("joint_mats", {});
  if (!a) return a.status();
  const std::vector<std::size_t>& shape = a->shape;
  if (shape.size() != 4 || shape[0] == 0 || shape[1] != skeleton.size() || shape[2] != 4 ||
      shape[3] != 4) {
    return {Errc::invalid_file, source + ": joint_mats has the shape " + detail::shape_text(shape) +
                                    ", must be [T, " + std::to_string(skeleton.size()) + ", 4, 4]"};
  }
  std::vector<Affine3<double>> matrices(shape[0] * shape[1]);
  for (std::size_t i = 0; i < matrices.size(); ++i) {
    if (!detail::rigid_transform(&a->values[16 * i], matrices[i])) {
      return {Errc::invalid_file, source + ": joint_mats: the matrix of frame " +
                                      std::to_string(i / shape[1]) + ", joint " +
                                      std::to_string(i % shape[1]) + " is not rigid"};
    }
  }
  LoadedDriver out;
  auto clip = clip_from_matrices(skeleton, *rate, matrices, false);
  if (!clip) return {clip.code(), source + ": " + clip.status().message()};
  out.clip = std::move(*clip);
  out.clip.wrap_time = smooth_wrap_time(skeleton, out.clip);
  if (file.contains("proxy_capsules")) {
    if (Status s = read_capsules(arrays, shape[0], out); !s) return s;
  }
  return out;
}

}  // namespace

Result<LoadedDriver> load_driver(const std::filesystem::path& path, const Skeleton& skeleton) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedDriver> {
    const auto file = NpzFile::open(path);
    if (!file) return file.status();
    return read_driver(NpzArrays(*file), skeleton);
  });
}

}  // namespace gsnav::io
