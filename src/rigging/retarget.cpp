// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/retarget.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/skin/lbs.hpp"

namespace gsnav {

namespace {

constexpr std::size_t kUnpaired = static_cast<std::size_t>(-1);

Status retarget_error(const std::string& what) { return {Errc::invalid_argument, "retarget: " + what}; }

/// The smallest rotation that turns a into b (both of any length above zero).
Mat3d rotation_between(const Vec3d& a, const Vec3d& b) {
  const Vec3d u = normalized(a), v = normalized(b);
  Quatd q{1.0 + dot(u, v), cross(u, v).x, cross(u, v).y, cross(u, v).z};
  if (q.w < 1e-9) {  // opposite: half a turn about any perpendicular axis
    const Vec3d side = normalized(abs(u.x) < 0.9 ? cross(u, Vec3d{1, 0, 0}) : cross(u, Vec3d{0, 1, 0}));
    q = {0.0, side.x, side.y, side.z};
  }
  normalize(q);
  return rotation_matrix(q);
}

/// Height of a joint above the lowest joint.
double height_of(const std::vector<Affine3<double>>& rest, std::size_t joint) {
  double lowest = rest[joint].translation.y;
  for (const auto& m : rest) lowest = min(lowest, m.translation.y);
  return rest[joint].translation.y - lowest;
}

/// The pose of one frame of a clip.
LocalPose key_pose(const MotionClip& clip, std::size_t key) {
  LocalPose out;
  const auto n = static_cast<std::ptrdiff_t>(clip.joints), at = static_cast<std::ptrdiff_t>(key) * n;
  out.rotations.assign(clip.rotations.begin() + at, clip.rotations.begin() + at + n);
  const auto places = clip.translations.begin() + (clip.translations.size() != clip.joints ? at : 0);
  out.translations.assign(places, places + n);
  return out;
}

class Retargeter {
 public:
  Retargeter(const Skeleton& source, const Skeleton& target, const RetargetOptions& options)
      : source_(source),
        target_(target),
        options_(options),
        source_rest_(source.rest_globals()),
        target_rest_(target.rest_globals()),
        turn_(rotation_matrix(axis_angle(Vec3d{0, 1, 0}, options.yaw))),
        from_(target.size(), kUnpaired),
        align_(target.size(), Mat3d::identity()) {}

  Status prepare() {
    if (Status s = pair_joints(); !s) return s;
    if (Status s = find_scale(); !s) return s;
    align_rest_poses();
    return {};
  }

  MotionClip run(const MotionClip& clip) const {
    MotionClip out;
    out.frame_rate = clip.frame_rate;
    out.joints = target_.size();
    out.end = clip.end;
    out.wrap_time = clip.wrap_time;
    out.playback_rate = clip.playback_rate;
    out.start = clip.start;
    const bool several_roots = std::count_if(target_.parents.begin(), target_.parents.end(),
                                             [](auto parent) { return parent < 0; }) > 1;
    LocalPose pose = target_.rest_pose();
    if (!several_roots) out.translations = pose.translations;
    std::vector<Affine3<double>> globals;
    for (std::size_t t = 0; t < clip.frames(); ++t) {
      forward_kinematics(source_, key_pose(clip, t), globals);
      turn_joints(globals, pose);
      out.rotations.insert(out.rotations.end(), pose.rotations.begin(), pose.rotations.end());
      if (several_roots) {  // roots that move against each other
        out.translations.insert(out.translations.end(), pose.translations.begin(),
                                pose.translations.end());
      }
      const Vec3d path = clip.root_translation.empty() ? Vec3d{} : clip.root_translation[t];
      out.root_translation.push_back(
          turn_ * (globals[from_[0]].translation + path - source_rest_[from_[0]].translation) * scale_);
    }
    return out;
  }

 private:
  Status pair_joints() {
    for (const auto& [to_name, from_name] : options_.joints) {
      const int to = target_.find(to_name), at = source_.find(from_name);
      if (to < 0) return retarget_error("the target has no joint \"" + to_name + "\"");
      if (at < 0) return retarget_error("the source has no joint \"" + from_name + "\"");
      from_[static_cast<std::size_t>(to)] = static_cast<std::size_t>(at);
    }
    if (from_[0] != kUnpaired) return {};
    return retarget_error("the target's root \"" + target_.names[0] + "\" has no pair");
  }

  Status find_scale() {
    scale_ = options_.root_scale;
    if (scale_ == 0.0) {
      const double have = height_of(source_rest_, from_[0]), want = height_of(target_rest_, 0);
      if (!(have > 0) || !(want > 0))
        return retarget_error("a root is not above the lowest joint: root_scale is needed");
      scale_ = want / have;
    }
    if (scale_ > 0 && is_finite(scale_) && is_finite(options_.yaw)) return {};
    return retarget_error("root_scale or yaw is not finite");
  }

  /// The nearest paired ancestor of each joint.
  std::vector<std::size_t> paired_above() const {
    std::vector<std::size_t> above(target_.size(), kUnpaired);
    for (std::size_t j = 0; j < above.size(); ++j) {
      for (std::int32_t p = target_.parents[j]; p >= 0 && above[j] == kUnpaired;
           p = target_.parents[static_cast<std::size_t>(p)]) {
        if (from_[static_cast<std::size_t>(p)] != kUnpaired) above[j] = static_cast<std::size_t>(p);
      }
    }
    return above;
  }

  /// Finds for each paired joint the rotation from the rest pose of the target to that of the source. It
  /// aligns the limb towards the only paired joint next below it. Without such a joint it is that of the
  /// joint above.
  void align_rest_poses() {
    const std::vector<std::size_t> above = paired_above();
    for (std::size_t j = 0; j < align_.size(); ++j) {
      if (from_[j] == kUnpaired || std::find(options_.same_rest.begin(), options_.same_rest.end(),
                                             target_.names[j]) != options_.same_rest.end())
        continue;
      std::size_t child = kUnpaired, children = 0;
      for (std::size_t c = j + 1; c < align_.size(); ++c) {
        if (above[c] != j || from_[c] == kUnpaired) continue;
        child = c;
        ++children;
      }
      if (children == 0 && above[j] != kUnpaired) align_[j] = align_[above[j]];
      if (children != 1) continue;
      const Vec3d have = target_rest_[child].translation - target_rest_[j].translation;
      const Vec3d want =
          turn_ * (source_rest_[from_[child]].translation - source_rest_[from_[j]].translation);
      if (norm(have) > 0 && norm(want) > 0) align_[j] = rotation_between(have, want);
    }
  }

  /// Rotates the joints of the target to match those of the source. `pose` has the translations of the
  /// rest pose.
  void turn_joints(const std::vector<Affine3<double>>& globals, LocalPose& pose) const {
    const Mat3d back = transpose(turn_);
    std::vector<Mat3d> turned(target_.size());
    for (std::size_t j = 0; j < turned.size(); ++j) {
      const std::int32_t parent = target_.parents[j];
      const Mat3d above = parent < 0 ? Mat3d::identity() : turned[static_cast<std::size_t>(parent)];
      const bool further_root = parent < 0 && j > 0;
      Mat3d carried = Mat3d::identity();  // a further root moves with the first
      if (further_root) {
        carried = turned[0] * transpose(target_rest_[0].linear);
        const Vec3d first = target_rest_[0].translation;
        pose.translations[j] = first + carried * (target_rest_[j].translation - first);
      }
      if (from_[j] == kUnpaired) {
        turned[j] = above * carried * target_.rest_local[j].linear;
        if (further_root) pose.rotations[j] = quat_from_matrix(turned[j]);
        continue;
      }
      const Mat3d moved = globals[from_[j]].linear * transpose(source_rest_[from_[j]].linear);
      turned[j] = polar_rotation(turn_ * moved * back * align_[j] * target_rest_[j].linear);
      pose.rotations[j] = quat_from_matrix(transpose(above) * turned[j]);
    }
  }

  const Skeleton &source_, &target_;
  const RetargetOptions& options_;
  std::vector<Affine3<double>> source_rest_, target_rest_;
  Mat3d turn_;
  double scale_ = 1.0;
  std::vector<std::size_t> from_;  ///< source joint of each target joint, or kUnpaired
  std::vector<Mat3d> align_;
};

}  // namespace

Result<MotionClip> retarget(const MotionClip& clip, const Skeleton& source, const Skeleton& target,
                            const RetargetOptions& options) {
  for (const Skeleton* s : {&source, &target}) {
    if (Status status = s->validate(); !status) return status;
  }
  if (Status s = clip.validate(); !s) return s;
  if (clip.joints != source.size()) return retarget_error("the clip is of another skeleton");
  Retargeter retargeter(source, target, options);
  if (Status s = retargeter.prepare(); !s) return s;
  MotionClip out = retargeter.run(clip);
  if (Status s = out.validate(); !s) return s;
  return out;
}

}  // namespace gsnav
