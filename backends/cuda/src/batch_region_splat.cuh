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
/// @tparam InDouble true: rows that need double are projected here. false: the kernel of far rows has
/// made their records.
template <bool Color, bool InDouble>
__device__ inline bool project_source(const BatchArgs& a, const RegionArgs& r,
                                      std::uint32_t camera_index, std::uint32_t source, Splat& splat,
                                      RowOfInstance& out) {
  const std::uint32_t rows = r.camera_rows[camera_index];
  const bool far = source >= rows;
  std::uint32_t far_place = 0;
  if (far) {
    far_place = r.far_begins[camera_index] + source - rows;
    if (far_place >= r.far_capacity) return false;
    source = r.far_rows[far_place].source;
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
  if (far) {
    splat.geometry = r.far_records[far_place];
    splat.bounds = {0, 0, a.grid.width, a.grid.height};
    return splat.geometry.log2_opacity >= a.log2_alpha_min;  // or it is not drawn
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

/// Columns of the tile that a splat may cover in each pair of its rows of pixels, eight bits per pair.
__device__ inline std::uint32_t covered_pairs(const Splat& splat, int tile_x, int tile_y,
                                              float log2_alpha_min) {
  const SplatBounds& b = splat.bounds;
  const PixelBox<float> box{static_cast<float>(max(b.x0, tile_x)), static_cast<float>(max(b.y0, tile_y)),
                            static_cast<float>(min(b.x1, tile_x + kRegionTile)),
                            static_cast<float>(min(b.y1, tile_y + kRegionTile))};
  if (!(box.x0 < box.x1 && box.y0 < box.y1)) return 0;
  const FootprintStrips<float, true> strips(splat.geometry, log2_alpha_min, box);
  std::uint32_t mask = 0;
#pragma unroll
  for (int pair = 0; pair < kRegionTile / 2; ++pair) {
    const float top = static_cast<float>(tile_y + 2 * pair);
    const PixelColumns<float> in_pair = strips.pixels(box, top, top + 2);
    if (!in_pair.any) continue;
    const int first = static_cast<int>(in_pair.first) - tile_x,
              end = static_cast<int>(in_pair.end) - tile_x;
    mask |= ((1u << end) - (1u << first)) << (8 * pair);
  }
  return mask;
}

}  // namespace gsnav::cuda
