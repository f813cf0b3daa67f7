// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_regions.cuh"
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
        far_begins(b),
        order(b),
        zeroed(b),
        pairs(b),
        far_rows(b),
        far_records(b) {}
  std::size_t bytes() const noexcept {
    return positions.capacity_bytes() + shapes.capacity_bytes() + bounds.capacity_bytes() +
           in_view.capacity_bytes() + rows_in_view.capacity_bytes() + lists.capacity_bytes() +
           bases.capacity_bytes() + far_begins.capacity_bytes() + order.capacity_bytes() +
           zeroed.capacity_bytes() + pairs.capacity_bytes() + far_rows.capacity_bytes() +
           far_records.capacity_bytes();
  }
  Array<float4> positions, shapes;
  Array<RowGroup> bounds;
  Array<uint2> in_view, rows_in_view, lists;
  Array<std::uint32_t> bases, far_begins, order, zeroed;
  Array<RegionRow> pairs;
  Array<FarRow> far_rows;
  Array<SplatGeometry<float>> far_records;
  std::uint32_t pair_capacity = 0, far_capacity = 0, group_capacity = 0;
  // State of the prepared call.
  std::size_t groups_in_view = 0, zeroed_words = 0;
};

}  // namespace gsnav::cuda
