// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_region_order.cuh"

// Projects the rows that a tile needs.

namespace gsnav::cuda {

/// Where a row is, for its colour.
struct RowOfInstance {
  std::uint32_t instance, row;
  Vec3<float> delta;
};

/// Geometry and bounds of a row. Returns false if it covers no pixel of the image.
/// @tparam InDouble true: rows that need double are projected here. false: the kernel of precise rows
/// has made their records.
template <bool Color, bool InDouble>
__device__ inline bool project_source(const BatchArgs& a, const RegionArgs& r,
                                      std::uint32_t camera_index, std::uint32_t source, Splat& splat,
                                      RowOfInstance& out) {
  const std::uint32_t rows = r.camera_rows[camera_index];
  const bool precise = source >= rows;
  std::uint32_t precise_place = 0;
  if (precise) {
    precise_place = r.precise_begins[camera_index] + source - rows;
    if (precise_place >= r.precise_capacity) return false;
    source = r.precise_rows[precise_place].source;
  }
  const std::uint32_t first = a.camera_first[camera_index], end = a.camera_first[camera_index + 1];
  const std::uint32_t place = end - first == 1 ? first : last_start(first, end, [&](std::uint32_t i) {
    return r.cameras[a.camera_instances[i]].code.first_rank <= source;
  });
  const std::uint32_t instance = a.camera_instances[place];
  const PlainCamera& packed = r.cameras[instance];
  const RegionView& view = r.views[instance];
  const std::uint32_t local = source - packed.code.first_rank;
  const std::size_t row = std::size_t{local} + view.first_row;
  const RegionShape from{r.positions[row], r.shapes[2 * row], r.shapes[2 * row + 1], packed};
  const RowKey<float> key = row_key<float>(key_camera_of(packed), from);
  if constexpr (Color) out = {instance, local, key.delta};
  if (precise) {
    splat.geometry = r.precise_records[precise_place];
    splat.bounds = {0, 0, a.grid.width, a.grid.height};
    return true;
  }
  const ProjectionCamera<float> camera = region_camera(a, packed, view);
  const ProjectedRow<float> projected(camera, from, key);
  if (!projected.splat.visible) return false;
  if constexpr (InDouble) {
    if (gsnav::detail::needs_double(camera, projected.splat)) {
      const ViewedSet<float>& args = a.instances[instance].args;
      return make_splat64(args.camera64, false, ViewedRow({args.gaussians.shape, local}, args.offsets),
                          key, splat);
    }
  }
  return make_splat<true>(camera, camera_of(packed.mean), false, key, projected, splat);
}

/// Pairs of pixels of the tile that a splat may cover, as FootprintRows.
__device__ inline std::uint32_t covered_pairs(const Splat& splat, int tile_x, int tile_y,
                                              float log2_alpha_min) {
  const int x0 = max(splat.bounds.x0 - tile_x, 0), x1 = min(splat.bounds.x1 - tile_x, kRegionTile) - 1;
  const int y0 = max(splat.bounds.y0 - tile_y, 0), y1 = min(splat.bounds.y1 - tile_y, kRegionTile) - 1;
  if (x0 > x1 || y0 > y1) return 0;
  constexpr float kFar = 4 * policy::Regions::kSide;
  const FootprintRows rows(splat.geometry, log2_alpha_min, static_cast<float>(tile_x),
                           static_cast<float>(tile_y), kFar);
  std::uint32_t mask = 0;
#pragma unroll
  for (int pair = 0; pair < 4; ++pair) {
    float low = 1e9f, high = -1e9f;
#pragma unroll
    for (int k = 0; k < 2; ++k) {
      float left, right;
      if (rows.columns(static_cast<float>(2 * pair + k), left, right)) {
        low = ::fminf(low, left);
        high = ::fmaxf(high, right);
      }
    }
    const int first = max(static_cast<int>(::fminf(::fmaxf(low + 1.0f, 0.0f), 9.0f)), x0);
    const int last = min(static_cast<int>(::fminf(::fmaxf(high + 1.0f, 0.0f), 9.0f)) - 1, x1);
    if (first <= last && 2 * pair <= y1 && 2 * pair + 1 >= y0)
      mask |= ((2u << last) - (1u << first)) << (8 * pair);
  }
  return mask;
}

}  // namespace gsnav::cuda
