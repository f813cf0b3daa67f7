// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "canvas.hpp"
#include "gsnav/math/capsule.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_tools {

inline constexpr Rgb kMapNavMesh{0.36f, 0.66f, 0.86f}, kMapShortest{0.15f, 0.15f, 0.17f},
    kMapAgent{0.05f, 0.30f, 0.85f}, kMapStart{0.10f, 0.60f, 0.25f}, kMapGoal{0.86f, 0.10f, 0.16f};

/// Content of the map of one episode. World coordinates, metres.
struct MapContent {
  const gsnav::GaussianCloud* cloud = nullptr;
  gsnav::Similarity world_from_asset{};
  const gsnav::NavMesh* navmesh = nullptr;
  gsnav::Vec3d start{}, goal{};
  std::vector<gsnav::Vec3d> shortest;              ///< Shortest path, planned before the episode.
  std::vector<gsnav::Vec3d> agent;                 ///< One point per step.
  std::vector<std::vector<gsnav::Vec3d>> avatars;  ///< Path of each avatar's root.
  /// Capsules of all bodies at a few times, the last at the end.
  std::vector<std::vector<gsnav::DynamicCapsule>> snapshots;
  double agent_radius = 0.1;
};

/// Position of the world on a map: x to the right, z down.
struct MapFrame {
  double x0 = 0, z0 = 0;  ///< World position of the left and upper edge, metres.
  double scale = 1;       ///< Pixels per metre.
  double x(const gsnav::Vec3d& p) const { return (p.x - x0) * scale; }
  double y(const gsnav::Vec3d& p) const { return (p.z - z0) * scale; }
};

/// Centres the NavMesh with a margin in a picture of this size.
MapFrame fit_map(const gsnav::NavMesh& navmesh, int width, int height);

/// Draws the scene from above in faint colours, without its ceiling, and the NavMesh on it.
void draw_ground(Canvas& canvas, const MapFrame& frame, const MapContent& content);
void draw_bodies(Canvas& canvas, const MapFrame& frame, std::span<const gsnav::DynamicCapsule> bodies,
                 float alpha);
void draw_polyline(Canvas& canvas, const MapFrame& frame, std::span<const gsnav::Vec3d> points,
                   double radius, Rgb color, float alpha);

/// Draws the ground with everything else on top.
Canvas draw_map(const MapContent& content);

/// Colour of an avatar on maps.
Rgb avatar_color(std::size_t index);

}  // namespace gsnav_tools
