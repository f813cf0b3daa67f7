// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/core/huge_pages.hpp"
#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/detail/core/permute.hpp"
#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/frame/row_bounds.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

namespace detail {

/// Spreads the lowest 21 bits of x to every third bit of the result.
inline std::uint64_t spread_bits(std::uint64_t x) noexcept {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

/// Maps floats to integers that compare in the same order.
inline std::uint32_t ordered_bits(float v) noexcept {
  const auto bits = std::bit_cast<std::uint32_t>(v);
  return bits ^ ((bits >> 31) != 0 ? 0xffffffffu : 0x80000000u);
}

/// The value of rank `rank` (0 is the least) among values without NaN. Counts the upper half of their
/// bits, then the lower half.
inline float value_of_rank(const std::vector<float>& values, std::size_t rank) {
  std::vector<std::size_t> counts(1 << 16);
  const auto find = [&] {
    std::uint32_t bin = 0;
    for (; rank >= counts[bin]; ++bin) rank -= counts[bin];
    return bin;
  };
  for (const float v : values) ++counts[ordered_bits(v) >> 16];
  const std::uint32_t high = find();
  counts.assign(counts.size(), 0);
  for (const float v : values) {
    if (ordered_bits(v) >> 16 == high) ++counts[ordered_bits(v) & 0xffff];
  }
  const std::uint32_t bits = high << 16 | find();
  return std::bit_cast<float>(bits ^ ((bits >> 31) != 0 ? 0x80000000u : 0xffffffffu));
}

/// Position on Hilbert's curve of a cell in a grid of 2^21 cells along each axis (Skilling, "Programming
/// the Hilbert curve", 2004).
inline std::uint64_t hilbert_code(std::array<std::uint32_t, 3> x) noexcept {
  constexpr std::uint32_t kTop = 1u << 20;
  for (std::uint32_t q = kTop; q > 1; q >>= 1) {
    const std::uint32_t below = q - 1;
    for (std::uint32_t& v : x) {
      // If the bit is set, the first coordinate is inverted, otherwise the two are exchanged. The
      // condition is random, so avoid a branch.
      const std::uint32_t set = (v & q) != 0 ? ~0u : 0u, swapped = (x[0] ^ v) & below & ~set;
      x[0] ^= swapped | (below & set);
      v ^= swapped;
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  std::uint32_t turned = x[2] >> 1;  // each bit: the parity of the bits above it
  for (int shift = 1; shift < 32; shift *= 2) turned ^= turned >> shift;
  for (std::uint32_t& v : x) v ^= turned;
  return spread_bits(x[0]) << 2 | spread_bits(x[1]) << 1 | spread_bits(x[2]);
}

/// Codes that order the rows of a cloud in space: positions of their means on Hilbert's curve. One in 64
/// is large; these go to the end.
struct SpatialCodes {
  const GaussianCloud& cloud;
  const std::vector<float>& largest;  ///< each row's largest standard deviation
  Vec3d low;
  double cells_per_metre;
  float large;

  /// `box` contains all means.
  SpatialCodes(const GaussianCloud& of, const std::vector<float>& scales, const Aabb<double>& box)
      : cloud(of), largest(scales), low(box.low) {
    const Vec3d size = box.high - box.low;
    cells_per_metre = 1.0 / (std::max({size.x, size.y, size.z, 1e-9}) / 2097151.0);
    const std::size_t n = scales.size();
    large = n == 0 ? 0 : value_of_rank(scales, n - 1 - (n - 1) / 64);
  }
  std::uint64_t operator()(std::size_t i) const noexcept {
    const Vec3d p = (cloud.mean(i) - low) * cells_per_metre;
    return hilbert_code({static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y),
                         static_cast<std::uint32_t>(p.z)}) |
           (largest[i] > large ? std::uint64_t{1} << 63 : 0);
  }
};

/// Indices of n rows, sorted by `code(i)` (63 bits) and then by index.
template <Backend B, class Code>
std::vector<std::uint32_t> rows_by_code(B& backend, std::size_t n, const Code& code) {
  Buffer<std::uint32_t, B> keys(backend), rows(backend), high(backend);
  SortScratch<B> scratch(backend);
  for (auto* b : {&keys, &rows, &high}) b->resize_discard(n);
  backend.parallel_for(n, [&](std::size_t i) {
    const std::uint64_t c = code(i);
    keys.data()[i] = static_cast<std::uint32_t>(c);
    high.data()[i] = static_cast<std::uint32_t>(c >> 32);
    rows.data()[i] = static_cast<std::uint32_t>(i);
  });
  sort_pairs(backend, keys, rows, scratch);
  backend.parallel_for(n, [&](std::size_t i) { keys.data()[i] = high.data()[rows.data()[i]]; });
  sort_pairs(backend, keys, rows, scratch);
  backend.synchronize().throw_if_error();
  std::vector<std::uint32_t> order = huge_vector<std::uint32_t>(n);
  std::copy_n(rows.data(), n, order.data());
  return order;
}

}  // namespace detail

/// Bounds of the rows [begin, end).
inline ChunkBounds bounds_of_rows(const GaussianCloud& cloud, std::size_t begin, std::size_t end) {
  RowBounds all;
  const auto& s = cloud.scales;
  for (std::size_t i = begin; i < end; ++i)
    all.add(cloud.mean(i), {s[0][i], s[1][i], s[2][i]}, cloud.opacities[i]);
  return all.bounds();
}

/// Bounds of each run of `rows` rows.
template <Backend B>
std::vector<ChunkBounds> chunk_bounds_of(B& backend, const GaussianCloud& cloud,
                                         std::size_t rows = kProjectChunk) {
  std::vector<ChunkBounds> out((cloud.size() + rows - 1) / rows);
  backend.parallel_for(out.size(), [&](std::size_t c) {
    out[c] = bounds_of_rows(cloud, c * rows, std::min(cloud.size(), (c + 1) * rows));
  });
  backend.synchronize().throw_if_error();
  return out;
}
/// Computes the bounds of chunks and parts. Call it after moving or scaling rows that stay in spatial
/// order.
template <Backend B>
void bound_chunks(B& backend, GaussianCloud& cloud) {
  cloud.chunk_bounds = chunk_bounds_of(backend, cloud);
  cloud.part_bounds = chunk_bounds_of(backend, cloud, kChunkPart);
}
/// The same on threads of its own.
inline void bound_chunks(GaussianCloud& cloud) {
  PoolBackend backend(threads_for(cloud.size()));
  bound_chunks(backend, cloud);
}

/// Rows in the order in which they were read: result[i] is the row of the cloud that comes i-th in the
/// file, among those that are left. Renderers break ties of depth by this order, and writers write in
/// it.
inline std::vector<std::uint32_t> rows_as_read(const GaussianCloud& cloud) {
  const std::size_t n = cloud.size();
  std::vector<std::uint32_t> rows(n);
  for (std::size_t i = 0; i < n; ++i) rows[i] = static_cast<std::uint32_t>(i);
  if (cloud.row_ids.size() != n) return rows;
  std::stable_sort(rows.begin(), rows.end(), [&](std::uint32_t a, std::uint32_t b) {
    return cloud.row_ids[a] < cloud.row_ids[b];
  });
  return rows;
}

/// Sorts the rows along Hilbert's curve through their means and computes the bounds of each chunk. A
/// renderer then touches only rows near the view, and neighbours lie together in memory. `row_ids` keeps
/// each row's place, so that images keep their bits. Large Gaussians go to the end: one among small ones
/// would inflate the bounds of its chunk. The order is the same for any number of threads.
template <Backend B>
void sort_spatially(B& backend, GaussianCloud& cloud) {
  static_assert(is_host_backend<B>);
  const std::size_t n = cloud.size();
  cloud.chunk_bounds.clear();
  cloud.part_bounds.clear();
  if (n == 0) return;
  std::vector<Aabb<double>> boxes(concurrency_of(backend));
  std::vector<float> largest = huge_vector<float>(n);
  backend.parallel_for(boxes.size(), [&](std::size_t b) {
    Aabb<double> box;
    for (std::size_t i = n * b / boxes.size(); i < n * (b + 1) / boxes.size(); ++i) {
      box.add(cloud.mean(i));
      largest[i] = std::max({cloud.scales[0][i], cloud.scales[1][i], cloud.scales[2][i]});
    }
    boxes[b] = box;
  });
  backend.synchronize().throw_if_error();
  Aabb<double> box;
  for (const Aabb<double>& b : boxes) box.add(b);
  std::vector<std::uint32_t> order =
      detail::rows_by_code(backend, n, detail::SpatialCodes(cloud, largest, box));
  std::vector<float> scratch = std::move(largest);
  const auto move = [&](std::vector<float>& plane, std::size_t stride) {
    permute_rows(backend, order, stride, plane, scratch);
  };
  for (auto& plane : cloud.means) move(plane, 1);
  for (auto& plane : cloud.quats) move(plane, 1);
  for (auto& plane : cloud.scales) move(plane, 1);
  move(cloud.opacities, 1);
  release(scratch);
  move(cloud.sh0, 3);
  release(scratch);
  move(cloud.shN, cloud.shN.size() / n);
  release(scratch);
  permute_rows(backend, order, cloud.shN_half.size() / n, cloud.shN_half);
  permute_rows(backend, order, 1, cloud.origin_ids);
  if (cloud.row_ids.empty()) {
    cloud.row_ids = std::move(order);
  } else {
    permute_rows(backend, order, 1, cloud.row_ids);
  }
  bound_chunks(backend, cloud);
}
/// The same on threads of its own.
inline void sort_spatially(GaussianCloud& cloud) {
  PoolBackend backend(threads_for(cloud.size()));
  sort_spatially(backend, cloud);
}

}  // namespace gsnav
