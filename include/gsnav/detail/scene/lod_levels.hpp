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

/// One level of a set that ships them: Gaussians, and the box that each belongs to.
struct LodLevel {
  GaussianCloud cloud;               ///< rows as they were read
  std::vector<std::uint32_t> boxes;  ///< [N]
};

/// A cloud in chunks that belong to one box each, and its levels of detail. The last chunk of a box is
/// filled with transparent rows.
struct LeveledCloud {
  GaussianCloud cloud;
  LodTree tree;
};

namespace detail {

/// Where a box's rows are after box_order.
struct BoxRows {
  std::uint32_t first = 0, count = 0;  ///< of the level as it was read, by box
  std::uint32_t first_chunk = 0, chunks = 0;
};

/// Rows of all levels once their boxes are in chunks of their own.
inline std::size_t filled_rows(const std::vector<LodLevel>& levels, std::size_t boxes) {
  std::size_t chunks = 0;
  std::vector<std::uint32_t> counts;
  for (const LodLevel& level : levels) {
    counts.assign(boxes, 0);
    for (const std::uint32_t b : level.boxes) ++counts[b];
    for (const std::uint32_t n : counts) chunks += (n + kProjectChunk - 1) / kProjectChunk;
  }
  return chunks * kProjectChunk;
}

/// Brings the rows of a level together by box, along Hilbert's curve within each, the largest behind the
/// others as in sort_spatially, and fills up chunks. `row_ids` keeps the places.
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
  const Vec3d size = n == 0 ? Vec3d{} : box.high - box.low;
  const double cell = std::max({size.x, size.y, size.z, 1e-9}) / 2097151.0;
  const float large = n == 0 ? 0 : value_of_rank(largest, n - 1 - (n - 1) / 64);
  std::vector<std::uint64_t> codes(n);
  backend.parallel_for(n, [&](std::size_t i) {
    const Vec3d p = (in.mean(i) - box.low) * (1.0 / cell);
    codes[i] = hilbert_code({static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y),
                             static_cast<std::uint32_t>(p.z)}) |
               (largest[i] > large ? std::uint64_t{1} << 63 : 0);
  });
  std::vector<std::uint32_t> from(std::size_t{chunks} * kProjectChunk);
  backend.parallel_for(boxes, [&](std::size_t b) {
    const auto begin = order.begin() + static_cast<std::ptrdiff_t>(out[b].first),
               end = begin + out[b].count;
    std::sort(begin, end, [&](std::uint32_t x, std::uint32_t y) {
      return codes[x] != codes[y] ? codes[x] < codes[y] : x < y;
    });
    for (std::size_t k = 0; k < out[b].chunks * kProjectChunk; ++k) {
      from[out[b].first_chunk * kProjectChunk + k] =
          order[out[b].first + std::min<std::size_t>(k, out[b].count - 1)];
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
    for (std::size_t i = b.first_chunk * kProjectChunk + b.count;
         i < (b.first_chunk + b.chunks) * kProjectChunk; ++i) {
      in.opacities[i] = 0;
      in.row_ids[i] = filled++;
    }
  }
  bound_chunks(backend, in);
  return out;
}

/// Root mean square, by mass, of the distance from each of a box's finest Gaussians to the nearest of a
/// coarser level.
inline double distance_to_level(const GaussianCloud& fine, const BoxRows& in_fine,
                                const GaussianCloud& coarse, const BoxRows& in_coarse) {
  std::vector<Vec3d> points(in_coarse.count);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = coarse.mean(in_coarse.first_chunk * kProjectChunk + i);
  const PointTree tree(points);
  double squares = 0, mass = 0;
  for (std::size_t i = 0; i < in_fine.count; ++i) {
    const LodGaussian g = lod_gaussian(fine, in_fine.first_chunk * kProjectChunk + i, 0);
    squares += g.mass * tree.nearest_squared(g.mean);
    mass += g.mass;
  }
  return mass > 0 ? std::sqrt(squares / mass) : 0;
}

}  // namespace detail

/// Makes a cloud and its levels of detail of the levels that a set ships, finest first. Level k holds,
/// of each box that has one, the k-th level that is there; boxes without rows in the first are not
/// shown. A node's error is the root mean square distance, by mass, from the box's finest Gaussians to
/// the nearest of the node's own, and not below that of a finer node. The same bits for any number of
/// threads. Levels are used up. Errors: invalid_argument (no level, compact SH, a box that is not one of
/// `boxes`, levels of different filters); unsupported (boxes so small that filling their chunks would
/// take many times the rows).
template <Backend B>
requires is_host_backend<B> Result<LeveledCloud> join_levels(B& backend, std::vector<LodLevel> levels,
                                                             std::size_t boxes) {
  const auto bad = [](std::size_t l, const std::string& what) {
    return Status(Errc::invalid_argument, "join_levels: level " + std::to_string(l) + ": " + what);
  };
  if (levels.empty()) return Status(Errc::invalid_argument, "join_levels: there is no level");
  std::vector<std::vector<detail::BoxRows>> rows;
  std::size_t all = 0;
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const LodLevel& level = levels[l];
    if (level.boxes.size() != level.cloud.size()) {
      return bad(l, std::to_string(level.boxes.size()) + " boxes for " +
                        std::to_string(level.cloud.size()) + " rows");
    }
    if (!level.cloud.shN_half.empty()) return bad(l, "compact: expand_sh first");
    all += level.cloud.size();
    for (const std::uint32_t b : level.boxes) {
      if (b >= boxes) return bad(l, "box " + std::to_string(b) + " of " + std::to_string(boxes));
    }
  }
  if (detail::filled_rows(levels, boxes) > 4 * all + (std::size_t{1} << 20)) {
    return Status(Errc::unsupported, "join_levels: " + std::to_string(all) +
                                         " rows in so many small boxes that chunks of " +
                                         std::to_string(kProjectChunk) + " would be mostly empty");
  }
  for (LodLevel& level : levels) rows.push_back(detail::sort_boxes(backend, level, boxes));

  LeveledCloud out;
  LodTree& tree = out.tree;
  std::vector<std::uint32_t> node_of(boxes, LodBox::kNone);  // the coarsest so far
  std::vector<std::uint32_t> box_of;                         // of each node
  std::uint32_t first_chunk = 0;                             // of the level, in merged
  for (std::size_t l = 0; l < levels.size(); ++l) {
    tree.level_begin.push_back(static_cast<std::uint32_t>(tree.nodes.size()));
    for (std::uint32_t b = 0; b < boxes; ++b) {
      const detail::BoxRows& r = rows[l][b];
      if (r.count == 0 || (l > 0 && node_of[b] == LodBox::kNone)) continue;
      LodBox box{r.first_chunk + first_chunk, r.chunks, node_of[b], r.count, rows[0][b].count};
      node_of[b] = static_cast<std::uint32_t>(tree.nodes.size());
      tree.nodes.emplace_back();
      tree.boxes.push_back(box);
      box_of.push_back(b);
    }
    if (l > 0) first_chunk += static_cast<std::uint32_t>(levels[l].cloud.chunk_bounds.size());
  }
  tree.level_begin.push_back(static_cast<std::uint32_t>(tree.nodes.size()));
  for (const std::uint32_t node : node_of) {
    if (node != LodBox::kNone) tree.roots.push_back(node);
  }

  for (std::size_t l = 0; l < levels.size(); ++l) {
    const GaussianCloud& own = levels[l].cloud;
    backend.parallel_for(tree.level_begin[l + 1] - tree.level_begin[l], [&](std::size_t i) {
      const std::size_t at = tree.level_begin[l] + i;
      const std::uint32_t b = box_of[at];
      LodNode& node = tree.nodes[at];
      const detail::BoxRows& r = rows[l][b];
      node.reach = own.chunk_bounds[r.first_chunk];
      for (std::uint32_t c = 1; c < r.chunks; ++c) {
        node.reach = detail::both(node.reach, own.chunk_bounds[r.first_chunk + c]);
      }
      if (l == 0) {
        detail::LodGrain grain;
        for (std::size_t k = 0; k < r.count; ++k) {
          grain.add(detail::lod_gaussian(own, r.first_chunk * kProjectChunk + k, 0));
        }
        node.grain = grain.size();
        return;
      }
      const LodNode& finer = tree.nodes[tree.boxes[at].finer];
      node.grain = finer.grain;
      node.reach = detail::both(node.reach, finer.reach);
      node.error =
          std::max(finer.error,
                   static_cast<float>(detail::distance_to_level(levels[0].cloud, rows[0][b], own, r)));
    });
    if (Status s = backend.synchronize(); !s) return s;
  }
  for (std::size_t l = 1; l < levels.size(); ++l) {
    if (Status s = append(tree.merged, levels[l].cloud); !s) return bad(l, s.message());
    levels[l].cloud = {};
  }
  tree.merged.row_ids.clear();
  if (tree.merged.size() != 0) bound_chunks(backend, tree.merged);
  out.cloud = std::move(levels[0].cloud);
  return out;
}

}  // namespace gsnav
