// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "file.hpp"
#include "gsnav/detail/avatar/capsule_track.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "gsnav/detail/io/avatar_scene_file.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "npz_arrays.hpp"

namespace gsnav::io {
namespace {

/// The path of the clip's root joint, on the floor below it. Avatars are scaled about it.
class ClipPath final : public Trajectory {
 public:
  ClipPath(std::shared_ptr<const MotionClip> clip, std::vector<double> floor, double offset_y)
      : clip_(std::move(clip)), floor_(std::move(floor)), offset_y_(offset_y) {}

  TrajectorySample at(double t) const override {
    LocalPose pose;
    MotionInput in{.time = t};
    clip_->pose(in, pose);
    TrajectorySample out;
    out.position = {pose.translations[0].x + pose.root.x, floor_at(t) + offset_y_,
                    pose.translations[0].z + pose.root.z};
    return out;
  }
  double floor_at(double t) const {
    const double k = clamp(t * clip_->frame_rate, 0.0, static_cast<double>(floor_.size() - 1));
    const std::size_t a = std::min(static_cast<std::size_t>(k), floor_.size() - 1),
                      b = std::min(a + 1, floor_.size() - 1);
    return floor_[a] + (floor_[b] - floor_[a]) * (k - static_cast<double>(a));
  }

 private:
  std::shared_ptr<const MotionClip> clip_;
  std::vector<double> floor_;  // [T] metres
  double offset_y_;
};

/// The clip without the movement that ClipPath has.
class ClipInPlace final : public MotionSource {
 public:
  ClipInPlace(std::shared_ptr<const MotionClip> clip, std::shared_ptr<const ClipPath> path)
      : clip_(std::move(clip)), path_(std::move(path)) {}
  void pose(const MotionInput& input, LocalPose& out) const override {
    clip_->pose(input, out);
    const Vec3d at{out.translations[0].x + out.root.x, path_->floor_at(input.time),
                   out.translations[0].z + out.root.z};
    out.root -= at;
  }
  std::size_t joint_count() const noexcept override { return clip_->joint_count(); }
  Status validate() const override { return clip_->validate(); }

 private:
  std::shared_ptr<const MotionClip> clip_;
  std::shared_ptr<const ClipPath> path_;
};

/// Moves the whole clip and its capsules by one rigid map for each frame (the last of `by` for further
/// frames). All roots of the skeleton move alike. The clip is one that load_driver made: with a position
/// for each joint and frame, and a path.
void move_clip(const Skeleton& skeleton, LoadedDriver& driver, const std::vector<Affine3<double>>& by) {
  MotionClip& clip = driver.clip;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    const Affine3<double>& m = by[std::min(t, by.size() - 1)];
    Quatd* rotations = &clip.rotations[t * clip.joints];
    Vec3d* places = &clip.translations[t * clip.joints];
    // The first root keeps its position in the clip. Its movement goes into the path.
    const Vec3d before = clip.root_translation[t], after = m * (before + places[0]) - places[0];
    for (std::size_t j = 0; j < clip.joints; ++j) {
      if (skeleton.parents[j] >= 0) continue;
      rotations[j] = quat_from_matrix(m.linear) * rotations[j];
      normalize(rotations[j]);
      if (j > 0) places[j] = m * (before + places[j]) - after;
    }
    clip.root_translation[t] = after;
    if (t < driver.capsules.size()) {
      for (Capsule<double>& c : driver.capsules[t]) c = {m * c.p0, m * c.p1, c.radius};
    }
  }
}

/// Height of the floor below the clip in each frame: the lowest joint within half a second.
std::vector<double> floor_of(const Skeleton& skeleton, const MotionClip& clip) {
  const std::size_t n = clip.frames();
  std::vector<double> lowest(n), out(n);
  LocalPose pose;
  std::vector<Affine3<double>> globals;
  for (std::size_t t = 0; t < n; ++t) {
    MotionInput in{.time = static_cast<double>(t) / clip.frame_rate};
    clip.pose(in, pose);
    forward_kinematics(skeleton, pose, globals);
    lowest[t] = globals[0].translation.y;
    for (const auto& g : globals) lowest[t] = std::min(lowest[t], g.translation.y);
    lowest[t] += pose.root.y;
  }
  const auto around = static_cast<std::size_t>(std::min(0.5 * clip.frame_rate, 1e9));
  for (std::size_t t = 0; t < n; ++t) {
    const std::size_t a = t - std::min(t, around), b = std::min(n, t + around + 1);
    out[t] = *std::min_element(lowest.begin() + static_cast<std::ptrdiff_t>(a),
                               lowest.begin() + static_cast<std::ptrdiff_t>(b));
  }
  return out;
}

Result<std::vector<Affine3<double>>> load_trajectory(const std::filesystem::path& path) {
  const auto file = NpzFile::open(path);
  if (!file) return file.status();
  const std::vector<std::string> names = file->names();
  const std::string name = file->contains("trajectory") ? "trajectory"
                           : names.size() == 1          ? names[0]
                                                        : "trajectory";
  const detail::NpzArrays arrays(*file);
  const auto a = arrays.read(name, {detail::NpzArrays::kAny, 7});
  if (!a) return a.status();
  std::vector<Affine3<double>> out;
  for (std::size_t t = 0; 7 * t < a->values.size(); ++t) {
    const double* v = &a->values[7 * t];
    Quatd q{v[6], v[3], v[4], v[5]};
    if (!normalize(q))
      return detail::invalid_file(path, name + ": row " + std::to_string(t) + " has no rotation");
    out.push_back({rotation_matrix(q), {v[0], v[1], v[2]}});
  }
  return out;
}

Result<AvatarActor> load_actor(const SceneAvatar& a,
                               std::map<std::string, std::shared_ptr<const AvatarAsset>>& bodies) {
  std::shared_ptr<const AvatarAsset>& file_body = bodies[a.canonical.string()];
  if (file_body == nullptr) {
    auto loaded = load_avatar(a.canonical);
    if (!loaded) return loaded.status();
    file_body = std::make_shared<const AvatarAsset>(std::move(loaded->asset));
  }
  std::shared_ptr<const AvatarAsset> body = file_body;
  auto driver = load_driver(a.driver, body->skeleton);
  if (!driver) return driver.status();
  driver->clip.end = ClipEnd::hold;
  if (!a.trajectory.empty()) {
    const auto path = load_trajectory(a.trajectory);
    if (!path) return path.status();
    if (path->empty()) return {Errc::invalid_file, a.trajectory.string() + ": there are no rows"};
    move_clip(body->skeleton, *driver, *path);
  }
  Affine3<double> coordinates = a.coordinates;
  if (a.guess_coordinates) {
    // Habitat-GS's rule: a root that is upside down comes from a frame with Y down.
    const Mat3d first =
        rotation_matrix(driver->clip.rotations[0]) * transpose(body->skeleton.rest_local[0].linear);
    if (first(1, 1) < -0.7 && first(2, 2) < -0.7)
      coordinates.linear = {{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  }
  move_clip(body->skeleton, *driver, {coordinates});
  if (body->capsules.empty() && !driver->capsules.empty() && !driver->capsules[0].empty()) {
    // Keep the file's body as it is, because another entry may have another driver.
    std::shared_ptr<const AvatarAsset>& of_driver =
        bodies[a.canonical.string() + '\n' + a.driver.string()];
    if (of_driver == nullptr) {
      const auto tracked = capsules_from_track(body->skeleton, driver->clip, driver->capsules);
      if (!tracked) return tracked.status();
      AvatarAsset with = *body;
      with.capsules = tracked->capsules;
      of_driver = std::make_shared<const AvatarAsset>(std::move(with));
    }
    body = of_driver;
  }
  ActorOptions options{.time_begin = a.time_begin,
                       .time_end = a.time_end.value_or(a.time_begin + driver->clip.duration()),
                       .scale = a.scale};
  std::vector<double> floor = floor_of(body->skeleton, driver->clip);
  const auto clip = std::make_shared<const MotionClip>(std::move(driver->clip));
  const auto path = std::make_shared<const ClipPath>(clip, std::move(floor), a.offset_y);
  return AvatarActor::create(body, std::make_shared<const ClipInPlace>(clip, path), path, options);
}

/// Makes actors repeat after `last` seconds plus a blend, long enough for those that are present at both
/// ends to move back.
Status loop_actors(std::vector<AvatarActor>& actors, double last, double least) {
  constexpr double kSpeed = 1.4;  // metres per second
  double blend = 0.0;
  std::vector<Affine3<double>> from, to;
  for (const AvatarActor& a : actors) {
    if (!(least > 0) || !a.active(last) || !a.active(0.0)) continue;
    blend = std::max(blend, least);
    const Similarity begin = a.placement(0.0), end = a.placement(last);
    a.joint_globals(last, from);
    a.joint_globals(0.0, to);
    for (std::size_t j = 0; j < from.size(); ++j) {
      blend = std::max(blend, norm(end * from[j].translation - begin * to[j].translation) / kSpeed);
    }
  }
  for (AvatarActor& a : actors) {
    auto looped = a.looped(last + blend, blend);
    if (!looped) return looped.status();
    a = std::move(*looped);
  }
  return {};
}

}  // namespace

Result<std::vector<AvatarActor>> load_scene_actors(const AvatarScene& scene) {
  return detail::guarded("avatars of a scene", [&]() -> Result<std::vector<AvatarActor>> {
    std::vector<AvatarActor> out;
    std::map<std::string, std::shared_ptr<const AvatarAsset>> bodies;
    for (const SceneAvatar& a : scene.avatars) {
      auto actor = load_actor(a, bodies);
      if (!actor) {
        const Status s = actor.status();
        return {s.code(), (a.name.empty() ? "" : "avatar \"" + a.name + "\": ") + s.message()};
      }
      out.push_back(std::move(*actor));
    }
    double last = scene.time_max;
    for (const AvatarActor& a : out) {
      if (!(scene.time_max > 0) && std::isfinite(a.options().time_end))
        last = std::max(last, a.options().time_end);
    }
    if (scene.time_loop && last > 0) {
      if (Status s = loop_actors(out, last, scene.loop_blend); !s) return s;
    }
    return out;
  });
}

}  // namespace gsnav::io
