// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/core/huge_pages.hpp"
#include "gsnav/kernels/gaussians.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

namespace detail {

/// Every third bit of the result is one of the lowest 21 of x.
inline std::uint64_t spread_bits(std::uint64_t x) noexcept {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

/// Rows of `values`, `stride` each, in a new order.
template <class T>
void permute_rows(std::vector<T>& values, const std::vector<std::uint32_t>& order, std::size_t stride) {
  std::vector<T> out = huge_vector<T>(values.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    std::copy_n(values.data() + stride * order[i], stride, out.data() + stride * i);
  }
  values.swap(out);
}

}  // namespace detail

/// Bounds of each chunk of kProjectChunk consecutive rows.
inline std::vector<ChunkBounds> chunk_bounds_of(const GaussianCloud& cloud) {
  std::vector<ChunkBounds> out(cloud.view().all_chunks());
  for (std::size_t c = 0; c < out.size(); ++c) {
    Aabb<double> box;
    for (std::size_t i = c * kProjectChunk; i < std::min(cloud.size(), (c + 1) * kProjectChunk); ++i) {
      box.add(cloud.mean(i));
      for (const auto& scale : cloud.scales) out[c].scale_max = std::max(out[c].scale_max, scale[i]);
      out[c].opacity_max = std::max(out[c].opacity_max, cloud.opacities[i]);
    }
    out[c].low = box.low;
    out[c].high = box.high;
  }
  return out;
}

/// Brings the rows into Morton order of their means and bounds each chunk of them, so that a renderer
/// touches what is near the view only, and neighbours lie together in memory. `row_ids` keeps each row's
/// place, so that images stay the same, bit for bit. Large Gaussians go together behind the others: one
/// among small ones would open its whole chunk's bounds.
inline void sort_spatially(GaussianCloud& cloud) {
  const std::size_t n = cloud.size();
  cloud.chunk_bounds.clear();
  if (n == 0) return;
  Aabb<double> box;
  for (std::size_t i = 0; i < n; ++i) box.add(cloud.mean(i));
  const Vec3d size = box.high - box.low;
  const double cell = std::max({size.x, size.y, size.z, 1e-9}) / 2097151.0;

  std::vector<float> largest(n);
  for (std::size_t i = 0; i < n; ++i) {
    largest[i] = std::max({cloud.scales[0][i], cloud.scales[1][i], cloud.scales[2][i]});
  }
  std::vector<float> sorted = largest;
  const auto quantile = sorted.begin() + static_cast<std::ptrdiff_t>(n - 1 - (n - 1) / 64);
  std::nth_element(sorted.begin(), quantile, sorted.end());
  const float large = *quantile;

  struct Row {
    std::uint64_t code;
    std::uint32_t row;
  };
  std::vector<Row> rows(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d p = (cloud.mean(i) - box.low) * (1.0 / cell);
    const auto along = [](double x) { return detail::spread_bits(static_cast<std::uint64_t>(x)); };
    const std::uint64_t code = along(p.x) | along(p.y) << 1 | along(p.z) << 2;
    rows[i] = {code | (largest[i] > large ? std::uint64_t{1} << 63 : 0), static_cast<std::uint32_t>(i)};
  }
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
    return a.code != b.code ? a.code < b.code : a.row < b.row;
  });
  std::vector<std::uint32_t> order(n);
  for (std::size_t i = 0; i < n; ++i) order[i] = rows[i].row;

  for (auto& plane : cloud.means) detail::permute_rows(plane, order, 1);
  for (auto& plane : cloud.quats) detail::permute_rows(plane, order, 1);
  for (auto& plane : cloud.scales) detail::permute_rows(plane, order, 1);
  detail::permute_rows(cloud.opacities, order, 1);
  detail::permute_rows(cloud.sh0, order, 3);
  detail::permute_rows(cloud.shN, order, cloud.shN.size() / n);
  detail::permute_rows(cloud.shN_half, order, cloud.shN_half.size() / n);
  const auto permute_ids = [&](std::vector<std::uint32_t>& ids) {
    std::vector<std::uint32_t> out(n);
    for (std::size_t i = 0; i < n; ++i) out[i] = ids[order[i]];
    ids.swap(out);
  };
  if (!cloud.origin_ids.empty()) permute_ids(cloud.origin_ids);
  if (cloud.row_ids.empty()) {
    cloud.row_ids = std::move(order);
  } else {
    permute_ids(cloud.row_ids);
  }
  cloud.chunk_bounds = chunk_bounds_of(cloud);
}

}  // namespace gsnav
