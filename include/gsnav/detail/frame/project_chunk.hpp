// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/frame/cull.hpp"
#include "gsnav/detail/frame/project_row.hpp"
#include "gsnav/detail/frame/set_rows.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/detail/frame/squares.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/frame/sh.hpp"

namespace gsnav {

inline constexpr std::uint32_t kPartsPerChunk = kProjectChunk / kChunkPart;

/// One set of Gaussians as seen by one camera: the input of projection.
template <class S>
struct ViewedSet {
  GaussianRows gaussians;
  Selection selection;
  ProjectionCamera<S> camera;
  ProjectionCamera<double> camera64;  ///< for sort keys, and for Gaussians that are too inexact in float
  View<const Vec3d> offsets;          ///< one per origin: origin - camera position, asset frame
  int sh_degree = 0;                  ///< highest SH degree to evaluate, <= gaussians.color.degree
  std::size_t first_chunk = 0;        ///< index of the set's first chunk among the chunks of all sets
  std::uint32_t first_rank = 0;       ///< rank of the set's first Gaussian

  /// Number of chunks to draw.
  GSNAV_HD std::size_t chunk_count() const noexcept { return selection.count(gaussians.chunk_count()); }
  /// Rows of chunk `id` that may be visible.
  GSNAV_HD SeenRows seen_rows(std::size_t id) const noexcept {
    return selection.seen_rows(gaussians.chunk_count(), id);
  }
  /// Rank of the Gaussian with a row id, which decides between equal keys: that of the set's first
  /// Gaussian plus the id.
  GSNAV_HD std::uint32_t rank_of_id(std::uint32_t id) const noexcept { return first_rank + id; }
  /// Rank of a row.
  GSNAV_HD std::uint32_t rank_of(std::uint32_t row) const noexcept {
    return rank_of_id(gaussians.row_ids.empty() ? row : gaussians.row_ids[row]);
  }
};

/// Makes the ViewedSet of a set for a camera, except `offsets`, first_chunk and first_rank. Host code.
template <class S>
ViewedSet<S> view_set(const Camera& camera, const GaussianSet& set, const ProjectionRules& rules,
                      int max_sh_degree) noexcept {
  ViewedSet<S> args;
  args.gaussians = set.gaussians;
  args.selection = set.selection;
  args.camera = make_projection_camera<S>(camera, set, rules);
  args.camera64 = make_projection_camera<double>(camera, set, rules);
  args.sh_degree = min(set.gaussians.color.degree, max_sh_degree);
  return args;
}

/// Number of origins of a set. Without origins it is 1, at zero.
inline std::size_t origin_count(const GaussianRows& gs) noexcept {
  return gs.origins.empty() ? 1 : gs.origins.size;
}
/// Value o of ViewedSet::offsets. Computed in double, so it is exact to a rounding even far from the
/// world's origin. Host code.
template <class S>
Vec3d origin_offset(const ViewedSet<S>& args, std::size_t o) noexcept {
  const View<const Vec3d> table = args.gaussians.origins;
  return (table.empty() ? Vec3d{} : table[o]) - args.camera64.position;
}

/// Outputs of the projection: records of all sets of a frame, with kProjectChunk slots per chunk. Chunk
/// c of a set writes its visible splats in row order, from slot (first_chunk + c) * kProjectChunk on. It
/// writes their number to counts[first_chunk + c].
template <class S>
struct ProjectOutputs {
  View<SplatGeometry<S>> geometry;
  View<SplatColor<S>> colors;              ///< empty: colour is not requested
  View<SplatDepth<S>> depths;              ///< empty: depth is not requested
  View<SplatPerspective<S>> perspectives;  ///< empty for Response::ewa
  View<SplatBounds> bounds;
  View<std::uint32_t> keys;   ///< camera.key_code of the float32 key
  View<std::uint32_t> ranks;  ///< decides between equal keys; empty: the slot decides
  View<std::uint32_t> counts;
  TileGrid grid;  ///< read if `spans` is not empty
  /// Tiles of each slot's splat, for backends that find them during projection; else empty. Where a word
  /// has the tiles, `spans` is not written.
  View<std::uint32_t> words;
  View<TileSpans> spans;
  OpenSquares open;  ///< Backends may skip splats that reach none of these squares.
};

/// True if some Gaussian of chunk c may be visible. Conservative: never false if one is visible.
template <class S>
GSNAV_HD bool chunk_is_candidate(const ViewedSet<S>& args, std::size_t c) noexcept {
  const View<const ChunkBounds> bounds = args.gaussians.chunk_bounds;
  const std::size_t id = args.selection.chunk_id(c);
  return args.selection.may_be_seen(id) && (bounds.empty() || may_be_visible(args.camera64, bounds[id]));
}

/// True if part p of chunk `id` has a row that may be seen (seen_rows), whatever its bounds.
template <class S>
GSNAV_HD bool part_has_rows(const ViewedSet<S>& args, std::size_t id, std::size_t p) noexcept {
  return id * kProjectChunk + p * kChunkPart < args.gaussians.size() && args.selection.may_be_seen(id) &&
         args.seen_rows(id).any_of_part(p);
}
/// The parts of chunk `id`, which may be seen, for which part_has_rows() is true. Bit p is part p.
template <class S>
GSNAV_HD std::uint32_t parts_with_rows(const ViewedSet<S>& args, std::size_t id) noexcept {
  static_assert(kPartsPerChunk < 32);
  const std::size_t rows = args.gaussians.size() - id * kProjectChunk;
  const std::uint32_t all =
      (1u << (rows < kProjectChunk ? (rows + kChunkPart - 1) / kChunkPart : kPartsPerChunk)) - 1;
  return all & args.seen_rows(id).parts();
}

/// Bounds of part p of chunk `id`: its own, or those of the chunk if parts have none. Chunks must have
/// bounds.
GSNAV_HD const ChunkBounds& bounds_of_part(const GaussianRows& gs, std::size_t id,
                                           std::size_t p) noexcept {
  return gs.part_bounds.empty() ? gs.chunk_bounds[id] : gs.part_bounds[id * kPartsPerChunk + p];
}

/// Parts of chunk c that may have visible Gaussians. Bit p stands for the kChunkPart rows from p *
/// kChunkPart on. Conservative: the bit of a part with a visible Gaussian is always set. Returns 0 if
/// chunk_is_candidate() is false; bits of parts for which part_has_rows() is false are 0.
template <class S>
GSNAV_HD std::uint32_t candidate_parts(const ViewedSet<S>& args, std::size_t c) noexcept {
  const GaussianRows& gs = args.gaussians;
  const std::size_t id = args.selection.chunk_id(c);
  if (!args.selection.may_be_seen(id)) return 0;
  const std::uint32_t parts = parts_with_rows(args, id);
  if (gs.chunk_bounds.empty()) return parts;
  const double s_max = detail::ChunkInView(args.camera64, gs.chunk_bounds[id]).s_max();
  if (!may_be_visible(args.camera64, gs.chunk_bounds[id], s_max)) return 0;
  if (gs.part_bounds.empty() || lies_in_view(args.camera64, gs.chunk_bounds[id])) return parts;
  std::uint32_t in_view = 0;
  for (std::size_t p = 0; p < kPartsPerChunk; ++p) {
    if ((parts >> p & 1u) == 0) continue;
    if (may_be_visible(args.camera64, bounds_of_part(gs, id, p), s_max)) in_view |= 1u << p;
  }
  return in_view;
}

/// Calls f(row) for the rows of chunk c that may be visible, in order.
template <class S, class F>
GSNAV_HD void for_each_candidate(const ViewedSet<S>& args, std::size_t c, const F& f) noexcept {
  const std::size_t id = args.selection.chunk_id(c), size = args.gaussians.size();
  const std::size_t begin = id * kProjectChunk;
  const std::size_t end = begin + kProjectChunk < size ? begin + kProjectChunk : size;
  std::uint32_t parts = candidate_parts(args, c);
  if (parts == 0) return;
  const SeenRows seen = args.seen_rows(id);
  for (std::size_t first = begin; first < end; first += kChunkPart, parts >>= 1) {
    if ((parts & 1u) == 0) continue;
    const std::size_t last = first + kChunkPart < end ? first + kChunkPart : end;
    for (std::size_t i = first; i < last; ++i) {
      if (seen.has(i - begin)) f(i);
    }
  }
}

/// Unit vector along `delta` (mean - camera, asset frame): the direction at which SH is evaluated.
template <class L>
GSNAV_HD Vec3<L> view_direction(const Vec3<L>& delta) noexcept {
  using S = scalar_of<L>;
  const L n = norm(delta);
  // A camera at the mean has no view direction. Use z, so that the colour is finite.
  const auto defined = n > L(S(1e-12));
  const Vec3<L> unit = delta * (L(S(1)) / n);
  return {select(defined, unit.x, L(S(0))), select(defined, unit.y, L(S(0))),
          select(defined, unit.z, L(S(1)))};
}

/// A view direction turned back by the rotation of a Gaussian since training: where its SH see it from.
template <class L>
GSNAV_HD Vec3<L> turned_back(const Vec3<L>& direction, const Quat<L>& rotation) noexcept {
  return rotate(conjugate(rotation), direction);
}

/// Colour of Gaussian i seen along `delta` (mean - camera, asset frame, any length), with SH up to
/// `degree`.
template <class S>
GSNAV_HD SplatColor<S> gaussian_color(const ColorRows& rows, int degree, std::size_t i,
                                      Vec3<S> delta) noexcept {
  if (degree > 0) {
    delta = view_direction(delta);
    if (!rows.rotations.empty()) {
      const Planes<const float, 4>& r = rows.rotations;
      delta = turned_back(delta, Quat<S>{S(r[0][i]), S(r[1][i]), S(r[2][i]), S(r[3][i])});
    }
  }
  const Vec3<S> c = with_coefficients(rows, i, [&](const auto& coefficient) GSNAV_INLINED {
    return sh_color<S>(degree, delta, [&](int k) GSNAV_INLINED { return vec_cast<S>(coefficient(k)); });
  });
  return {c.x, c.y, c.z, S(0)};
}

/// A projected row: its key, its records, and the direction for its colour.
template <class S>
struct RowSplat {
  float key;      ///< sort_key
  Vec3<S> delta;  ///< for the colour: mean - camera, asset frame
  Splat<S> splat;
};

/// Projects row i in the precision that its geometry needs. Returns false if it is not visible. `depth`
/// requests the depth record.
template <class S>
GSNAV_HD bool project_row(const ViewedSet<S>& args, bool depth, std::size_t i,
                          RowSplat<S>& out) noexcept {
  const ViewedRow row({args.gaussians.shape, i}, args.offsets);
  RowKey<float> key = row_key<float>(args.camera64, row);
  if constexpr (sizeof(S) == sizeof(float)) {
    if (!beyond_near_plane(args.camera.near_plane, key.z)) return false;
    const ProjectedRow<float> projected(args.camera, row, key);
    if (!projected.splat.visible) return false;
    out.key = sort_key(args.camera64, key);
    out.delta = key.delta;
    if (detail::needs_double(args.camera, projected.splat))
      return make_splat64(args.camera64, depth, row, key, out.splat);
    return make_splat<false>(args.camera, args.camera64, depth, key, projected, out.splat);
  } else {
    // The float64 reference computes its own depths, so that an error in `row_key` shows in comparisons.
    const Vec3d position = args.camera.rotation * key.delta64;
    key.z = static_cast<float>(position.z * args.camera.scale);
    const ProjectedRow<double> projected(args.camera, row, key);
    if (!projected.splat.visible) return false;
    const bool by_z = args.camera.sort_order == SortOrder::z_depth;
    out.key = by_z ? key.z : static_cast<float>(norm(position) * args.camera.scale);
    out.delta = key.delta64;
    return make_splat<false>(args.camera, depth, projected, projected.splat.mean_x,
                             projected.splat.mean_y, out.splat);
  }
}

/// Writes the records of row i to `slot`.
template <class S>
GSNAV_HD void write_splat(const ViewedSet<S>& args, const ProjectOutputs<S>& out, std::size_t slot,
                          std::size_t i, const RowSplat<S>& row) noexcept {
  const GaussianRows& gs = args.gaussians;
  out.bounds[slot] = row.splat.bounds;
  out.geometry[slot] = row.splat.geometry;
  if (args.camera.response != Response::ewa) out.perspectives[slot] = row.splat.perspective;
  if (!out.depths.empty()) out.depths[slot] = row.splat.depth;
  if (!out.spans.empty()) {
    out.words[slot] = 0;
    out.spans[slot].rows = TileSpans::kLarge;
  }
  out.keys[slot] = args.camera.key_code(row.key);
  if (!out.ranks.empty()) out.ranks[slot] = args.rank_of(static_cast<std::uint32_t>(i));
  if (!out.colors.empty()) {
    out.colors[slot] = gaussian_color<S>(gs.color, gs.color.degree_of(i, args.sh_degree), i, row.delta);
  }
}

/// Projects row i and writes it to `slot`. Returns false, having written nothing, if it is not visible.
template <class S>
GSNAV_HD bool project_gaussian(const ViewedSet<S>& args, const ProjectOutputs<S>& out, std::size_t slot,
                               std::size_t i) noexcept {
  RowSplat<S> row;
  if (!project_row(args, !out.depths.empty(), i, row)) return false;
  write_splat(args, out, slot, i, row);
  return true;
}

/// Kernel that projects chunk `c` of a set, one Gaussian after the other.
template <class S>
struct ProjectChunk {
  ViewedSet<S> args;
  ProjectOutputs<S> out;

  GSNAV_HD void operator()(std::size_t c) const noexcept {
    const std::size_t base = (args.first_chunk + c) * kProjectChunk;
    std::uint32_t written = 0;
    for_each_candidate(args, c, [&](std::size_t i) GSNAV_INLINED {
      if (project_gaussian(args, out, base + written, i)) ++written;
    });
    out.counts[args.first_chunk + c] = written;
  }
};

}  // namespace gsnav
