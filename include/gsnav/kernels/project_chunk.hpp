// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/kernels/cull.hpp"
#include "gsnav/kernels/gaussians.hpp"
#include "gsnav/kernels/packed_gaussians.hpp"
#include "gsnav/kernels/projection.hpp"
#include "gsnav/kernels/sh.hpp"
#include "gsnav/kernels/splat.hpp"
#include "gsnav/kernels/tiles.hpp"
#include "gsnav/math/half.hpp"

namespace gsnav {

/// Arguments of the projection of one set for one camera. Outputs have room for
/// kProjectChunk records per chunk; chunk c of the set writes its survivors, in row order, from
/// (first_chunk + c) * kProjectChunk on and their number to counts[first_chunk + c].
template <class S>
struct ProjectArgs {
  GaussianView gaussians;
  ProjectionCamera<S> camera;
  ProjectionCamera<double> camera64;  ///< for sort keys, and for Gaussians whose geometry float cannot hold
  View<const Vec3<float>> offsets_f;  ///< float(origin - camera), one an origin
  View<const Vec3d> offsets;          ///< the same in double
  int sh_degree = 0;                  ///< highest degree to evaluate, <= gaussians.sh_degree
  bool color = true;                  ///< evaluate SH (RGB asked for)
  bool depth = true;                  ///< fill `depths`
  std::size_t first_chunk = 0;
  std::uint32_t first_rank = 0;  ///< of the set's first Gaussian among all
  View<SplatGeometry<S>> geometry;
  View<SplatColor<S>> colors;   ///< empty unless `color`
  View<SplatDepth<S>> depths;   ///< empty unless `depth`
  View<SplatPerspective<S>> perspectives;  ///< empty for Response::ewa
  View<SplatBounds> bounds;
  View<std::uint32_t> keys;     ///< camera.key_code of the float32 key
  View<std::uint32_t> ranks;    ///< what decides between equal keys; empty: the slot does
  View<std::uint32_t> counts;
  TileGrid grid;               ///< read where `spans` is not empty
  View<TileSpans> spans;       ///< tiles of each slot's splat, for backends that find them here; else empty
  OpenCells open;              ///< backends that do may leave out what reaches none of these

  GSNAV_HD std::size_t chunk_count() const noexcept { return gaussians.chunk_count(); }
};

/// Whether any Gaussian of chunk c may be visible. Never no where one is.
template <class S>
GSNAV_HD bool chunk_is_candidate(const ProjectArgs<S>& args, std::size_t c) noexcept {
  const View<const ChunkBounds> bounds = args.gaussians.chunk_bounds;
  const std::size_t id = args.gaussians.chunk_id(c);
  return args.gaussians.may_be_seen(id) && (bounds.empty() || may_be_visible(args.camera64, bounds[id]));
}

/// Which parts of chunk c have Gaussians that may be visible: bit p for the kChunkPart rows from p kChunkPart on.
/// Never without one that is; no bit where chunk_is_candidate says no, or where seen_rows() has none of them.
template <class S>
GSNAV_HD std::uint32_t candidate_parts(const ProjectArgs<S>& args, std::size_t c) noexcept {
  static_assert(kProjectChunk / kChunkPart <= 32);
  const GaussianView& gs = args.gaussians;
  const std::size_t id = gs.chunk_id(c);
  if (!gs.may_be_seen(id)) return 0;
  constexpr std::size_t kParts = kProjectChunk / kChunkPart;
  const std::uint32_t parts = gs.seen_rows(id).parts();
  if (gs.chunk_bounds.empty()) return parts;
  const double s_max = detail::ChunkInView(args.camera64, gs.chunk_bounds[id]).s_max();
  if (!may_be_visible(args.camera64, gs.chunk_bounds[id], s_max)) return 0;
  if (gs.part_bounds.empty() || lies_in_view(args.camera64, gs.chunk_bounds[id])) return parts;
  std::uint32_t in_view = 0;
  for (std::size_t p = 0; p < kParts && id * kParts + p < gs.part_bounds.size; ++p) {
    if ((parts >> p & 1u) == 0) continue;
    if (may_be_visible(args.camera64, gs.part_bounds[id * kParts + p], s_max)) in_view |= 1u << p;
  }
  return in_view;
}

namespace detail {

/// mean - camera position, asset frame, in double.
template <class S>
GSNAV_HD Vec3d camera_delta64(const ProjectArgs<S>& args, const Vec3<float>& mean, std::size_t origin) noexcept {
  return vec_cast<double>(mean) + args.offsets[origin];
}

/// The same in the scalar of the kernel.
template <class S>
GSNAV_HD Vec3<S> camera_delta(const ProjectArgs<S>& args, const Vec3<float>& mean,
                              std::size_t origin) noexcept {
  if constexpr (sizeof(S) == sizeof(float)) {
    return mean + args.offsets_f[origin];
  } else {
    return vec_cast<S>(camera_delta64(args, mean, origin));
  }
}

/// Depth of a centre along the view axis as near planes and sort keys take it: float32, metres.
template <class S>
GSNAV_HD float depth_of(const ProjectArgs<S>& args, const Vec3<float>& mean, std::size_t origin) noexcept {
  return static_cast<float>(depth_key(args.camera64, camera_delta64(args, mean, origin)));
}

/// The float32 sort key of a centre whose `depth_of` is `z`, metres.
template <class S>
GSNAV_HD float sort_key(const ProjectArgs<S>& args, float z, const Vec3<float>& mean, std::size_t origin) noexcept {
  if (args.camera64.sort_order == SortOrder::z_depth) return z;
  return static_cast<float>(distance_key(args.camera64, camera_delta64(args, mean, origin)));
}

/// Pixels whose centre lies within [center - half, center + half], clipped to [0, size): half-open.
template <class L>
GSNAV_HD void pixel_range(L center, L half, int size, L& low, L& high) noexcept {
  using S = scalar_of<L>;
  const L one(S(1)), end(static_cast<S>(size));
  const L first = clamp(center - half - L(S(0.5)), -one, end);
  const L last = clamp(center + half - L(S(0.5)), -one, end);
  const L f = truncated(first), l = truncated(last);  // towards zero: made a ceiling, and a floor
  low = max(select(f < first, f + one, f), L(S(0)));
  high = min(select(l > last, l - one, l) + one, end);
}

/// The pixels of the 16-pixel tiles that [center - radius, center + radius] reaches, in a compat mode's
/// own rounding: `slack` is what INRIA adds to the upper end (tile - 1 pixel) where gsplat rounds up.
template <class S>
GSNAV_HD void clip_to_tiles(S center, S radius, S slack, int size, std::int32_t& low,
                            std::int32_t& high) noexcept {
  constexpr int kTile = 16;
  const S last_tile = S((size + kTile - 1) / kTile);
  const S first = clamp((center - radius) * S(1.0 / kTile), S(0), last_tile);
  const S last = clamp((center + radius + slack) * S(1.0 / kTile), S(0), last_tile);
  std::int32_t end = static_cast<std::int32_t>(last);
  if (slack == S(0) && S(end) < last) ++end;
  const std::int32_t begin_px = static_cast<std::int32_t>(first) * kTile, end_px = end * kTile;
  low = low > begin_px ? low : begin_px;
  high = high < end_px ? high : end_px;
}

/// Whole number not below x >= 0.
template <class S>
GSNAV_HD S ceiling(S x) noexcept {
  if (!(x < S(8388608))) return x;
  const S whole = S(static_cast<std::int32_t>(x));
  return whole < x ? whole + S(1) : whole;
}

/// Narrows bounds to the tiles that the renderer named by `compat` visits.
template <class S>
GSNAV_HD void narrow_to_compat(const ProjectionCamera<S>& camera, const Projected<S>& p,
                               SplatBounds& b) noexcept {
  const S scale2 = S(kWhitenScale * kWhitenScale);
  if (camera.compat == Compat::gsplat) {
    const S extent = min(S(3.33), sqrt(max(p.s_max, S(0))) * S(1 / kWhitenScale));
    clip_to_tiles(p.mean_x, ceiling(extent * sqrt(p.variance_x)), S(0), camera.width, b.x0, b.x1);
    clip_to_tiles(p.mean_y, ceiling(extent * sqrt(p.variance_y)), S(0), camera.height, b.y0, b.y1);
    return;
  }
  // det = (scale^2 / (a b))^2; the larger eigenvalue by INRIA's formula with its floor of 0.1.
  const S root_det = scale2 / (p.a * p.b);
  const S mid = S(0.5) * (p.variance_x + p.variance_y);
  const S radius = ceiling(S(3) * sqrt(mid + sqrt(max(S(0.1), fma(mid, mid, -(root_det * root_det))))));
  clip_to_tiles(p.mean_x - S(0.5), radius, S(15), camera.width, b.x0, b.x1);
  clip_to_tiles(p.mean_y - S(0.5), radius, S(15), camera.height, b.y0, b.y1);
}

/// Centre of the pixel of [0, size) that is nearest to x.
template <class L>
GSNAV_HD L reference_pixel(L x, int size) noexcept {
  using S = scalar_of<L>;
  return truncated(clamp(x, L(S(0)), L(static_cast<S>(size - 1)))) + L(S(0.5));
}

/// The pixels that a footprint may cover. Returns false where there are none.
template <class T>
GSNAV_HD bool splat_bounds(const ProjectionCamera<T>& camera, const Projected<T>& p,
                           SplatBounds& b) noexcept {
  T x0, x1, y0, y1;
  pixel_range(p.center_x, p.half_width, camera.width, x0, x1);
  pixel_range(p.center_y, p.half_height, camera.height, y0, y1);
  b = {static_cast<std::int32_t>(x0), static_cast<std::int32_t>(y0), static_cast<std::int32_t>(x1),
       static_cast<std::int32_t>(y1)};
  if (camera.compat != Compat::none) narrow_to_compat(camera, p, b);
  return b.x0 < b.x1 && b.y0 < b.y1;
}

/// Rounds what was computed in T (S, or double for the few that need it) to the records of slot. The
/// mean comes in U: its rounding in float, 3e-5 px, would be the largest error of the exponent.
/// Returns false where no pixel centre lies in the bounds.
template <class T, class U, class S>
GSNAV_HD bool store_splat(const ProjectArgs<S>& args, std::size_t slot,
                          const ProjectionCamera<T>& camera, const Projected<T>& p,
                          const SplatAxes<T>& axes, U mean_x, U mean_y) noexcept {
  SplatBounds b;
  if (!splat_bounds(camera, p, b)) return false;
  args.bounds[slot] = b;

  const U ref_x = reference_pixel(mean_x, camera.width), ref_y = reference_pixel(mean_y, camera.height);
  const T ox = static_cast<T>(ref_x - mean_x), oy = static_cast<T>(ref_y - mean_y);
  SplatGeometry<S>& g = args.geometry[slot];
  g.ref_x = static_cast<S>(ref_x);
  g.ref_y = static_cast<S>(ref_y);
  g.a = static_cast<S>(p.a);
  g.k = static_cast<S>(p.k);
  g.b = static_cast<S>(p.b);
  g.w1 = static_cast<S>(p.a * ox);
  g.w2 = static_cast<S>(fma(p.k, ox, p.b * oy));
  g.log2_opacity = static_cast<S>(p.log2_opacity);
  if (camera.response != Response::ewa) {
    args.perspectives[slot] = {static_cast<S>(fma(p.slope_x, ox, fma(p.slope_y, oy, T(1)))),
                               static_cast<S>(p.slope_x), static_cast<S>(p.slope_y),
                               static_cast<S>(p.bend)};
  }
  if (args.depth) {
    const SplatDepth<T> d = make_splat_depth(camera, axes, p);
    SplatDepth<S>& out = args.depths[slot];
    out.mean_x = static_cast<S>(d.mean_x);
    out.mean_y = static_cast<S>(d.mean_y);
    out.z = static_cast<S>(d.z);
    out.reach = static_cast<S>(d.reach);
    for (int i = 0; i < 3; ++i) {
      out.g[i] = static_cast<S>(d.g[i]);
      out.gx[i] = static_cast<S>(d.gx[i]);
      out.gy[i] = static_cast<S>(d.gy[i]);
    }
  }
  return true;
}

/// The mean alone, in double.
template <class L>
GSNAV_HD void project_mean(const ProjectionCamera<double>& camera, const Vec3<L>& delta, L& mean_x,
                           L& mean_y) noexcept {
  const auto row = [&](int r) GSNAV_INLINED {
    return Vec3<L>{L(camera.rotation(r, 0)), L(camera.rotation(r, 1)), L(camera.rotation(r, 2))};
  };
  const L inv_z = L(1.0) / dot(row(2), delta);
  mean_x = fma(L(camera.fx), dot(row(0), delta) * inv_z, L(camera.cx));
  mean_y = fma(L(camera.fy), dot(row(1), delta) * inv_z, L(camera.cy));
}

/// Whether the whitened form loses too much in float: k dx + b dy cancels over a long needle's visible
/// length, or between a far mean and the image.
template <class L>
GSNAV_HD mask_of<L> needs_double(const ProjectionCamera<scalar_of<L>>& camera, const Projected<L>& p) noexcept {
  using S = scalar_of<L>;
  const L ox = reference_pixel(p.mean_x, camera.width) - p.mean_x;
  const L oy = reference_pixel(p.mean_y, camera.height) - p.mean_y;
  const L length_x = min(p.half_width, L(static_cast<S>(camera.width)));
  const L length_y = min(p.half_height, L(static_cast<S>(camera.height)));
  return (fma(abs(p.k), length_x, p.b * length_y) > L(S(512))) ||
         (fma(abs(p.k), abs(ox), p.b * abs(oy)) > L(S(16)));
}

/// Row i of the set's shape in camera axes.
template <class S>
GSNAV_HD SplatAxes<S> load_axes(const GaussianView& gs, const ProjectionCamera<S>& camera,
                                const Vec3<S>& delta, std::size_t i) noexcept {
  if (!gs.axes[0].empty()) {
    Mat3<S> factor;
    for (int r = 0; r < 3; ++r) {
      factor.row[r] = {S(gs.axes[3 * r][i]), S(gs.axes[3 * r + 1][i]), S(gs.axes[3 * r + 2][i])};
    }
    return splat_axes(camera.rotation, delta, factor);
  }
  Quat<S> quat = quat_cast<S>(quat_of(gs, i));
  // Rounded to float a unit quaternion is off by 6e-8: nothing in float, but not in a reference.
  if constexpr (sizeof(S) > sizeof(float)) normalize(quat);
  return splat_axes(camera.rotation, delta, quat, vec_cast<S>(scales_of(gs, i)));
}

}  // namespace detail

/// Unit vector along `delta` (mean - camera, asset frame), the direction that SH is evaluated in.
template <class L>
GSNAV_HD Vec3<L> view_direction(const Vec3<L>& delta) noexcept {
  using S = scalar_of<L>;
  const L n = norm(delta);
  // A camera at the mean sees no direction; z stands in, so that the colour is finite.
  const auto defined = n > L(S(1e-12));
  const Vec3<L> unit = delta * (L(S(1)) / n);
  return {select(defined, unit.x, L(S(0))), select(defined, unit.y, L(S(0))), select(defined, unit.z, L(S(1)))};
}

/// Colour of Gaussian i seen along `delta` (mean - camera, asset frame, any length), SH to `degree`.
template <class S>
GSNAV_HD SplatColor<S> gaussian_color(const GaussianView& gs, int degree, std::size_t i,
                                      Vec3<S> delta) noexcept {
  if (degree > 0) {
    delta = view_direction(delta);
    if (!gs.sh_rotations[0].empty()) {
      const Quat<S> q{S(gs.sh_rotations[0][i]), S(gs.sh_rotations[1][i]), S(gs.sh_rotations[2][i]),
                      S(gs.sh_rotations[3][i])};
      delta = rotate(conjugate(q), delta);
    }
  }
  if (has_packed_colors(gs)) {
    const Vec3<S> c = sh_color<S>(degree, delta, [&](int k) GSNAV_INLINED { return vec_cast<S>(packed_coefficient(gs, i, k)); });
    return {c.x, c.y, c.z, S(0)};
  }
  const float* sh0 = gs.sh0.data + 3 * i;
  const std::size_t rest = static_cast<std::size_t>(sh_coefficient_count(gs.sh_degree) - 1);
  if (!gs.shN_half.empty()) {
    const std::uint16_t* halves = gs.shN_half.data + 3 * rest * i;
    const Vec3<S> c = sh_color<S>(degree, delta, [=](int k) GSNAV_INLINED {
      if (k == 0) return Vec3<S>{S(sh0[0]), S(sh0[1]), S(sh0[2])};
      const std::uint16_t* p = halves + 3 * (k - 1);
      return Vec3<S>{S(half_to_float(p[0])), S(half_to_float(p[1])), S(half_to_float(p[2]))};
    });
    return {c.x, c.y, c.z, S(0)};
  }
  const float* shn = gs.shN.data + 3 * rest * i;
  const Vec3<S> c = sh_color<S>(degree, delta, [=](int k) GSNAV_INLINED {
    const float* p = k == 0 ? sh0 : shn + 3 * (k - 1);
    return Vec3<S>{S(p[0]), S(p[1]), S(p[2])};
  });
  return {c.x, c.y, c.z, S(0)};
}

namespace detail {
/// Row i projected in double.
template <class S>
GSNAV_HD Projected<double> project64(const ProjectArgs<S>& args, std::size_t i, float key_z,
                                     const Vec3<float>& mean, std::size_t origin,
                                     SplatAxes<double>& axes) noexcept {
  axes = load_axes(args.gaussians, args.camera64, camera_delta64(args, mean, origin), i);
  return project<double, float>(args.camera64, axes, key_z,
                                static_cast<double>(opacity_of(args.gaussians, i)));
}
}  // namespace detail

/// Writes survivor i, whose mean is `mean` (stored offset), to `slot`. Returns false where no pixel
/// centre lies in its bounds.
template <class S>
GSNAV_HD bool write_splat(const ProjectArgs<S>& args, std::size_t slot, std::size_t i, float key,
                          const Vec3<float>& mean, std::size_t origin, const Projected<S>& p,
                          const SplatAxes<S>& axes) noexcept {
  const GaussianView& gs = args.gaussians;
  bool written;
  if (sizeof(S) == sizeof(float) && detail::needs_double(args.camera, p)) {
    SplatAxes<double> axes64;
    const Projected<double> p64 = detail::project64(args, i, key, mean, origin, axes64);
    written = detail::store_splat(args, slot, args.camera64, p64, axes64, p64.mean_x, p64.mean_y);
  } else if (sizeof(S) == sizeof(float)) {
    double mean_x, mean_y;
    detail::project_mean(args.camera64, detail::camera_delta64(args, mean, origin), mean_x, mean_y);
    written = detail::store_splat(args, slot, args.camera, p, axes, mean_x, mean_y);
  } else {
    written = detail::store_splat(args, slot, args.camera, p, axes, p.mean_x, p.mean_y);
  }
  if (!written) return false;
  if (!args.spans.empty()) args.spans[slot].rows = TileSpans::kLarge;
  args.keys[slot] = args.camera.key_code(key);
  if (!args.ranks.empty()) {
    const std::uint32_t row = gs.row_ids.empty() ? static_cast<std::uint32_t>(i) : gs.row_ids[i];
    args.ranks[slot] = args.first_rank + row;
  }
  if (args.color) {
    args.colors[slot] =
        gaussian_color<S>(gs, gs.degree_of(i, args.sh_degree), i, detail::camera_delta(args, mean, origin));
  }
  return true;
}

/// Projects Gaussian i to `slot`. Returns whether it may be seen.
template <class S>
GSNAV_HD bool project_gaussian(const ProjectArgs<S>& args, std::size_t slot, std::size_t i) noexcept {
  const GaussianView& gs = args.gaussians;
  const std::size_t origin = gs.origin_ids.empty() ? 0 : gs.origin_ids[i];
  const Vec3<float> mean = mean_of(gs, i);
  constexpr bool kReference = sizeof(S) > sizeof(float);
  float z = 0;
  if constexpr (!kReference) {
    z = detail::depth_of(args, mean, origin);
    if (!(z > args.camera.near_plane)) return false;
  }
  const SplatAxes<S> axes = detail::load_axes(gs, args.camera, detail::camera_delta(args, mean, origin), i);
  // The float64 reference takes depths from its own projection, so that a fault of `depth_key` shows beside it.
  if constexpr (kReference) z = static_cast<float>(axes.position.z * args.camera.scale);
  const Projected<S> p = project<S, float>(args.camera, axes, z, S(opacity_of(gs, i)));
  if (!p.visible) return false;
  float key = detail::sort_key(args, z, mean, origin);
  if constexpr (kReference) {
    if (args.camera.sort_order == SortOrder::camera_distance) {
      key = static_cast<float>(norm(axes.position) * args.camera.scale);
    }
  }
  return write_splat(args, slot, i, key, mean, origin, p, axes);
}

/// Projects chunk `c` of a set, one Gaussian after the other.
template <class S>
struct ProjectChunk {
  ProjectArgs<S> args;

  GSNAV_HD void operator()(std::size_t c) const noexcept {
    const std::size_t begin = args.gaussians.chunk_id(c) * kProjectChunk, size = args.gaussians.size;
    const std::size_t end = begin + kProjectChunk < size ? begin + kProjectChunk : size;
    const std::size_t base = (args.first_chunk + c) * kProjectChunk;
    std::uint32_t written = 0, parts = candidate_parts(args, c);
    if (parts == 0) {
      args.counts[args.first_chunk + c] = 0;
      return;
    }
    const SeenRows seen = args.gaussians.seen_rows(args.gaussians.chunk_id(c));
    for (std::size_t first = begin; first < end; first += kChunkPart, parts >>= 1) {
      if ((parts & 1u) == 0) continue;
      const std::size_t last = first + kChunkPart < end ? first + kChunkPart : end;
      for (std::size_t i = first; i < last; ++i) {
        if (seen.has(i - begin) && project_gaussian(args, base + written, i)) ++written;
      }
    }
    args.counts[args.first_chunk + c] = written;
  }
};

}  // namespace gsnav
