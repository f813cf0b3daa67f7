// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/detail/lanes/isa.hpp"
#include "gsnav/detail/mesh/mesh_shade.hpp"

// Kernels of meshes, compiled for each instruction set, so that their loops over pixels use its lanes
// and fma is one instruction.

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

inline void project_mesh_vertices(const ProjectMeshVertices<float>& k, std::size_t chunk) noexcept {
  k(chunk);
}
inline void count_mesh_triangles(const CountMeshTriangles<float>& k, std::size_t chunk) noexcept {
  k(chunk);
}
inline void write_mesh_triangles(const WriteMeshTriangles<float>& k, std::size_t chunk) noexcept {
  k(chunk);
}
inline void rasterize_mesh_tile(const RasterizeMeshTile<float>& k, std::size_t tile) noexcept {
  k(tile);
}
inline void shade_mesh_row(const ShadeMeshRow<float>& k, std::size_t row) noexcept { k(row); }

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
