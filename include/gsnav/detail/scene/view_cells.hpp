// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "gsnav/core/view.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// For each cell of space, the chunks and rows of a cloud that can be seen from it, so that renderers
/// can skip Gaussians behind walls. The sets are sampled: for cameras in a cell, chunks and rows are
/// left out that were not visible from any viewpoint in or near the cell. They are an approximation, for
/// the profiles `fast` and `lod`; docs/concepts/scene.md gives the error.
struct VisibleSets {
  /// Index of a cell along x, y and z.
  using Key = std::array<std::int32_t, 3>;

  /// Side of the cubic cells, in the asset's frame: cell k spans [k, k + 1) times this length along each
  /// axis.
  double cell = 0;
  /// Focal length of the viewpoints' images, pixels. The sets do not apply to cameras with a longer one.
  double focal = 0;
  double near_plane = 0;         ///< Near plane of those images, metres in the world. The sets do not
                                 ///< apply to cameras with a farther one.
  double near_sigma = 0;         ///< Camera::near_sigma of those images. The sets do not apply to
                                 ///< cameras with another value.
  double min_weight = 0;         ///< VisibleSettings::min_weight.
  std::size_t cloud_chunks = 0;  ///< Number of chunks of the cloud.
  std::size_t viewpoints = 0;    ///< Number of viewpoints that were used.
  /// If the sets would gain nothing (VisibleSettings::most_share): mean share of the Gaussians that the
  /// sampled cells see. There are no cells then, and everything is drawn. Otherwise 0. Files do not have
  /// it.
  double refused_share = 0;
  std::vector<Key> keys;  ///< The cells, ascending.
  std::vector<std::uint64_t>
      ends;  ///< [cells] end of each cell's words in `bits`. Those of the first cell begin at 0.
  std::vector<std::uint32_t> bits;  ///< Selection::seen of each cell, one after another.

  /// Number of cells.
  std::size_t cells() const noexcept { return keys.size(); }
  /// Number of words of a cell that mark the chunks it sees.
  std::size_t words() const noexcept { return (cloud_chunks + 31) / 32; }
  /// Bytes of the arrays.
  std::size_t bytes() const noexcept {
    return keys.size() * sizeof(Key) + ends.size() * sizeof(std::uint64_t) +
           bits.size() * sizeof(std::uint32_t);
  }
  /// Selection::seen of a cell. `there` is a copy of `bits` in a backend's memory; null: `bits` itself.
  View<const std::uint32_t> seen_from(std::size_t cell_index,
                                      const std::uint32_t* there = nullptr) const noexcept {
    const std::uint64_t begin = cell_index == 0 ? 0 : ends[cell_index - 1];
    return {(there != nullptr ? there : bits.data()) + begin,
            static_cast<std::size_t>(ends[cell_index] - begin)};
  }
  /// Number of chunks that a cell sees.
  std::size_t count_seen(std::size_t cell_index) const noexcept {
    return count_bits_of(seen_from(cell_index), 0, words());
  }
  /// Number of Gaussians that a cell sees, for a cloud of `cloud_rows` Gaussians.
  std::size_t count_seen_rows(std::size_t cell_index, std::size_t cloud_rows) const noexcept {
    const View<const std::uint32_t> seen = seen_from(cell_index);
    if (seen.size > words()) return count_bits_of(seen, 2 * words(), seen.size);
    const std::size_t last = cloud_chunks - 1;  // it may have fewer
    const std::size_t missing = count_seen(cell_index) != 0 && (seen[last / 32] >> (last % 32) & 1u) != 0
                                    ? kProjectChunk * cloud_chunks - cloud_rows
                                    : 0;
    return kProjectChunk * count_seen(cell_index) - missing;
  }
  /// Mean share of the chunks that a cell sees.
  double mean_share() const noexcept {
    double sum = 0;
    for (std::size_t c = 0; c < cells(); ++c) sum += static_cast<double>(count_seen(c));
    return sum / static_cast<double>(max<std::size_t>(cells() * cloud_chunks, 1));
  }
  /// Mean share of the Gaussians that a cell sees, for a cloud of `cloud_rows` Gaussians.
  double mean_row_share(std::size_t cloud_rows) const noexcept {
    double sum = 0;
    for (std::size_t c = 0; c < cells(); ++c) sum += static_cast<double>(count_seen_rows(c, cloud_rows));
    return sum / static_cast<double>(max<std::size_t>(cells() * cloud_rows, 1));
  }

  /// The cell of a position in the asset's frame. Nothing if its index would be too large.
  static std::optional<Key> key_of(const Vec3d& p, double cell) noexcept {
    Key key{};
    for (int k = 0; k < 3; ++k) {
      const double at = std::floor(p[k] / cell);
      if (!(std::abs(at) < 2e9)) return std::nullopt;
      key[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(at);
    }
    return key;
  }
  /// Index of the cell whose set applies to a camera, for a cloud placed by `world_from_asset`. Nothing
  /// if no set applies: everything may then be seen.
  std::optional<std::size_t> cell_of(const Camera& camera,
                                     const Similarity& world_from_asset = {}) const noexcept {
    const bool known = max(camera.fx, camera.fy) <= focal * (1 + 1e-6) &&
                       camera.near_plane <= near_plane * (1 + 1e-6) && camera.near_sigma == near_sigma;
    if (!known) return {};
    const auto key = key_of(camera.position_in(world_from_asset), cell);
    if (!key) return {};
    std::size_t first = 0, last = keys.size();  // the keys before `first` are below it
    while (first < last) {
      const std::size_t middle = first + (last - first) / 2;
      if (keys[middle] < *key)
        first = middle + 1;
      else
        last = middle;
    }
    if (first == keys.size() || keys[first] != *key) return {};
    return first;
  }

 private:
  static std::size_t count_bits_of(View<const std::uint32_t> words, std::size_t begin,
                                   std::size_t end) noexcept {
    std::size_t sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += static_cast<std::size_t>(count_bits(words[i]));
    return sum;
  }
};

}  // namespace gsnav
