// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "gsnav/frame/gaussians.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/functions.hpp"

// Building blocks of scene/visible_sets.hpp: what the cells see of a cloud.

namespace gsnav {

namespace detail {

/// Distance between two boxes; 0 where they touch or overlap.
inline double box_distance(const Vec3d& low, const Vec3d& high, const Vec3d& other_low,
                           const Vec3d& other_high) noexcept {
  Vec3d gap;
  for (int k = 0; k < 3; ++k) gap[k] = std::max({0.0, other_low[k] - high[k], low[k] - other_high[k]});
  return norm(gap);
}

/// The cube of a cell, in the asset's frame.
struct CellCube {
  CellCube(const std::array<std::int32_t, 3>& key, double side) noexcept {
    for (int k = 0; k < 3; ++k) {
      low[k] = static_cast<double>(key[static_cast<std::size_t>(k)]) * side;
      high[k] = low[k] + side;
    }
  }
  /// Distance to a box; 0 where they overlap.
  double distance(const Vec3d& other_low, const Vec3d& other_high) const noexcept {
    return box_distance(low, high, other_low, other_high);
  }
  Vec3d low, high;
};

/// One bit for each row of a chunk.
using RowBits = std::array<std::uint32_t, kSeenRowWords>;

/// The rows that chunk `chunk` has in a cloud of `size` Gaussians.
inline RowBits all_rows(std::size_t size, std::size_t chunk) noexcept {
  RowBits out{};
  for (std::size_t k = 0; k < kSeenRowWords; ++k) {
    const std::size_t first = chunk * kProjectChunk + 32 * k;
    if (first < size) out[k] = size - first < 32 ? (1u << (size - first)) - 1u : ~0u;
  }
  return out;
}

/// The rows of a chunk that take more than min_weight of a pixel. `most` [N] has the largest weight of
/// each row.
inline RowBits heavy_rows(std::span<const float> most, std::size_t chunk, double min_weight) noexcept {
  RowBits out{};
  const std::size_t begin = chunk * kProjectChunk;
  const std::size_t count = std::min<std::size_t>(kProjectChunk, most.size() - begin);
  for (std::size_t r = 0; r < count; ++r) {
    if (static_cast<double>(most[begin + r]) > min_weight) out[r / 32] |= 1u << (r % 32);
  }
  return out;
}

/// The given rows of chunk `chunk` of a cloud of `size` Gaussians, together with all rows of their
/// groups of `rows` rows (0: the whole chunk).
inline RowBits whole_groups(const RowBits& some, std::size_t size, std::size_t chunk,
                            int rows) noexcept {
  RowBits out = all_rows(size, chunk);
  if (rows == 0) return some == RowBits{} ? RowBits{} : out;
  const std::uint32_t first = rows == 32 ? ~0u : (1u << rows) - 1u;
  for (std::size_t k = 0; k < kSeenRowWords; ++k) {
    std::uint32_t groups = 0;
    for (int r = 0; r < 32; r += rows) {
      if ((some[k] & first << r) != 0) groups |= first << r;
    }
    out[k] &= groups;
  }
  return out;
}

/// The rows of a chunk that count as seen: those that take more than min_weight of a pixel, with their
/// groups. Arguments as above.
inline RowBits seen_rows(std::span<const float> most, std::size_t chunk, int rows,
                         double min_weight) noexcept {
  return whole_groups(heavy_rows(most, chunk, min_weight), most.size(), chunk, rows);
}

/// Collects the chunks and rows that one cell sees.
class SeenOfCell {
 public:
  explicit SeenOfCell(std::size_t chunks) : places_(chunks, kNone) {}

  void add(std::size_t chunk, const RowBits& rows) {
    if (places_[chunk] == kNone) {
      places_[chunk] = static_cast<std::uint32_t>(rows_.size());
      rows_.push_back(rows);
      return;
    }
    RowBits& to = rows_[places_[chunk]];
    for (std::size_t k = 0; k < kSeenRowWords; ++k) to[k] |= rows[k];
  }

  /// Adds the rows of all chunks, [chunks].
  void add(std::span<const RowBits> rows) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (rows[i] != RowBits{}) add(i, rows[i]);
    }
  }

  /// Number of Gaussians seen.
  std::size_t count() const noexcept {
    std::size_t sum = 0;
    for (const RowBits& r : rows_) {
      for (const std::uint32_t word : r) sum += static_cast<std::size_t>(count_bits(word));
    }
    return sum;
  }

  /// Appends the words of Selection::seen to `bits`, with or without the rows of each chunk.
  void append_to(std::vector<std::uint32_t>& bits, bool with_rows) const {
    const std::size_t begin = bits.size(), words = (places_.size() + 31) / 32;
    bits.resize(begin + (with_rows ? 2 : 1) * words);
    std::uint32_t count = 0;
    for (std::size_t c = 0; c < places_.size(); ++c) {
      if (with_rows && c % 32 == 0) bits[begin + words + c / 32] = count;
      if (places_[c] == kNone) continue;
      bits[begin + c / 32] |= std::uint32_t{1} << (c % 32);
      ++count;
    }
    for (std::size_t c = 0; with_rows && c < places_.size(); ++c) {
      if (places_[c] == kNone) continue;
      bits.insert(bits.end(), rows_[places_[c]].begin(), rows_[places_[c]].end());
    }
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<std::uint32_t> places_;  // [chunks] index into rows_, or kNone
  std::vector<RowBits> rows_;
};

/// Number of cells that are finished first, to decide whether sets are worth their time, and the least
/// number of cells for which that is done.
inline constexpr std::size_t kSampleCells = 16, kLeastSampled = 64;

/// The order in which viewpoints are processed: those of the sampled cells first. The sets do not depend
/// on it.
struct ViewpointOrder {
  std::vector<std::size_t> sample;  ///< Sampled cells, spread evenly; empty if none are sampled.
  std::vector<std::size_t> order;   ///< Viewpoints in the order of processing, [viewpoints].
  std::size_t sampled = 0;          ///< The sampled cells are complete after this many viewpoints of
                                    ///< `order`.
};

/// Orders the viewpoints. `counts_for(cell, viewpoint)` returns whether the cell sees what this
/// viewpoint sees.
template <class CountsFor>
ViewpointOrder order_viewpoints(std::size_t cells, std::size_t viewpoints, bool with_sample,
                                const CountsFor& counts_for) {
  ViewpointOrder out;
  if (with_sample) {
    for (std::size_t k = 0; k < kSampleCells; ++k)
      out.sample.push_back((2 * k + 1) * cells / (2 * kSampleCells));
  }
  out.order.resize(viewpoints);
  std::iota(out.order.begin(), out.order.end(), std::size_t{0});
  const auto rest = std::stable_partition(out.order.begin(), out.order.end(), [&](std::size_t v) {
    return std::any_of(out.sample.begin(), out.sample.end(),
                       [&](std::size_t c) { return counts_for(c, v); });
  });
  out.sampled = static_cast<std::size_t>(rest - out.order.begin());
  return out;
}

/// Mean share of `size` Gaussians that the sampled cells see.
inline double sampled_share(const std::vector<SeenOfCell>& found, const std::vector<std::size_t>& sample,
                            std::size_t size) {
  double sum = 0;
  for (const std::size_t c : sample) sum += static_cast<double>(found[c].count());
  return sum /
         (static_cast<double>(sample.size()) * static_cast<double>(std::max<std::size_t>(size, 1)));
}

/// Cameras for the six faces of a cube around `eye`. The cube is turned about the world's up axis (Y) by
/// another angle for each viewpoint. The order in which Gaussians are blended depends on where a camera
/// looks, so that some are visible in one direction only.
inline std::array<Camera, 6> cube_cameras(const Vec3d& eye, std::size_t viewpoint, int face,
                                          double near_plane, double near_sigma) noexcept {
  constexpr double kGoldenRatio = 0.6180339887498949, kQuarter = 1.5707963267948966;
  const double turned = static_cast<double>(viewpoint) * kGoldenRatio;
  const double turn = (turned - std::floor(turned)) * kQuarter;
  std::array<Camera, 6> out;
  for (std::size_t f = 0; f < 6; ++f) {
    const double angle = turn + kQuarter * static_cast<double>(f);
    const Vec3d level{std::cos(angle), 0, std::sin(angle)};
    const Vec3d forward = f < 4 ? level : Vec3d{0, f == 4 ? 1.0 : -1.0, 0};
    out[f] = Camera::look_at(eye, eye + forward, f < 4 ? Vec3d{0, 1, 0} : level, face, face, 90);
    out[f].near_plane = near_plane;
    out[f].near_sigma = near_sigma;
  }
  return out;
}

}  // namespace detail

}  // namespace gsnav
