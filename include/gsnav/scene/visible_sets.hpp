// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/render/row_weights.hpp"
#include "gsnav/detail/scene/seen_cells.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// What of a cloud can be seen from where cameras go: what stands behind walls need not be looked at.
/// Sampled: chunks, and of these rows, of which nobody saw anything from viewpoints in and around a cell
/// are left out for cameras in it. An approximation, for the profiles `fast` and `lod`; docs/lod.md has
/// its error.
struct VisibleSets {
  using Key = std::array<std::int32_t, 3>;  ///< Place of a cell in the lattice.

  /// Side of the cubic cells, in the asset's frame: cell k spans [k, k + 1) times this along each axis.
  double cell = 0;
  /// Focal length of the viewpoints' images, pixels: of cameras with a longer one nothing is known.
  double focal = 0;
  double near_plane = 0;         ///< metres in the world: nor of those with a farther one
  double near_sigma = 0;         ///< Camera::near_sigma: nor of those with another
  double min_weight = 0;         ///< VisibleSettings::min_weight
  std::size_t cloud_chunks = 0;  ///< of the cloud that these are of
  std::size_t viewpoints = 0;    ///< that were looked from
  std::vector<Key> keys;         ///< of the cells, ascending
  std::vector<std::uint64_t>
      ends;  ///< [cells], where the words of each end; those of the first begin at 0
  std::vector<std::uint32_t> bits;  ///< Selection::seen of each cell, one behind the other

  /// Number of cells.
  std::size_t cells() const noexcept { return keys.size(); }
  /// Words of a cell that say which chunks it sees.
  std::size_t words() const noexcept { return (cloud_chunks + 31) / 32; }
  /// Memory in bytes.
  std::size_t bytes() const noexcept {
    return keys.size() * sizeof(Key) + ends.size() * sizeof(std::uint64_t) +
           bits.size() * sizeof(std::uint32_t);
  }
  /// What a cell sees; `there`: `bits` in a backend's memory, null: here.
  View<const std::uint32_t> seen_from(std::size_t cell_index,
                                      const std::uint32_t* there = nullptr) const noexcept {
    const std::uint64_t begin = cell_index == 0 ? 0 : ends[cell_index - 1];
    return {(there != nullptr ? there : bits.data()) + begin,
            static_cast<std::size_t>(ends[cell_index] - begin)};
  }
  /// How many chunks it sees.
  std::size_t count_seen(std::size_t cell_index) const noexcept {
    return count_bits_of(seen_from(cell_index), 0, words());
  }
  /// How many Gaussians it sees, of a cloud of so many.
  std::size_t count_seen_rows(std::size_t cell_index, std::size_t cloud_rows) const noexcept {
    const View<const std::uint32_t> seen = seen_from(cell_index);
    if (seen.size > words()) return count_bits_of(seen, 2 * words(), seen.size);
    const std::size_t last = cloud_chunks - 1;  // it may have fewer
    const std::size_t missing = count_seen(cell_index) != 0 && (seen[last / 32] >> (last % 32) & 1u) != 0
                                    ? kProjectChunk * cloud_chunks - cloud_rows
                                    : 0;
    return kProjectChunk * count_seen(cell_index) - missing;
  }
  /// Share of the chunks that a cell sees, on average.
  double mean_share() const noexcept {
    double sum = 0;
    for (std::size_t c = 0; c < cells(); ++c) sum += static_cast<double>(count_seen(c));
    return sum / static_cast<double>(std::max<std::size_t>(cells() * cloud_chunks, 1));
  }
  /// The same of the Gaussians of a cloud of so many.
  double mean_row_share(std::size_t cloud_rows) const noexcept {
    double sum = 0;
    for (std::size_t c = 0; c < cells(); ++c) sum += static_cast<double>(count_seen_rows(c, cloud_rows));
    return sum / static_cast<double>(std::max<std::size_t>(cells() * cloud_rows, 1));
  }

  /// The cell of a position in the asset's frame; none where its numbers do not fit.
  static std::optional<Key> key_of(const Vec3d& p, double cell) noexcept {
    Key key{};
    for (int k = 0; k < 3; ++k) {
      const double at = std::floor(p[k] / cell);
      if (!(std::abs(at) < 2e9)) return std::nullopt;
      key[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(at);
    }
    return key;
  }
  /// Index of the cell that knows what a camera sees of the asset where it stands so; none: anything may
  /// be seen.
  std::optional<std::size_t> cell_of(const Camera& camera,
                                     const Similarity& world_from_asset = {}) const noexcept {
    const bool known = std::max(camera.fx, camera.fy) <= focal * (1 + 1e-6) &&
                       camera.near_plane <= near_plane * (1 + 1e-6) && camera.near_sigma == near_sigma;
    if (!known) return {};
    const auto key = key_of(inverse(world_from_asset) * camera.position(), cell);
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

/// How build_visible_sets works. Lengths in metres in the world.
struct VisibleSettings {
  double cell = 0.5;         ///< side of a cell
  double margin = 0.25;      ///< viewpoints so far outside of a cell count for it too
  double min_weight = 1e-3;  ///< what is seen has more of a pixel than this
  /// Rows of a chunk that are seen or not together, each a whole share of 32: Gaussians that lie
  /// together. 0: all of a chunk.
  int rows = 8;
  int face = 256;  ///< pixels along a face of the cube that is looked at from each viewpoint
  double near_plane =
      0.2;  ///< of these images (Camera); what lies nearer to a cell is in its set in any case
  double near_sigma = 0;  ///< likewise
  /// Gives up early where sets gain nothing: in the open a cell sees nearly all. 16 cells, spread
  /// evenly, are finished first; where they see more than this share of the Gaussians on average,
  /// build_visible_sets returns unsupported. In (0, 1]; 1: never. Fewer than 64 cells are all found.
  double most_share = 0.9;

  /// How far apart viewpoints should be (navmesh_viewpoints): with a margin of as much every cell has
  /// several, each with its own directions.
  double spacing() const noexcept { return 0.5 * cell; }
  /// Has `face`, `near_plane` and `near_sigma` be such that the sets serve this camera.
  void serve(const Camera& camera) noexcept {
    face = static_cast<int>(std::ceil(2 * std::max(camera.fx, camera.fy) - 1e-6));
    near_plane = camera.near_plane;
    near_sigma = camera.near_sigma;
  }
  /// Told the share of the work that is done, in [0, 1], for each viewpoint, by the calling thread.
  std::function<void(double)> progress{};
};

/// Names the field that cannot be, or ok.
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

namespace detail {

/// Fills out.keys: the cells that a viewpoint is in or within 5 cm (world) of. Returns the viewpoints in
/// the asset's frame. out.cell is set.
inline Result<std::vector<Vec3d>> find_cells(VisibleSets& out, std::span<const Vec3d> viewpoints,
                                             const Similarity& world_from_asset) {
  constexpr double kBeside = 0.05;  // metres
  std::vector<Vec3d> eyes;
  for (std::size_t v = 0; v < viewpoints.size(); ++v) {
    eyes.push_back(inverse(world_from_asset) * viewpoints[v]);
    const auto key = VisibleSets::key_of(eyes.back(), out.cell);
    if (!key) {
      return Status(Errc::invalid_argument,
                    "build_visible_sets: viewpoint " + std::to_string(v) + " is not finite or too far");
    }
    // Rounding, or a step in the floor, must not take a camera that is where a viewpoint is to a cell
    // that has none.
    for (int corner = 0; corner < 8; ++corner) {
      Vec3d beside = eyes.back();
      for (int k = 0; k < 3; ++k)
        beside[k] += ((corner >> k & 1) != 0 ? 1 : -1) * kBeside / world_from_asset.scale;
      out.keys.push_back(VisibleSets::key_of(beside, out.cell).value_or(*key));
    }
  }
  std::sort(out.keys.begin(), out.keys.end());
  out.keys.erase(std::unique(out.keys.begin(), out.keys.end()), out.keys.end());
  return eyes;
}

/// Adds the chunks within `distance` of each cell, whole: a camera in the cell may be in front of such a
/// chunk where no viewpoint is.
template <Backend B>
void add_near_chunks(B& backend, const VisibleSets& sets, const GaussianCloud& cloud, double distance,
                     std::vector<SeenOfCell>& found) {
  backend.parallel_for(sets.cells(), [&](std::size_t c) {
    const CellCube cube(sets.keys[c], sets.cell);
    for (std::size_t i = 0; i < sets.cloud_chunks; ++i) {
      const ChunkBounds& b = cloud.chunk_bounds[i];
      if (cube.distance(b.low, b.high) <= distance) found[c].add(i, all_rows(cloud.size(), i));
    }
  });
}

}  // namespace detail

/// Finds what of a cloud is seen from each cell that has a viewpoint in it or within 5 cm (world,
/// metres; navmesh_viewpoints makes them): the cloud stands in the world by `world_from_asset`, with
/// bounds of its chunks (sort_spatially). Each viewpoint costs six frames of settings.face pixels a
/// side. The same bits for any number of threads.
///
/// Errors: invalid_argument (a setting; no viewpoint, or one that is not finite; a cloud that is not in
/// spatial order); unsupported (VisibleSettings::most_share: nothing is gained, draw without sets);
/// those of rendering.
template <Backend B>
requires is_host_backend<B> Result<VisibleSets> build_visible_sets(
    B& backend, const GaussianCloud& cloud, std::span<const Vec3d> viewpoints,
    const VisibleSettings& settings = {}, const Similarity& world_from_asset = {}) {
  if (Status s = validate(settings); !s) return s;
  if (viewpoints.empty()) return Status(Errc::invalid_argument, "build_visible_sets: no viewpoint");
  if (cloud.chunk_bounds.size() != cloud.view().chunk_count()) {
    return Status(Errc::invalid_argument,
                  "build_visible_sets: the cloud's rows are not in spatial order: sort_spatially first");
  }
  VisibleSets out;
  out.cell = settings.cell / world_from_asset.scale;
  out.focal = 0.5 * settings.face;
  out.near_plane = settings.near_plane;
  out.near_sigma = settings.near_sigma;
  out.min_weight = settings.min_weight;
  out.cloud_chunks = cloud.view().chunk_count();
  out.viewpoints = viewpoints.size();
  const auto eyes = detail::find_cells(out, viewpoints, world_from_asset);
  if (!eyes) return eyes.status();

  std::vector<detail::SeenOfCell> found(out.cells(), detail::SeenOfCell(out.cloud_chunks));
  detail::add_near_chunks(backend, out, cloud, settings.near_plane / world_from_asset.scale, found);
  const double margin = settings.margin / world_from_asset.scale;
  const auto counts_for = [&](std::size_t cell, std::size_t v) {
    const Vec3d& eye = (*eyes)[v];
    return detail::CellCube(out.keys[cell], out.cell).distance(eye, eye) <= margin;
  };
  const bool with_sample = settings.most_share < 1 && out.cells() >= detail::kLeastSampled;
  const auto [sample, order, sampled] =
      detail::order_viewpoints(out.cells(), viewpoints.size(), with_sample, counts_for);

  const GaussianSet set = cloud.set(world_from_asset);
  RowWeightsWorkspace<B> workspace(backend);
  std::vector<float> most(cloud.size());
  std::vector<detail::RowBits> rows(out.cloud_chunks);
  for (std::size_t done = 0; done < order.size(); ++done) {
    const std::size_t v = order[done];
    if (done == sampled && !sample.empty()) {
      if (Status s = detail::check_sample(found, sample, cloud.size(), settings.most_share); !s)
        return s;
    }
    std::fill(most.begin(), most.end(), 0.0f);
    for (const Camera& camera : detail::cube_cameras(viewpoints[v], v, settings.face,
                                                     settings.near_plane, settings.near_sigma)) {
      if (Status s = add_row_weights(backend, workspace, set, camera, most); !s) return s;
    }
    backend.parallel_for(rows.size(), [&](std::size_t i) {
      rows[i] = detail::seen_rows(most, i, settings.rows, settings.min_weight);
    });
    backend.parallel_for(out.cells(), [&](std::size_t c) {
      if (!counts_for(c, v)) return;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (rows[i] != detail::RowBits{}) found[c].add(i, rows[i]);
      }
    });
    if (settings.progress)
      settings.progress(static_cast<double>(done + 1) / static_cast<double>(order.size()));
  }
  for (detail::SeenOfCell& of_cell : found) {
    of_cell.append_to(out.bits, settings.rows != 0);
    out.ends.push_back(out.bits.size());
    of_cell = detail::SeenOfCell(0);
  }
  return out;
}

}  // namespace gsnav
