// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
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
  std::vector<Key> keys;         ///< The cells, ascending.
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
    return sum / static_cast<double>(std::max<std::size_t>(cells() * cloud_chunks, 1));
  }
  /// Mean share of the Gaussians that a cell sees, for a cloud of `cloud_rows` Gaussians.
  double mean_row_share(std::size_t cloud_rows) const noexcept {
    double sum = 0;
    for (std::size_t c = 0; c < cells(); ++c) sum += static_cast<double>(count_seen_rows(c, cloud_rows));
    return sum / static_cast<double>(std::max<std::size_t>(cells() * cloud_rows, 1));
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
    const bool known = std::max(camera.fx, camera.fy) <= focal * (1 + 1e-6) &&
                       camera.near_plane <= near_plane * (1 + 1e-6) && camera.near_sigma == near_sigma;
    if (!known) return {};
    const auto key = key_of(camera.position_in(world_from_asset), cell);
    if (!key) return {};
    const auto at = std::lower_bound(keys.begin(), keys.end(), *key);
    if (at == keys.end() || *at != *key) return {};
    return static_cast<std::size_t>(at - keys.begin());
  }

 private:
  static std::size_t count_bits_of(View<const std::uint32_t> words, std::size_t begin,
                                   std::size_t end) noexcept {
    std::size_t sum = 0;
    for (std::size_t i = begin; i < end; ++i) sum += static_cast<std::size_t>(count_bits(words[i]));
    return sum;
  }
};

/// Settings of build_visible_sets. Lengths are metres in the world.
struct VisibleSettings {
  double cell = 0.5;         ///< Side of a cell.
  double margin = 0.25;      ///< A viewpoint counts for a cell if it is at most this far outside of it.
  double min_weight = 1e-3;  ///< Least share of a pixel that a Gaussian must have to count as seen.
  /// Consecutive rows that are seen or not together: 1, 2, 4, 8, 16 or 32. 0: all rows of a chunk.
  int rows = 8;
  int face = 256;  ///< Pixels along a side of the six images that are rendered for each viewpoint.
  double near_plane =
      0.2;  ///< Near plane of these images. Chunks nearer to a cell than this are always in its set.
  double near_sigma = 0;  ///< Camera::near_sigma of these images.
  /// Largest mean share of the Gaussians that a cell may see, in (0, 1]. Above it, as in the open, sets
  /// gain nothing and build_visible_sets returns unsupported. It decides early, on 16 cells spread
  /// evenly that are finished first. 1: never refuse. With fewer than 64 cells it never refuses either.
  double most_share = 0.9;

  /// Recommended distance between viewpoints (navmesh_viewpoints). Each cell then has several, each with
  /// its own directions.
  double spacing() const noexcept { return 0.5 * cell; }
  /// Sets `face`, `near_plane` and `near_sigma` so that the sets apply to this camera.
  void serve(const Camera& camera) noexcept {
    face = static_cast<int>(std::ceil(2 * std::max(camera.fx, camera.fy) - 1e-6));
    near_plane = camera.near_plane;
    near_sigma = camera.near_sigma;
  }
  /// Called after each viewpoint with the share of the work that is done, in [0, 1], by the calling
  /// thread.
  std::function<void(double)> progress{};
};

/// Returns invalid_argument naming the field that is out of range, or ok.
inline Status validate(const VisibleSettings& s) {
  const BadArgument bad{"VisibleSettings."};
  if (!(s.cell > 0 && is_finite(s.cell))) return bad("cell", s.cell, "must be positive");
  if (!(s.margin >= 0 && is_finite(s.margin))) return bad("margin", s.margin, "must be >= 0");
  if (!(s.min_weight >= 0 && s.min_weight < 1))
    return bad("min_weight", s.min_weight, "must be in [0, 1)");
  if (s.rows != 0 && (s.rows < 1 || s.rows > 32 || 32 % s.rows != 0)) {
    return {Errc::invalid_argument,
            "VisibleSettings.rows = " + std::to_string(s.rows) + ": must be 0, 1, 2, 4, 8, 16 or 32"};
  }
  if (s.face < 16 || s.face > 4096) return bad("face", s.face, "must be in [16, 4096]");
  if (!(s.near_plane > 0 && is_finite(s.near_plane)))
    return bad("near_plane", s.near_plane, "must be positive");
  if (!(s.near_sigma >= 0 && is_finite(s.near_sigma)))
    return bad("near_sigma", s.near_sigma, "must be >= 0");
  if (!(s.most_share > 0 && s.most_share <= 1))
    return bad("most_share", s.most_share, "must be in (0, 1]");
  return {};
}

}  // namespace gsnav
