// SPDX-License-Identifier: Apache-2.0
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "file.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "motion_asf.hpp"
#include "text_lines.hpp"

namespace gsnav::io {
namespace {

using detail::about_axis;
using detail::AsfBone;
using detail::AsfSkeleton;
using detail::in_quotes;
using detail::kRadiansPerDegree;
using detail::TextLines;

class AmcReader {
 public:
  AmcReader(std::string_view text, const std::string& source, const AsfSkeleton& file, double scale,
            bool z_up)
      : lines_(text, source),
        file_(file),
        scale_(scale),
        angle_unit_(file.angle_unit),
        bytes_(text.size()) {
    if (z_up) up_ = axis_angle(Vec3d{1, 0, 0}, -90 * kRadiansPerDegree);
  }

  Status run(const std::vector<std::size_t>& joints, Skeleton& skeleton, MotionClip& clip) {
    clip.joints = skeleton.size();
    const Affine3<double> turn{rotation_matrix(up_), {}};
    skeleton.rest_local[0] = turn * skeleton.rest_local[0];
    rest_ = skeleton.rest_local[0].translation;
    std::size_t given = 0, wanted = 1;
    for (const AsfBone& b : file_.bones) wanted += b.turns.empty() ? 0 : 1;
    const auto whole = [&] {
      return given == wanted ? Status()
                             : lines_.bad("a frame of " + std::to_string(given) + " bones, must be " +
                                          std::to_string(wanted));
    };
    std::vector<bool> seen(file_.bones.size());
    while (lines_.next()) {
      const std::string_view word = lines_.word(0);
      if (word == ":DEGREES" || word == ":RADIANS") {
        angle_unit_ = word == ":DEGREES" ? kRadiansPerDegree : 1.0;
      } else if (word.front() == ':') {
        continue;
      } else if (lines_.words().size() == 1 && std::isdigit(static_cast<unsigned char>(word.front()))) {
        if (clip.frames() > 0) {
          if (Status s = whole(); !s) return s;
        }
        // Joints without values take no bytes of the file. They must not fill the memory.
        if (clip.frames() * clip.joints > bytes_) return lines_.bad("more joints than bytes");
        given = 0;
        seen.assign(seen.size(), false);
        clip.rotations.resize(clip.rotations.size() + clip.joints, Quatd{});
        clip.rotations[clip.rotations.size() - clip.joints] = up_;
        clip.root_translation.emplace_back();
      } else {
        const std::size_t b = file_.find(word);
        if (clip.frames() == 0) return lines_.bad(in_quotes(word) + " before the first frame");
        if (b == file_.bones.size()) return lines_.bad("there is no bone " + in_quotes(word));
        if (seen[b]) return lines_.bad("bone " + in_quotes(word) + " twice in a frame");
        seen[b] = true;
        given += b == 0 || !file_.bones[b].turns.empty() ? 1 : 0;
        if (Status s = pose(b, clip.rotations[(clip.frames() - 1) * clip.joints + joints[b]], clip); !s)
          return s;
      }
    }
    if (clip.frames() == 0) return lines_.bad("there are no frames");
    if (Status s = whole(); !s) return s;
    for (const auto& m : skeleton.rest_local) clip.translations.push_back(m.translation);
    return clip.validate();
  }

 private:
  Status pose(std::size_t b, Quatd& out, MotionClip& clip) {
    const AsfBone& bone = file_.bones[b];
    const std::size_t values = b == 0 ? file_.root_order.size() : bone.turns.size();
    if (lines_.words().size() != values + 1) {
      return lines_.bad("bone " + in_quotes(bone.name) + " has " +
                        std::to_string(lines_.words().size() - 1) + " values, must be " +
                        std::to_string(values));
    }
    Quatd m;
    Vec3d place = file_.root_position;
    for (std::size_t k = 0; k < values; ++k) {
      double v = 0.0;
      if (Status s = lines_.number(k + 1, v); !s) return s;
      const bool turns = b != 0 || file_.root_order[k].first;
      const int axis = b == 0 ? file_.root_order[k].second : bone.turns[k];
      if (turns) {
        m = about_axis(axis, v * angle_unit_) * m;
      } else {
        place[axis] += v;
      }
    }
    out = bone.axis * m * conjugate(bone.axis);
    if (b == 0) {
      out = up_ * out;
      clip.root_translation.back() = rotate(up_, place * scale_) - rest_;
    }
    normalize(out);
    return {};
  }

  TextLines lines_;
  const AsfSkeleton& file_;
  double scale_, angle_unit_;
  std::size_t bytes_;
  Quatd up_{};
  Vec3d rest_{};
};

}  // namespace

Result<LoadedMotion> load_amc(const std::filesystem::path& skeleton, const std::filesystem::path& motion,
                              const AmcOptions& options) {
  return detail::guarded(motion.string(), [&]() -> Result<LoadedMotion> {
    const std::string name = skeleton.string(), clip_name = motion.string();
    gsnav::detail::FieldCheck check(clip_name + ": AmcOptions.");
    check.positive("frame_rate", options.frame_rate);
    if (options.scale != 0) check.positive("scale", options.scale);
    if (!check.status()) return check.status();
    const auto asf = detail::read_file(skeleton), amc = detail::read_file(motion);
    if (!asf) return asf.status();
    if (!amc) return amc.status();
    const auto file = detail::read_asf(asf->text(), name);
    if (!file) return file.status();
    const double scale = options.scale > 0 ? options.scale : 0.0254 / file->length_unit;
    LoadedMotion out;
    std::vector<std::size_t> joints;
    if (Status s = detail::asf_joints(*file, scale, name, out.skeleton, joints); !s)
      return {Errc::invalid_file, s.message()};
    out.clip.frame_rate = options.frame_rate;
    if (Status s = AmcReader(amc->text(), clip_name, *file, scale, options.z_up)
                       .run(joints, out.skeleton, out.clip);
        !s) {
      return {Errc::invalid_file, s.message()};
    }
    out.clip.wrap_time = smooth_wrap_time(out.skeleton, out.clip);
    return out;
  });
}

}  // namespace gsnav::io
