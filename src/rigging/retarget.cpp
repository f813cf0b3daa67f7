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

/// The smallest rotation that turns a into b (both of any length above zero).
Mat3d rotation_between(const Vec3d& a, const Vec3d& b) {
  const Vec3d u = normalized(a), v = normalized(b);
  Quatd q{1.0 + dot(u, v), cross(u, v).x, cross(u, v).y, cross(u, v).z};
  if (q.w < 1e-9) {  // opposite: half a turn about anything across
    const Vec3d side = normalized(abs(u.x) < 0.9 ? cross(u, Vec3d{1, 0, 0}) : cross(u, Vec3d{0, 1, 0}));
    q = {0.0, side.x, side.y, side.z};
  }
  normalize(q);
  return rotation_matrix(q);
}

double height_of(const std::vector<Affine3<double>>& rest, std::size_t joint) {
  double lowest = rest[joint].translation.y;
  for (const auto& m : rest) lowest = min(lowest, m.translation.y);
  return rest[joint].translation.y - lowest;
}

}  // namespace

Result<MotionClip> retarget(const MotionClip& clip, const Skeleton& source, const Skeleton& target,
                            const RetargetOptions& options) {
  const auto bad = [](const std::string& what) {
    return Status(Errc::invalid_argument, "retarget: " + what);
  };
  for (const Skeleton* s : {&source, &target}) {
    if (Status status = s->validate(); !status) return status;
  }
  if (Status s = clip.validate(); !s) return s;
  if (clip.joints != source.size()) return bad("the clip is of another skeleton");
  constexpr std::size_t none = static_cast<std::size_t>(-1);
  const std::size_t joints = target.size();
  std::vector<std::size_t> from(joints, none);
  for (const auto& [to_name, from_name] : options.joints) {
    const int to = target.find(to_name), at = source.find(from_name);
    if (to < 0) return bad("the target has no joint \"" + to_name + "\"");
    if (at < 0) return bad("the source has no joint \"" + from_name + "\"");
    from[static_cast<std::size_t>(to)] = static_cast<std::size_t>(at);
  }
  if (from[0] == none) return bad("the target's root \"" + target.names[0] + "\" has no pair");
  const auto source_rest = source.rest_globals(), target_rest = target.rest_globals();
  double scale = options.root_scale;
  if (scale == 0.0) {
    const double have = height_of(source_rest, from[0]), want = height_of(target_rest, 0);
    if (!(have > 0) || !(want > 0))
      return bad("a root is not above the lowest joint: root_scale is needed");
    scale = want / have;
  }
  if (!(scale > 0) || !is_finite(scale) || !is_finite(options.yaw))
    return bad("root_scale or yaw is not finite");
  const Mat3d turn = rotation_matrix(axis_angle(Vec3d{0, 1, 0}, options.yaw)), back = transpose(turn);

  // What turns the target's rest pose into the source's, joint by joint: from the one paired joint next
  // below it, or, without, as the parent.
  std::vector<std::size_t> paired_above(joints, none);  // the paired joint next paired_above
  for (std::size_t j = 0; j < joints; ++j) {
    for (std::int32_t p = target.parents[j]; p >= 0 && paired_above[j] == none;
         p = target.parents[static_cast<std::size_t>(p)]) {
      if (from[static_cast<std::size_t>(p)] != none) paired_above[j] = static_cast<std::size_t>(p);
    }
  }
  std::vector<Mat3d> align(joints, Mat3d::identity());
  for (std::size_t j = 0; j < joints; ++j) {
    if (from[j] == none) continue;
    std::size_t child = none, children = 0;
    for (std::size_t c = j + 1; c < joints; ++c) {
      if (paired_above[c] == j && from[c] != none) {
        child = c;
        ++children;
      }
    }
    if (std::find(options.same_rest.begin(), options.same_rest.end(), target.names[j]) !=
        options.same_rest.end())
      continue;
    if (children == 0 && paired_above[j] != none) align[j] = align[paired_above[j]];
    if (children != 1) continue;
    const Vec3d have = target_rest[child].translation - target_rest[j].translation;
    const Vec3d want = turn * (source_rest[from[child]].translation - source_rest[from[j]].translation);
    if (norm(have) > 0 && norm(want) > 0) align[j] = rotation_between(have, want);
  }

  MotionClip out;
  out.frame_rate = clip.frame_rate;
  out.joints = joints;
  out.end = clip.end;
  out.wrap_time = clip.wrap_time;
  out.playback_rate = clip.playback_rate;
  out.start = clip.start;
  const LocalPose rest = target.rest_pose();
  out.translations = rest.translations;
  std::vector<Vec3d> at_key = rest.translations;
  const bool several_roots =
      std::count_if(target.parents.begin(), target.parents.end(), [](auto p) { return p < 0; }) > 1;
  if (several_roots) out.translations.clear();  // then each key has its own
  LocalPose pose;
  std::vector<Affine3<double>> globals;
  std::vector<Mat3d> turned(joints);
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    const auto begin = clip.rotations.begin() + static_cast<std::ptrdiff_t>(t * clip.joints);
    pose.rotations.assign(begin, begin + static_cast<std::ptrdiff_t>(clip.joints));
    const bool moving = clip.translations.size() != clip.joints;
    const auto places =
        clip.translations.begin() + static_cast<std::ptrdiff_t>(moving ? t * clip.joints : 0);
    pose.translations.assign(places, places + static_cast<std::ptrdiff_t>(clip.joints));
    forward_kinematics(source, pose, globals);
    for (std::size_t j = 0; j < joints; ++j) {
      const std::int32_t parent = target.parents[j];
      const Mat3d above = parent < 0 ? Mat3d::identity() : turned[static_cast<std::size_t>(parent)];
      const bool further_root = parent < 0 && j > 0;
      const Mat3d carried =
          further_root ? turned[0] * transpose(target_rest[0].linear) : Mat3d::identity();
      if (further_root) {
        const Vec3d first = target_rest[0].translation;
        at_key[j] = first + carried * (target_rest[j].translation - first);
      }
      if (from[j] == none) {
        turned[j] = above * carried * target.rest_local[j].linear;
        out.rotations.push_back(further_root ? quat_from_matrix(turned[j]) : rest.rotations[j]);
        continue;
      }
      const Mat3d moved = globals[from[j]].linear * transpose(source_rest[from[j]].linear);
      turned[j] = polar_rotation(turn * moved * back * align[j] * target_rest[j].linear);
      out.rotations.push_back(quat_from_matrix(transpose(above) * turned[j]));
    }
    if (several_roots) out.translations.insert(out.translations.end(), at_key.begin(), at_key.end());
    const Vec3d path = clip.root_translation.empty() ? Vec3d{} : clip.root_translation[t];
    out.root_translation.push_back(
        turn * (globals[from[0]].translation + path - source_rest[from[0]].translation) * scale);
  }
  if (Status s = out.validate(); !s) return s;
  return out;
}

}  // namespace gsnav
