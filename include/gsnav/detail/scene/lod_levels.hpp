// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/lod_greedy.hpp"
#include "gsnav/detail/scene/point_tree.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/lod_tree.hpp"

namespace gsnav {

/// One level of a streamed set: its Gaussians, and the box of each.
struct LodLevel {
  GaussianCloud cloud;               ///< Rows in the order of the file.
  std::vector<std::uint32_t> boxes;  ///< [N] index of each row's box.
};

/// A cloud in which every chunk belongs to one box, and its levels of detail. The last chunk of a box is
/// filled up with transparent rows.
struct LeveledCloud {
  GaussianCloud cloud;  ///< The finest level, in chunks.
  LodTree tree;         ///< The coarser levels.
};

namespace detail {

/// The rows of one box at one level.
struct BoxRows {
  std::uint32_t first = 0, count = 0;  ///< Rows of the level when sorted by box, before chunks are
                                       ///< filled up.
  std::uint32_t first_chunk = 0, chunks = 0;

  /// Index of the box's i-th row in the padded arrays.
  std::size_t row(std::size_t i) const noexcept { return first_chunk * kProjectChunk + i; }
};

/// False if the boxes are so small that filled chunks would take more than about four times the rows.
inline bool fills_chunks(const std::vector<LodLevel>& levels, std::size_t boxes) {
  std::size_t rows = 0, chunks = 0;
  std::vector<std::uint32_t> counts;
  for (const LodLevel& level : levels) {
    counts.assign(boxes, 0);
    for (const std::uint32_t b : level.boxes) ++counts[b];
    for (const std::uint32_t n : counts) chunks += (n + kProjectChunk - 1) / kProjectChunk;
    rows += level.boxes.size();
  }
  return chunks * kProjectChunk <= 4 * rows + (std::size_t{1} << 20);
}

/// Sorts the rows of a level by box, and within a box like sort_spatially: along Hilbert's curve, large
/// Gaussians last. Fills up chunks. `row_ids` keeps the places of the rows in the file.
template <Backend B>
std::vector<BoxRows> sort_boxes(B& backend, LodLevel& level, std::size_t boxes) {
  GaussianCloud& in = level.cloud;
  const std::size_t n = in.size();
  std::vector<BoxRows> out(boxes);
  for (const std::uint32_t b : level.boxes) ++out[b].count;
  std::uint32_t rows = 0, chunks = 0;
  for (BoxRows& b : out) {
    b.first = rows;
    b.first_chunk = chunks;
    b.chunks = static_cast<std::uint32_t>((b.count + kProjectChunk - 1) / kProjectChunk);
    rows += b.count;
    chunks += b.chunks;
  }
  std::vector<std::uint32_t> order(n), at(boxes);
  for (std::size_t b = 0; b < boxes; ++b) at[b] = out[b].first;
  for (std::uint32_t i = 0; i < n; ++i) order[at[level.boxes[i]]++] = i;
  Aabb<double> box;
  std::vector<float> largest(n);
  for (std::size_t i = 0; i < n; ++i) {
    box.add(in.mean(i));
    largest[i] = std::max({in.scales[0][i], in.scales[1][i], in.scales[2][i]});
  }
  const SpatialCodes code(in, largest, box);
  std::vector<std::uint64_t> codes(n);
  backend.parallel_for(n, [&](std::size_t i) { codes[i] = code(i); });
  std::vector<std::uint32_t> from(std::size_t{chunks} * kProjectChunk);
  backend.parallel_for(boxes, [&](std::size_t b) {
    const auto begin = order.begin() + static_cast<std::ptrdiff_t>(out[b].first),
               end = begin + out[b].count;
    std::sort(begin, end, [&](std::uint32_t x, std::uint32_t y) {
      return codes[x] != codes[y] ? codes[x] < codes[y] : x < y;
    });
    for (std::size_t k = 0; k < out[b].chunks * kProjectChunk; ++k) {
      from[out[b].row(k)] = order[out[b].first + std::min<std::size_t>(k, out[b].count - 1)];
    }
  });
  static_cast<void>(backend.synchronize());

  const auto gather = [&](auto& plane, std::size_t stride) {
    if (plane.empty()) return;
    auto sorted = std::remove_reference_t<decltype(plane)>(from.size() * stride);
    backend.parallel_for(from.size(), [&](std::size_t i) {
      std::copy_n(plane.data() + stride * from[i], stride, sorted.data() + stride * i);
    });
    static_cast<void>(backend.synchronize());
    plane = std::move(sorted);
  };
  for (auto& plane : in.means) gather(plane, 1);
  for (auto& plane : in.quats) gather(plane, 1);
  for (auto& plane : in.scales) gather(plane, 1);
  gather(in.opacities, 1);
  gather(in.sh0, 3);
  gather(in.shN, 3 * static_cast<std::size_t>(sh_coefficient_count(in.sh_degree) - 1));
  gather(in.origin_ids, 1);
  in.row_ids = std::move(from);
  std::uint32_t filled = static_cast<std::uint32_t>(n);
  for (const BoxRows& b : out) {
    for (std::size_t i = b.row(b.count); i < b.row(b.chunks * kProjectChunk); ++i) {
      in.opacities[i] = 0;
      in.row_ids[i] = filled++;
    }
  }
  bound_chunks(backend, in);
  return out;
}

/// Distance from the finest Gaussians of a box to the nearest ones of a coarser level: root mean square
/// by mass, metres.
inline double distance_to_level(const GaussianCloud& fine, const BoxRows& in_fine,
                                const GaussianCloud& coarse, const BoxRows& in_coarse) {
  std::vector<Vec3d> points(in_coarse.count);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = coarse.mean(in_coarse.row(i));
  const PointTree tree(points);
  LodDistance moved;
  for (std::size_t i = 0; i < in_fine.count; ++i) {
    const LodGaussian g = lod_gaussian(fine, in_fine.row(i), 0);
    moved.add(g.mass, tree.nearest_squared(g.mean));
  }
  return moved.size();
}

inline Status bad_level(std::size_t level, const std::string& what) {
  return {Errc::invalid_argument, "join_levels: level " + std::to_string(level) + ": " + what};
}

inline Status check_levels(const std::vector<LodLevel>& levels, std::size_t boxes) {
  if (levels.empty()) return {Errc::invalid_argument, "join_levels: there is no level"};
  std::size_t all = 0;
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const LodLevel& level = levels[l];
    if (level.boxes.size() != level.cloud.size()) {
      return bad_level(l, std::to_string(level.boxes.size()) + " boxes for " +
                              std::to_string(level.cloud.size()) + " rows");
    }
    if (level.cloud.compact()) return bad_level(l, "compact: expand_sh first");
    all += level.cloud.size();
    for (const std::uint32_t b : level.boxes) {
      if (b >= boxes) return bad_level(l, "box " + std::to_string(b) + " of " + std::to_string(boxes));
    }
  }
  if (fills_chunks(levels, boxes)) return {};
  return {Errc::unsupported, "join_levels: " + std::to_string(all) +
                                 " rows in so many small boxes that chunks of " +
                                 std::to_string(kProjectChunk) + " would be mostly empty"};
}

/// The levels with their rows in chunks, and the forest over them.
struct LevelForest {
  std::vector<LodLevel> levels;
  std::vector<std::vector<BoxRows>> rows;  ///< [level][box]
  LodTree tree;
  std::vector<std::uint32_t> box_of;  ///< box of each node

  /// Adds a node for each box at each level, from the finest level to the coarsest.
  void add_nodes() {
    // coarsest node so far of each box
    std::vector<std::uint32_t> node_of(rows[0].size(), LodBox::kNone);
    // first chunk of the level in `merged`
    std::uint32_t first_chunk = 0;
    for (std::size_t l = 0; l < levels.size(); ++l) {
      tree.level_begin.push_back(static_cast<std::uint32_t>(tree.nodes.size()));
      for (std::uint32_t b = 0; b < node_of.size(); ++b) {
        const BoxRows& r = rows[l][b];
        if (r.count == 0 || (l > 0 && node_of[b] == LodBox::kNone)) continue;
        tree.boxes.push_back(
            {r.first_chunk + first_chunk, r.chunks, node_of[b], r.count, rows[0][b].count});
        node_of[b] = static_cast<std::uint32_t>(tree.nodes.size());
        tree.nodes.emplace_back();
        box_of.push_back(b);
      }
      if (l > 0) first_chunk += static_cast<std::uint32_t>(levels[l].cloud.chunk_bounds.size());
    }
    tree.level_begin.push_back(static_cast<std::uint32_t>(tree.nodes.size()));
    for (const std::uint32_t node : node_of) {
      if (node != LodBox::kNone) tree.roots.push_back(node);
    }
  }

  /// Measures a node of level l. Its finer node must be measured already.
  LodNode measured(std::size_t at, std::size_t l) const {
    const std::uint32_t b = box_of[at];
    const BoxRows& r = rows[l][b];
    const GaussianCloud& own = levels[l].cloud;
    LodNode node;
    node.reach = own.chunk_bounds[r.first_chunk];
    for (std::uint32_t c = 1; c < r.chunks; ++c) {
      node.reach = both(node.reach, own.chunk_bounds[r.first_chunk + c]);
    }
    if (l == 0) {
      LodGrain grain;
      for (std::size_t k = 0; k < r.count; ++k) grain.add(lod_gaussian(own, r.row(k), 0));
      node.grain = grain.size();
      return node;
    }
    const LodNode& finer = tree.nodes[tree.boxes[at].finer];
    node.grain = finer.grain;
    node.reach = both(node.reach, finer.reach);
    const double distance = distance_to_level(levels[0].cloud, rows[0][b], own, r);
    node.error = std::max(finer.error, static_cast<float>(distance));
    return node;
  }

  template <Backend B>
  Status measure_nodes(B& backend) {
    for (std::size_t l = 0; l < levels.size(); ++l) {
      const std::size_t first = tree.level_begin[l], end = tree.level_begin[l + 1];
      backend.parallel_for(end - first,
                           [&](std::size_t i) { tree.nodes[first + i] = measured(first + i, l); });
      if (Status s = backend.synchronize(); !s) return s;
    }
    return {};
  }

  /// Moves all levels but the finest to `tree.merged`.
  template <Backend B>
  Status merge_levels(B& backend) {
    for (std::size_t l = 1; l < levels.size(); ++l) {
      if (Status s = append(tree.merged, levels[l].cloud); !s) return bad_level(l, s.message());
      levels[l].cloud = {};
    }
    tree.merged.row_ids.clear();
    if (tree.merged.size() != 0) bound_chunks(backend, tree.merged);
    return {};
  }
};

}  // namespace detail

/// Builds a cloud with levels of detail from the levels of a streamed set, finest first. The k-th level
/// of a box is the k-th level in the set that has rows in it. Boxes without rows in the first level are
/// not drawn. A node's error is the distance from the finest Gaussians of its box to the nearest of its
/// own (root mean square by mass), and at least the error of the finer node. The same bits for any
/// number of threads.
/// @param levels are consumed.
/// @param boxes number of boxes.
/// @return the result, or one of these errors:
/// - invalid_argument: no level, compact SH, a box index beyond `boxes`, or levels with different
///   filters.
/// - unsupported: boxes so small that filled chunks would take more than about four times the rows.
template <Backend B>
requires is_host_backend<B> Result<LeveledCloud> join_levels(B& backend, std::vector<LodLevel> levels,
                                                             std::size_t boxes) {
  if (Status s = detail::check_levels(levels, boxes); !s) return s;
  detail::LevelForest forest;
  forest.levels = std::move(levels);
  for (LodLevel& level : forest.levels) {
    forest.rows.push_back(detail::sort_boxes(backend, level, boxes));
  }
  forest.add_nodes();
  if (Status s = forest.measure_nodes(backend); !s) return s;
  if (Status s = forest.merge_levels(backend); !s) return s;
  return LeveledCloud{std::move(forest.levels[0].cloud), std::move(forest.tree)};
}

}  // namespace gsnav
