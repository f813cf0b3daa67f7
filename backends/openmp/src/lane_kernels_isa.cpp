// SPDX-License-Identifier: Apache-2.0
// Compiled once per instruction set. Nothing here may leave a function behind that another object could
// pick up: every definition lives in the set's own namespace or is always inlined.
#include "gsnav/backends/openmp.hpp"
#include "gsnav/kernels/lanes/kernels.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

extern const LaneKernels kKernels;
const LaneKernels kKernels{GSNAV_LANES_NAME, kWidth,         &project_chunk,
                           &count_tiles,     &scatter_tiles, &rasterize_tile_any,
                           &skin_range,      &gap_range,     &sweep_range,
                           &composite_tile_any, &count_tiles_before_mesh, &scatter_tiles,
                           &project_mesh_vertices, &count_mesh_triangles, &write_mesh_triangles,
                           &rasterize_mesh_tile, &shade_mesh_row};

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
