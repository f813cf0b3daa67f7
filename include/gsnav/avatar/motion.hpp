// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/kernels/lbs.hpp"
#include "gsnav/math/screw.hpp"

namespace gsnav {

/// What a motion may depend on: time, and how the actor gets about at that time.
struct MotionInput {
  double time = 0.0;      ///< seconds since the actor appeared
  double distance = 0.0;  ///< metres walked since then
  /// Distances at which the present walk began and will end with a stop; infinite where there is none.
  double leg_begin = -std::numeric_limits<double>::infinity();
  double leg_end = std::numeric_limits<double>::infinity();
  double turned = 0.0;    ///< radians turned on the spot since then, counted up whatever the direction
  double walking = 0.0;   ///< speed as a share of the walking speed, [0, 1]
  double turning = 0.0;   ///< how much of a turn on the spot is going on, [0, 1]
};

/// Gives the joints' local transforms over time. Implementations are immutable: many actors on many
/// threads may share one.
class MotionSource {
 public:
  virtual ~MotionSource() = default;
  /// Fills all of `out`. The same input gives the same pose.
  virtual void pose(const MotionInput& input, LocalPose& out) const = 0;
  /// The same for those joints whose `needed` [J] is not 0; of others `out` has anything. Their ancestors are needed too.
  virtual void pose_of(const MotionInput& input, [[maybe_unused]] const std::vector<char>& needed, LocalPose& out) const {
    pose(input, out);
  }
  /// Number of joints of the poses.
  virtual std::size_t joint_count() const noexcept = 0;
  /// invalid_argument naming what is wrong.
  virtual Status validate() const { return {}; }
};

/// One pose for ever.
class FixedPose final : public MotionSource {
 public:
  explicit FixedPose(LocalPose pose) : pose_(std::move(pose)) {}
  void pose(const MotionInput&, LocalPose& out) const override { out = pose_; }
  std::size_t joint_count() const noexcept override { return pose_.rotations.size(); }
  Status validate() const override { return pose_.validate("FixedPose"); }

 private:
  LocalPose pose_;
};

/// What happens after the last frame of a clip.
enum class ClipEnd : std::uint8_t {
  hold,          ///< the last pose stays
  loop,          ///< back to the first pose over `wrap_time`; the root goes back as well
  loop_forward,  ///< the same, but the root goes on from where it has come to
};

/// Key poses at a fixed rate. Between keys rotations are interpolated by slerp in local joint space and
/// translations linearly: bones keep their length, unlike with interpolated matrices. The first joint of a clip
/// with a path (`root_translation`) is a free body and moves by a screw from key to key, so that it does not matter
/// which of its points is called the root; across the wrap of a loop it goes straight. Further roots go straight as seen from
/// it.
class MotionClip final : public MotionSource {
 public:
  double frame_rate = 30.0;                ///< keys a second
  std::size_t joints = 0;                  ///< J
  std::vector<Quatd> rotations;            ///< [T][J] joint to parent, unit
  std::vector<Vec3d> translations;         ///< [T][J] or [J] (the same in all keys), metres
  std::vector<Vec3d> root_translation;     ///< [T] path of the whole avatar in its frame, or empty
  ClipEnd end = ClipEnd::loop;
  /// Seconds from last to first key, at least one frame: smooth_wrap_time says how many nobody jumps in.
  double wrap_time = 0.0;
  double playback_rate = 1.0;              ///< seconds of the clip that go by in one second, > 0
  double start = 0.0;                      ///< seconds into the clip (in its own time) at time 0

  std::size_t frames() const noexcept { return joints == 0 ? 0 : rotations.size() / joints; }
  /// Seconds from the first key to the last.
  double duration() const noexcept {
    return frames() == 0 ? 0.0 : static_cast<double>(frames() - 1) / frame_rate;
  }
  /// Seconds of one round of a loop.
  double period() const noexcept { return duration() + wrap(); }

  std::size_t joint_count() const noexcept override { return joints; }

  Status validate() const override {
    const auto bad = [](const std::string& what) { return Status(Errc::invalid_argument, "MotionClip." + what); };
    const std::size_t t = frames();
    if (!(frame_rate > 0) || !is_finite(frame_rate)) return bad("frame_rate must be positive");
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
    if (!(wrap_time >= 0) || !is_finite(wrap_time)) return bad("wrap_time must be >= 0");
    if (!(playback_rate > 0) || !is_finite(playback_rate)) return bad("playback_rate must be positive");
    if (!is_finite(start)) return bad("start must be finite");
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

  void pose(const MotionInput& input, LocalPose& out) const override { pose_of(input, {}, out); }
  /// `needed` may be empty: all are.
  void pose_of(const MotionInput& input, const std::vector<char>& needed, LocalPose& out) const override {
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
    const bool moving = translations.size() != joints;
    for (std::size_t j = 0; j < joints; ++j) {
      if (!needed.empty() && needed[j] == 0) continue;
      out.rotations[j] = slerp(rotations[a * joints + j], rotations[b * joints + j], u);
      out.translations[j] =
          moving ? lerp(translations[a * joints + j], translations[b * joints + j], u) : translations[j];
    }
    out.root = {};
    if (!root_translation.empty()) {
      const Vec3d travel = end == ClipEnd::loop_forward ? root_translation[last] - root_translation[0] : Vec3d{};
      const Vec3d next = root_translation[b] + (a == last && b == 0 ? travel : Vec3d{});
      if (b == a + 1) {
        const auto body = [&](std::size_t key) {
          return RigidPose<double>{rotations[key * joints],
                                   root_translation[key] + translations[moving ? key * joints : 0]};
        };
        const Vec3d first = moving ? lerp(translations[a * joints], translations[b * joints], u) : translations[0];
        out.root = screw_between(body(a), body(b), u).translation - first;
      } else {
        out.root = lerp(root_translation[a], next, u);
      }
      out.root += travel * rounds;
    }
  }

  /// The keys [first, first + count) as a clip of their own. Errors: invalid_argument (keys that are not there).
  Result<MotionClip> section(std::size_t first, std::size_t count) const {
    if (count == 0 || first > frames() || count > frames() - first) {
      return {Errc::invalid_argument, "MotionClip: keys " + std::to_string(first) + " to " +
                                          std::to_string(first + count) + " of " + std::to_string(frames())};
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

 private:
  double wrap() const noexcept { return max(wrap_time, 1.0 / frame_rate); }
};

/// Seconds that it takes to get from a clip's last pose to its first (MotionClip::wrap_time of a loop) when no joint is
/// to move faster than `speed` (metres a second); 0 for a clip that ends as it begins. `forward`: for a loop that goes on
/// where it has come to. The clip is of the skeleton.
inline double smooth_wrap_time(const Skeleton& skeleton, const MotionClip& clip, bool forward = false,
                               double speed = 1.5) {
  const std::size_t last = clip.frames() - 1;
  LocalPose pose = skeleton.rest_pose();
  std::vector<Affine3<double>> globals;
  std::vector<Vec3d> before(clip.joints);
  double fastest = 0.0;
  constexpr int kSteps = 16;
  const bool moving = clip.translations.size() != clip.joints;
  for (int k = 0; k <= kSteps; ++k) {
    const double u = static_cast<double>(k) / kSteps;
    for (std::size_t j = 0; j < clip.joints; ++j) {
      pose.rotations[j] = slerp(clip.rotations[last * clip.joints + j], clip.rotations[j], u);
      pose.translations[j] =
          moving ? lerp(clip.translations[last * clip.joints + j], clip.translations[j], u) : clip.translations[j];
    }
    forward_kinematics(skeleton, pose, globals);
    Vec3d root{};
    if (!clip.root_translation.empty() && !forward) root = lerp(clip.root_translation[last], clip.root_translation[0], u);
    for (std::size_t j = 0; j < clip.joints; ++j) {
      const Vec3d at = globals[j].translation + root;
      if (k > 0) fastest = max(fastest, norm(at - before[j]) * kSteps);
      before[j] = at;
    }
  }
  return fastest / speed;
}

/// A clip from matrices: `matrices` is [T][J], joint to root frame, or with `skinning` the product of
/// that and the skeleton's inverse bind. Each is taken apart into a rotation (its polar factor) and a
/// translation in its parent, so that sampling is by slerp and not by mixing matrices. The path of the
/// first root joint becomes `root_translation`. Errors: invalid_argument.
inline Result<MotionClip> clip_from_matrices(const Skeleton& skeleton, double frame_rate,
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
      const std::int32_t parent = skeleton.parents[j];
      const Affine3<double> local =
          parent < 0 ? globals[j] : rigid_inverse(globals[static_cast<std::size_t>(parent)]) * globals[j];
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
