// SPDX-License-Identifier: Apache-2.0
#include "gsnav/avatar/motion.hpp"

#include <cmath>
#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/math/screw.hpp"
#include "gsnav/detail/skin/fk.hpp"
#include "gsnav/skin/lbs.hpp"

namespace gsnav {

namespace {

/// Joint j between keys a and b of a clip. Its translation does not move if there is one for all keys.
void blend_keys(const MotionClip& clip, std::size_t a, std::size_t b, std::size_t j, double u,
                LocalPose& out) {
  const std::size_t n = clip.joints;
  out.rotations[j] = slerp(clip.rotations[a * n + j], clip.rotations[b * n + j], u);
  out.translations[j] = clip.translations.size() != n
                            ? lerp(clip.translations[a * n + j], clip.translations[b * n + j], u)
                            : clip.translations[j];
}

}  // namespace

void MotionSource::pose_of(const MotionInput& input, [[maybe_unused]] const std::vector<char>& needed,
                           LocalPose& out) const {
  pose(input, out);
}

double MotionClip::duration() const noexcept {
  return frames() == 0 ? 0.0 : static_cast<double>(frames() - 1) / frame_rate;
}

Status MotionClip::validate() const {
  const BadArgument bad{"MotionClip."};
  const std::size_t t = frames();
  detail::FieldCheck check("MotionClip.");
  if (!check.positive("frame_rate", frame_rate).status()) return check.status();
  if (t == 0 || rotations.size() != t * joints) {
    return bad("rotations has " + std::to_string(rotations.size()) + " values: no multiple of " +
               std::to_string(joints) + " joints");
  }
  if (translations.size() != joints && translations.size() != t * joints) {
    return bad("translations has " + std::to_string(translations.size()) + " values");
  }
  if (!root_translation.empty() && root_translation.size() != t) {
    return bad("root_translation has " + std::to_string(root_translation.size()) + " values for " +
               std::to_string(t) + " keys");
  }
  check.not_negative("wrap_time", wrap_time).positive("playback_rate", playback_rate);
  if (!check.finite("start", start).status()) return check.status();
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    if (!(abs(dot(rotations[i], rotations[i]) - 1.0) < 1e-4)) {
      return bad("rotations: key " + std::to_string(i / joints) + ", joint " +
                 std::to_string(i % joints) + " is no unit quaternion");
    }
  }
  for (const Vec3d& v : translations) {
    if (!is_finite(v)) return bad("translations is not finite");
  }
  for (const Vec3d& v : root_translation) {
    if (!is_finite(v)) return bad("root_translation is not finite");
  }
  return {};
}

void MotionClip::pose_of(const MotionInput& input, const std::vector<char>& needed,
                         LocalPose& out) const {
  const std::size_t last = frames() - 1;
  double t = start + playback_rate * input.time, rounds = 0.0;
  std::size_t a = 0, b = 0;
  double u = 0.0;
  if (end != ClipEnd::hold) {
    rounds = std::floor(t / period());
    t -= rounds * period();
  }
  if (t >= duration()) {
    a = last;
    b = end == ClipEnd::hold ? last : 0;
    u = end == ClipEnd::hold ? 0.0 : clamp((t - duration()) / wrap(), 0.0, 1.0);
  } else if (t > 0) {
    a = static_cast<std::size_t>(t * frame_rate);
    a = a < last ? a : last - 1;
    b = a + 1;
    u = clamp(t * frame_rate - static_cast<double>(a), 0.0, 1.0);
  }
  out.rotations.resize(joints);
  out.translations.resize(joints);
  for (std::size_t j = 0; j < joints; ++j) {
    if (needed.empty() || needed[j] != 0) blend_keys(*this, a, b, j, u, out);
  }
  out.root = {};
  const bool moving = translations.size() != joints;
  if (!root_translation.empty()) {
    const Vec3d travel =
        end == ClipEnd::loop_forward ? root_translation[last] - root_translation[0] : Vec3d{};
    const Vec3d next = root_translation[b] + (a == last && b == 0 ? travel : Vec3d{});
    if (b == a + 1) {
      const auto body = [&](std::size_t key) {
        return RigidPose<double>{rotations[key * joints],
                                 root_translation[key] + translations[moving ? key * joints : 0]};
      };
      const Vec3d first =
          moving ? lerp(translations[a * joints], translations[b * joints], u) : translations[0];
      out.root = screw_between(body(a), body(b), u).translation - first;
    } else {
      out.root = lerp(root_translation[a], next, u);
    }
    out.root += travel * rounds;
  }
}

Result<MotionClip> MotionClip::section(std::size_t first, std::size_t count) const {
  if (count == 0 || first > frames() || count > frames() - first) {
    return {Errc::invalid_argument, "MotionClip: keys " + std::to_string(first) + " to " +
                                        std::to_string(first + count) + " of " +
                                        std::to_string(frames())};
  }
  const auto cut = [&](const auto& all, std::size_t row) {
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first * row);
    return std::remove_cvref_t<decltype(all)>(begin, begin + static_cast<std::ptrdiff_t>(count * row));
  };
  MotionClip out = *this;
  out.rotations = cut(rotations, joints);
  if (translations.size() != joints) out.translations = cut(translations, joints);
  if (!root_translation.empty()) out.root_translation = cut(root_translation, 1);
  return out;
}

double smooth_wrap_time(const Skeleton& skeleton, const MotionClip& clip, bool forward, double speed) {
  const std::size_t last = clip.frames() - 1;
  LocalPose pose = skeleton.rest_pose();
  std::vector<Affine3<double>> globals;
  std::vector<Vec3d> before(clip.joints);
  double fastest = 0.0;
  constexpr int kSteps = 16;
  for (int k = 0; k <= kSteps; ++k) {
    const double u = static_cast<double>(k) / kSteps;
    for (std::size_t j = 0; j < clip.joints; ++j) blend_keys(clip, last, 0, j, u, pose);
    forward_kinematics(skeleton, pose, globals);
    Vec3d root{};
    if (!clip.root_translation.empty() && !forward)
      root = lerp(clip.root_translation[last], clip.root_translation[0], u);
    for (std::size_t j = 0; j < clip.joints; ++j) {
      const Vec3d at = globals[j].translation + root;
      if (k > 0) fastest = max(fastest, norm(at - before[j]) * kSteps);
      before[j] = at;
    }
  }
  return fastest / speed;
}

Result<MotionClip> clip_from_matrices(const Skeleton& skeleton, double frame_rate,
                                      const std::vector<Affine3<double>>& matrices, bool skinning) {
  if (Status s = skeleton.validate(); !s) return s;
  const std::size_t count = skeleton.size(), frames = matrices.size() / count;
  if (frames == 0 || matrices.size() != frames * count) {
    return {Errc::invalid_argument, "joint matrices: " + std::to_string(matrices.size()) +
                                        " is no multiple of " + std::to_string(count) + " joints"};
  }
  std::vector<Affine3<double>> binds = skeleton.bind_inverses();
  for (auto& m : binds) m = rigid_inverse(m);
  MotionClip clip;
  clip.frame_rate = frame_rate;
  clip.joints = count;
  std::vector<Affine3<double>> globals(count);
  for (std::size_t t = 0; t < frames; ++t) {
    for (std::size_t j = 0; j < count; ++j) {
      const Affine3<double>& m = matrices[t * count + j];
      if (!is_finite(m.translation) || !(determinant(m.linear) > kMinBlendDeterminant)) {
        return {Errc::invalid_argument, "joint matrices: key " + std::to_string(t) + ", joint " +
                                            std::to_string(j) + " is no rigid transform"};
      }
      const Affine3<double> rigid{polar_rotation(m.linear), m.translation};
      globals[j] = skinning ? rigid * binds[j] : rigid;
      const Affine3<double> local = joint_local(globals.data(), skeleton.parents[j], globals[j]);
      clip.rotations.push_back(quat_from_matrix(local.linear));
      clip.translations.push_back(local.translation);
    }
    const Vec3d root = clip.translations[t * count] - skeleton.rest_local[0].translation;
    clip.root_translation.push_back(root);
    for (std::size_t j = 0; j < count; ++j) {
      if (skeleton.parents[j] < 0) clip.translations[t * count + j] -= root;
    }
  }
  if (Status s = clip.validate(); !s) return s;
  return clip;
}

}  // namespace gsnav
