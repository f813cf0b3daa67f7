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
  const auto flat = make_default_scene(0.05);  // its mesh does not depend on the density
  if (!flat) return flat.status();
  NavMeshSettings settings;
  settings.agent_radius = 0.25;
  return NavMesh::build(settings, flat->vertices, flat->triangles);
}

/// The shortest path through all the points, drawn away from the mesh's edges, on the surface.
Result<std::vector<Vec3d>> lay_path(const NavMesh& mesh, const WalkCommand& c, double& length,
                                    double& clearance) {
  std::vector<Vec3d> stops{c.from};
  stops.insert(stops.end(), c.via.begin(), c.via.end());
  stops.push_back(c.to);
  std::vector<Vec3d> out;
  length = 0.0;
  clearance = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k + 1 < stops.size(); ++k) {
    const auto path = mesh.find_path(stops[k], stops[k + 1]);
    if (!path) return {path.code(), (c.flat ? "the flat" : c.navmesh) + ": " + path.message()};
    NavPath way = *path;
    if (c.clearance > 0 && way.length > 0) {
      ClearanceOptions options;
      options.clearance = c.clearance;
      auto clear = keep_clear(mesh, way.points, options);
      if (!clear) return clear.status();
      clearance = min(clearance, clear->least);
      way = std::move(clear->path);
    } else {
      for (const Vec3d& p : way.points) clearance = min(clearance, mesh.distance_to_closest_obstacle(p));
    }
    length += way.length;
    out.insert(out.end(), way.points.begin() + (out.empty() ? 0 : 1), way.points.end());
  }
  return out;
}

void print_slide(const std::string& when, const FootSlide& s) {
  std::printf("feet slide %.1f mm a step on average, %.1f mm at most, over %zu steps %s\n", 1e3 * s.mean,
              1e3 * s.greatest, s.contacts, when.c_str());
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
  cycle.floor = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < asset->size(); ++i) cycle.floor = min(cycle.floor, asset->cloud.mean(i).y);
  auto walk = ClipWalk::create(skeleton, *clip, cycle);
  if (!walk) return walk.status();
  std::printf("%s: keys %zu to %zu are a cycle of %.2f m, walked at %.2f m/s\n",
              printable(c.clip.clip).c_str(), walk->first_key(), walk->first_key() + walk->keys(),
              walk->stride(), walk->speed());
  double length = 0.0, clearance = 0.0;
  const auto points = lay_path(*mesh, c, length, clearance);
  if (!points) return points.status();
  WalkOptions options;
  options.speed = c.speed > 0 ? c.speed : walk->speed();
  const auto path = WalkTrajectory::create(*points, options);
  if (!path) return path.status();
  const double stride = walk->stride();
  const auto actor = AvatarActor::create(asset, std::make_shared<const ClipWalk>(std::move(*walk)),
                                         std::make_shared<const WalkTrajectory>(*path));
  if (!actor) return actor.status();

  io::DriverFrames frames;
  frames.frame_rate = c.frame_rate;
  frames.joints = skeleton.size();
  const std::vector<Foot> feet = find_feet(skeleton, cycle.floor);
  std::vector<std::vector<Affine3<double>>> joints;
  std::vector<Vec3d> bodies;
  const auto count = static_cast<std::size_t>(std::ceil(path->arrival() * c.frame_rate)) + 1;
  std::size_t steady_first = count, steady_last = 0;
  double turned = 0.0;
  for (std::size_t t = 0; t < count; ++t) {
    const double time = min(static_cast<double>(t) / c.frame_rate, path->arrival());
    const TrajectorySample at = path->at(time);
    const Similarity world = actor->placement(time);
    const Affine3<double> placed{rotation_matrix(world.rotation), world.translation};
    std::vector<Affine3<double>>& globals = joints.emplace_back();
    actor->joint_globals(time, globals);
    for (auto& m : globals) m = placed * m;
    bodies.push_back(at.position);
    turned = at.turned;
    if (at.walking > 0.999) steady_first = min(steady_first, t), steady_last = max(steady_last, t + 1);
  }
  std::printf(
      "path of %.2f m in %.2f s at %.2f m/s, %.1f steps, turns on the spot of %.0f degrees; between its "
      "ends and "
      "stops the mesh's edges are at least %.2f m away (walls another %.2f m)\n",
      length, path->arrival(), options.speed, 2 * length / stride, turned * 57.29577951308232, clearance,
      mesh->settings().agent_radius);
  const auto print_slides = [&](const std::string& when) {
    FootSlideMeter meter(feet);
    for (std::size_t t = 0; t < count; ++t) meter.add(joints[t], bodies[t]);
    print_slide("in all" + when, meter.measure());
    if (steady_first < steady_last)
      print_slide("at full speed" + when, meter.measure(steady_first, steady_last));
  };
  print_slides(c.lock_feet ? " as recorded" : "");
  if (c.lock_feet) {
    const auto locked = lock_feet(skeleton, feet, c.frame_rate, bodies, joints);
    if (!locked) return locked.status();
    print_slides(" with the feet held");
    std::printf("feet were moved by up to %.1f mm; legs were up to %.1f mm too short\n",
                1e3 * locked->moved, 1e3 * locked->out_of_reach);
  }
  for (const auto& globals : joints) {
    frames.matrices.insert(frames.matrices.end(), globals.begin(), globals.end());
    if (asset->capsules.empty()) continue;
    auto& row = frames.capsules.emplace_back();
    for (const ProxyCapsule& p : asset->capsules) {
      row.push_back({globals[p.joint] * p.p0, globals[p.joint] * p.p1, p.radius});
    }
  }
  if (Status s = io::save_driver(c.out, frames); !s) return s;
  std::printf("%s: %zu frames at %g a second\n", printable(c.out).c_str(), count, c.frame_rate);
  return {};
}

}  // namespace gsnav_avatar
