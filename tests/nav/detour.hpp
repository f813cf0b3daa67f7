// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <DetourCommon.h>
#include <DetourNavMeshQuery.h>
#include <doctest/doctest.h>

#include <array>
#include <memory>

#include "navmesh_impl.hpp"

namespace gsnav_test {

/// Detour's own queries on the mesh that the library holds.
using DetourQuery = std::unique_ptr<dtNavMeshQuery, void (*)(dtNavMeshQuery*)>;

inline DetourQuery detour_query(const gsnav::NavMesh& mesh, int nodes = 65535) {
  DetourQuery query(dtAllocNavMeshQuery(), dtFreeNavMeshQuery);
  REQUIRE(dtStatusSucceed(query->init(mesh.impl().mesh.get(), nodes)));
  return query;
}

/// A world position as Detour wants it.
inline std::array<float, 3> detour_position(const gsnav::NavMesh& mesh, const gsnav::Vec3d& p) {
  const gsnav::Vec3d q = p - mesh.impl().origin;
  return {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
}

}  // namespace gsnav_test
