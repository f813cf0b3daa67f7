// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <DetourNavMeshQuery.h>

#include <memory>
#include <vector>

#include "gsnav/detail/nav/geodesic_field.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav_bench {

using namespace gsnav;

/// A NavMesh with the points and pairs that queries are measured on.
struct Scene {
  std::unique_ptr<NavMesh> mesh;
  std::vector<NavPoint> points, goals;  ///< pairs; each goal is on the island of its point
  std::vector<Vec3d> positions, goal_positions;
  std::vector<NavPoint> near_points, near_goals;  ///< pairs of 1 to 30 m of path
  std::vector<NavPoint> main_points;              ///< on the largest island
  std::vector<NavPoint> walk;                     ///< steps of 0.25 m on the island of the field
  std::unique_ptr<GeodesicField> field;
  double prepare_ms = 0;  ///< processor time of the first distance
  std::unique_ptr<dtNavMeshQuery, void (*)(dtNavMeshQuery*)> detour{dtAllocNavMeshQuery(),
                                                                    dtFreeNavMeshQuery};

  explicit Scene(NavMesh m);
};

/// Scenes: flat() is the embedded one. The others are meshes of the data folder, built with Habitat's
/// settings; null if the folder does not have the mesh.
const Scene* flat();
const Scene* nav_test();
const Scene* dungeon();
const Scene* undulating();
const Scene* terrain();

}  // namespace gsnav_bench
