// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "clips.hpp"
#include "commands.hpp"
#include "gsnav/avatar/actor.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/io.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/rigging.hpp"

namespace gsnav_avatar {

using namespace gsnav;

namespace {

Result<NavMesh> find_mesh(const WalkCommand& c) {
  if (!c.flat) return load_navmesh(c.navmesh);
  const auto flat = make_default_scene(0.05);  // The NavMesh does not depend on the density.
  if (!flat) return flat.status();
  NavMeshSettings settings;
  settings.agent_radius = 0.25;
  return NavMesh::build(settings, flat->vertices, flat->triangles);
}

struct WalkPath {
  std::vector<Vec3d> points;
  double length = 0.0;
  double clearance = std::numeric_limits<double>::infinity();  ///< Smallest distance to the edges of the
                                                               ///< mesh.
};

/// The shortest path through all stops on the surface, moved away from the edges of the mesh.
Result<WalkPath> lay_path(const NavMesh& mesh, const WalkCommand& c) {
  std::vector<Vec3d> stops{c.from};
  stops.insert(stops.end(), c.via.begin(), c.via.end());
  stops.push_back(c.to);
  WalkPath out;
  for (std::size_t k = 0; k + 1 < stops.size(); ++k) {
    const auto path = mesh.find_path(stops[k], stops[k + 1]);
    if (!path) return {path.code(), (c.flat ? "the flat" : c.navmesh) + ": " + path.message()};
    NavPath way = *path;
    if (c.clearance > 0 && way.length > 0) {
      ClearanceOptions options;
      options.clearance = c.clearance;
      auto clear = keep_clear(mesh, way.points, options);
      if (!clear) return clear.status();
      out.clearance = min(out.clearance, clear->least);
      way = std::move(clear->path);
    } else {
      for (const Vec3d& p : way.points)
        out.clearance = min(out.clearance, mesh.distance_to_closest_obstacle(p));
    }
    out.length += way.length;
    out.points.insert(out.points.end(), way.points.begin() + (out.points.empty() ? 0 : 1),
                      way.points.end());
  }
  return out;
}

void print_slide(const std::string& when, const FootSlide& s) {
  std::printf("feet slide %.1f mm per step on average, %.1f mm at most, over %zu steps %s\n",
              1e3 * s.mean, 1e3 * s.greatest, s.contacts, when.c_str());
}

double lowest_gaussian(const AvatarAsset& asset) {
  double y = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < asset.size(); ++i) y = min(y, asset.cloud.mean(i).y);
  return y;
}

/// A walk, frame by frame.
struct RecordedWalk {
  std::vector<std::vector<Affine3<double>>> joints;  ///< Transforms to the world.
  std::vector<Vec3d> bodies;                         ///< Positions on the floor.
  std::size_t steady_first = 0, steady_last = 0;     ///< Range of frames at full speed. Empty if first
                                                     ///< >= last.
  double turned = 0.0;                               ///< Radians of turns in place.

  void print_slides(const std::vector<Foot>& feet, const std::string& when) const {
    FootSlideMeter meter(feet);
    for (std::size_t t = 0; t < joints.size(); ++t) meter.add(joints[t], bodies[t]);
    print_slide("in all" + when, meter.measure());
    if (steady_first < steady_last)
      print_slide("at full speed" + when, meter.measure(steady_first, steady_last));
  }
};

RecordedWalk record(const AvatarActor& actor, const WalkTrajectory& path, double frame_rate) {
  RecordedWalk out;
  const auto count = static_cast<std::size_t>(std::ceil(path.arrival() * frame_rate)) + 1;
  out.steady_first = count;
  for (std::size_t t = 0; t < count; ++t) {
    const double time = min(static_cast<double>(t) / frame_rate, path.arrival());
    const TrajectorySample at = path.at(time);
    const Similarity world = actor.placement(time);
    const Affine3<double> placed{rotation_matrix(world.rotation), world.translation};
    std::vector<Affine3<double>>& globals = out.joints.emplace_back();
    actor.joint_globals(time, globals);
    for (auto& m : globals) m = placed * m;
    out.bodies.push_back(at.position);
    out.turned = at.turned;
    if (at.walking > 0.999) {
      out.steady_first = min(out.steady_first, t);
      out.steady_last = max(out.steady_last, t + 1);
    }
  }
  return out;
}

/// Prints how far feet slide. With --lock-feet, holds them in place and prints it again.
Status hold_feet(const WalkCommand& c, const Skeleton& skeleton, const std::vector<Foot>& feet,
                 RecordedWalk& walk) {
  walk.print_slides(feet, c.lock_feet ? " as recorded" : "");
  if (!c.lock_feet) return {};
  const auto locked = lock_feet(skeleton, feet, c.frame_rate, walk.bodies, walk.joints);
  if (!locked) return locked.status();
  walk.print_slides(feet, " with the feet held");
  std::printf("feet were moved by up to %.1f mm; legs were up to %.1f mm too short\n",
              1e3 * locked->moved, 1e3 * locked->out_of_reach);
  return {};
}

Status save_frames(const WalkCommand& c, const AvatarAsset& asset, const RecordedWalk& walk) {
  io::DriverFrames frames;
  frames.frame_rate = c.frame_rate;
  frames.joints = asset.skeleton.size();
  for (const auto& globals : walk.joints) {
    frames.matrices.insert(frames.matrices.end(), globals.begin(), globals.end());
    if (asset.capsules.empty()) continue;
    auto& row = frames.capsules.emplace_back();
    for (const ProxyCapsule& p : asset.capsules) {
      row.push_back({globals[p.joint] * p.p0, globals[p.joint] * p.p1, p.radius});
    }
  }
  if (Status s = io::save_driver(c.out, frames); !s) return s;
  std::printf("%s: %zu frames at %g per second\n", printable(c.out).c_str(), walk.joints.size(),
              c.frame_rate);
  return {};
}

}  // namespace

Status make_walk(const WalkCommand& c) {
  auto avatar = io::load_avatar(c.avatar);
  if (!avatar) return avatar.status();
  const auto mesh = find_mesh(c);
  if (!mesh) return mesh.status();
  auto asset = std::make_shared<const AvatarAsset>(std::move(avatar->asset));
  const Skeleton& skeleton = asset->skeleton;
  const auto clip = load_clip(c.clip, skeleton);
  if (!clip) return clip.status();
  ClipWalkOptions cycle;
  cycle.first = c.first_key;
  cycle.keys = c.keys;
  cycle.floor = lowest_gaussian(*asset);
  auto walk = ClipWalk::create(skeleton, *clip, cycle);
  if (!walk) return walk.status();
  std::printf("%s: keys %zu to %zu are a cycle of %.2f m, walked at %.2f m/s\n",
              printable(c.clip.clip).c_str(), walk->first_key(), walk->first_key() + walk->keys(),
              walk->stride(), walk->speed());
  const auto way = lay_path(*mesh, c);
  if (!way) return way.status();
  WalkOptions options;
  options.speed = c.speed > 0 ? c.speed : walk->speed();
  const auto path = WalkTrajectory::create(way->points, options);
  if (!path) return path.status();
  const double stride = walk->stride();
  const auto actor = AvatarActor::create(asset, std::make_shared<const ClipWalk>(std::move(*walk)),
                                         std::make_shared<const WalkTrajectory>(*path));
  if (!actor) return actor.status();

  RecordedWalk recorded = record(*actor, *path, c.frame_rate);
  std::printf(
      "path of %.2f m in %.2f s at %.2f m/s, %.1f steps, turns on the spot of %.0f degrees; between its "
      "ends and stops the mesh's edges are at least %.2f m away (walls another %.2f m)\n",
      way->length, path->arrival(), options.speed, 2 * way->length / stride,
      recorded.turned * 57.29577951308232, way->clearance, mesh->settings().agent_radius);
  if (Status s = hold_feet(c, skeleton, find_feet(skeleton, cycle.floor), recorded); !s) return s;
  return save_frames(c, *asset, recorded);
}

}  // namespace gsnav_avatar
