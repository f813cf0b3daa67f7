// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/render/rules.hpp"
#include "gsnav/detail/render/tuning.hpp"
#include "gsnav/render/config.hpp"

namespace gsnav {

/// Counts of a frame's rows by the result of culling, as if nothing were hidden. Rows in chunks that a
/// level-of-detail cut does not draw count as not touched.
struct CullCounts {
  std::uint64_t rows = 0;      ///< rows of all sets
  std::uint64_t touched = 0;   ///< rows in chunks and parts that may be in view
  std::uint64_t emitting = 0;  ///< touched rows with at least one (tile, Gaussian) pair

  std::uint64_t removed() const noexcept { return rows - touched; }
  std::uint64_t removable() const noexcept { return rows - emitting; }
  /// Rows touched per row that was needed, >= 1. If none was touched, 1.
  double touched_per_emitting() const noexcept {
    return touched == 0
               ? 1.0
               : static_cast<double>(touched) / static_cast<double>(emitting == 0 ? 1 : emitting);
  }
};

/// Counts the rows that culling keeps and removes for one camera. Uses float32, as frames do. Arrays are
/// in host memory. Culling guarantees that rows that are not touched have no (tile, Gaussian) pair.
template <Backend B>
requires is_host_backend<B> CullCounts count_culled(B& backend, std::span<const GaussianSet> sets,
                                                    const Camera& camera, const RenderConfig& config) {
  CullCounts out;
  const ProjectionRules rules = projection_rules(config);
  const float exponent_min = static_cast<float>(log2_alpha_min(config.quality));
  for (const GaussianSet& set : sets) {
    const GaussianRows& gs = set.gaussians;
    ViewedSet<float> args = view_set<float>(camera, set, rules, 0);
    std::vector<Vec3d> offsets;
    for (std::size_t o = 0; o < origin_count(gs); ++o) offsets.push_back(origin_offset(args, o));
    args.offsets = {offsets.data(), offsets.size()};
    const TileGrid grid =
        TileGrid::of(camera.width, camera.height, tile_size_of<B>(config, camera.width, camera.height));

    struct Count {
      std::uint32_t touched = 0, emitting = 0;
    };
    std::vector<Count> counts(args.chunk_count());
    backend.parallel_for(counts.size(), [&](std::size_t c) {
      for_each_candidate(args, c, [&](std::size_t i) {
        ++counts[c].touched;
        RowSplat<float> row;
        if (!project_row(args, false, i, row)) return;
        bool any = false;
        for_each_tile(grid, row.splat.geometry, row.splat.bounds, exponent_min,
                      config.response == Response::ewa, [&any](std::size_t) { any = true; });
        counts[c].emitting += any ? 1 : 0;
      });
    });
    static_cast<void>(backend.synchronize());
    out.rows += gs.size();
    for (const Count& n : counts) {
      out.touched += n.touched;
      out.emitting += n.emitting;
    }
  }
  return out;
}

}  // namespace gsnav
