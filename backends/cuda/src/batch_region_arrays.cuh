// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_region_parts.cuh"
#include "gsnav/backends/cuda.hpp"
#include "gsnav/core/buffer.hpp"

namespace gsnav::cuda {

/// Arrays for drawing by lists of regions. Empty until a call needs them.
struct BatchRegions {
  template <class T>
  using Array = Buffer<T, CudaBackend>;
  explicit BatchRegions(CudaBackend& b)
      : positions(b),
        shapes(b),
        bounds(b),
        in_view(b),
        rows_in_view(b),
        lists(b),
        bases(b),
        precise_begins(b),
        pair_begins(b),
        part_precise(b),
        list_places(b),
        order(b),
        zeroed(b),
        list_parts(b),
        pairs(b),
        precise_rows(b),
        precise_records(b),
        parts(b) {}
  std::size_t bytes() const noexcept {
    return positions.capacity_bytes() + shapes.capacity_bytes() + bounds.capacity_bytes() +
           in_view.capacity_bytes() + rows_in_view.capacity_bytes() + lists.capacity_bytes() +
           bases.capacity_bytes() + precise_begins.capacity_bytes() + pair_begins.capacity_bytes() +
           list_parts.capacity_bytes() + part_precise.capacity_bytes() + list_places.capacity_bytes() +
           order.capacity_bytes() + zeroed.capacity_bytes() + pairs.capacity_bytes() +
           precise_rows.capacity_bytes() + precise_records.capacity_bytes() + parts.capacity_bytes();
  }
  Array<float4> positions, shapes;
  Array<RowGroup> bounds;
  Array<uint2> in_view, rows_in_view, lists;
  Array<std::uint32_t> bases, precise_begins, pair_begins, part_precise, list_places, order, zeroed;
  Array<CameraPart> list_parts;
  Array<RegionRow> pairs;
  Array<PreciseRow> precise_rows;
  Array<SplatGeometry<float>> precise_records;
  Array<TileShare> parts;
  std::uint32_t pair_capacity = 0, precise_capacity = 0, group_capacity = 0;
  // State of the prepared call.
  std::size_t groups_in_view = 0, zeroed_words = 0;
};

}  // namespace gsnav::cuda
