// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <type_traits>

#include "gsnav/detail/frame/projection.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/detail/frame/set_rows.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/detail/image/pixel_center.hpp"
#include "gsnav/math/functions.hpp"

// Formulas that turn a row of a set into the records of its splat, for one row or a pack of rows. The
// drivers (serial kernel, SIMD kernels, CUDA kernels) contribute loops, masks and memory. They call the
// formulas in this order: row_key, near plane, ProjectedRow, needs_double and pixel_box, splat_geometry.

namespace gsnav {

/// Rows of a set relative to a camera: the input of row_key and ProjectedRow.
template <class At>
struct ViewedRows : SetRows<At> {
  using L = typename At::lane;
  View<const Vec3d> offsets;  ///< one per origin: origin - camera position, asset frame

  GSNAV_HD ViewedRows(const At& of, const View<const Vec3d>& from) noexcept
      : SetRows<At>{of}, offsets(from) {}
  GSNAV_HD Vec3<doubles_of<L>> offset() const noexcept { return this->at.offset(offsets); }
  GSNAV_HD Vec3<L> rounded_offset(const Vec3<doubles_of<L>>& offset) const noexcept {
    return vec_cast<L>(offset);
  }
};
using ViewedRow = ViewedRows<OneRow>;

/// Position of a row's centre relative to the camera. F is float or a pack of floats.
template <class F>
struct RowKey {
  Vec3<doubles_of<F>> delta64;  ///< mean - camera position, asset frame
  Vec3<F> delta;                ///< delta64 in float32
  F z;  ///< depth along the view axis, metres; near planes and sort keys compare it
};

/// Computes the position of a row's centre. The depth is computed in double and rounded to float32 once.
template <class F, class Row>
GSNAV_HD RowKey<F> row_key(const ProjectionCamera<double>& camera, const Row& row) noexcept {
  using D = doubles_of<F>;
  const Vec3<F> mean = row.mean();
  const Vec3<D> offset = row.offset(), delta64 = vec_cast<D>(mean) + offset;
  return {delta64, mean + row.rounded_offset(offset), static_cast<F>(depth_key(camera, delta64))};
}

/// Sort key in float32, metres.
template <class F>
GSNAV_HD F sort_key(const ProjectionCamera<double>& camera, const RowKey<F>& key) noexcept {
  if (camera.sort_order == SortOrder::z_depth) return key.z;
  return static_cast<F>(distance_key(camera, key.delta64));
}

/// mean - camera position, in the precision of L.
template <class L, class F>
GSNAV_HD Vec3<L> delta_of(const RowKey<F>& key) noexcept {
  if constexpr (sizeof(scalar_of<L>) > sizeof(float)) {
    return key.delta64;
  } else {
    return key.delta;
  }
}

/// Shape of a row in camera axes.
template <class L, class Row>
GSNAV_HD SplatAxes<L> row_axes(const Mat3<scalar_of<L>>& rotation, const Vec3<L>& delta,
                               const Row& row) noexcept {
  if (row.has_factor()) return splat_axes(rotation, delta, mat_cast<L>(row.factor()));
  Quat<L> quat = quat_cast<L>(row.quat());
  // A unit quaternion rounded to float32 is off by 6e-8: negligible in float, too much for the float64
  // reference.
  if constexpr (sizeof(scalar_of<L>) > sizeof(float)) normalize(quat);
  return splat_axes(rotation, delta, quat, vec_cast<L>(row.scales()));
}

/// A row projected to the image, computed in L. Members are initialised in place: packs assigned to a
/// struct are copied through memory.
template <class L>
struct ProjectedRow {
  SplatAxes<L> axes;
  Projected<L> splat;

  template <class Row, class F>
  GSNAV_HD ProjectedRow(const ProjectionCamera<scalar_of<L>>& camera, const Row& row,
                        const RowKey<F>& key) noexcept
      : axes(row_axes<L>(camera.rotation, delta_of<L>(key), row)),
        splat(project<L, F>(camera, axes, key.z, static_cast<L>(row.opacity()))) {}
};

namespace detail {

/// Projects only the mean, in double.
/// @param delta mean - camera position, asset frame
template <class D>
GSNAV_HD PinholePoint<D> project_mean(const ProjectionCamera<double>& camera,
                                      const Vec3<D>& delta) noexcept {
  return {camera, mat_cast<D>(camera.rotation) * delta};
}

/// Centre of the pixel in [0, size) that is nearest to x.
template <class L>
GSNAV_HD L reference_pixel(L x, int size) noexcept {
  using S = scalar_of<L>;
#if defined(__CUDA_ARCH__)
  // The same pixel with fewer instructions: on a GPU, conversions to integers saturate.
  if constexpr (std::is_same_v<L, double>) {
    const int pixel = static_cast<int>(x);
    return pixel_center<double>(pixel < 0 ? 0 : pixel < size ? pixel : size - 1);
  } else
#endif
  {
    return truncated(clamp(x, L(S(0)), L(static_cast<S>(size - 1)))) + L(S(0.5));
  }
}

}  // namespace detail

/// Pixel that the records of a splat are relative to (detail/frame/splat.hpp), and its centre's offset
/// from the mean.
template <class L>
struct ReferencePixel {
  L x, y;
  L dx, dy;
};

/// Reference pixel of a mean. U is the type of the mean. Drivers use double: float32 rounding of the
/// mean (3e-5 px) would dominate the error of the exponent.
template <class L, class U>
GSNAV_HD ReferencePixel<L> reference_of(int width, int height, const U& mean_x,
                                        const U& mean_y) noexcept {
  const U x = detail::reference_pixel(mean_x, width), y = detail::reference_pixel(mean_y, height);
  return {static_cast<L>(x), static_cast<L>(y), static_cast<L>(x - mean_x), static_cast<L>(y - mean_y)};
}

namespace detail {

/// Largest whitened length in the image, and largest whitened offset of the reference pixel, for which
/// float is precise enough.
inline constexpr double kFloatLength = 512, kFloatOffset = 16;

/// True if the whitened form is too inexact in float. k dx + b dy then cancels over the visible length
/// of a long needle, or between a distant mean and the image. Such rows are projected in double.
template <class L>
GSNAV_HD mask_of<L> needs_double(const ProjectionCamera<scalar_of<L>>& camera,
                                 const Projected<L>& p) noexcept {
  using S = scalar_of<L>;
  const ReferencePixel<L> ref = reference_of<L>(camera.width, camera.height, p.mean_x, p.mean_y);
  const L length_x = min(p.half_width, L(static_cast<S>(camera.width)));
  const L length_y = min(p.half_height, L(static_cast<S>(camera.height)));
  return (fma(abs(p.k), length_x, p.b * length_y) > L(S(kFloatLength))) ||
         (fma(abs(p.k), abs(ref.dx), p.b * abs(ref.dy)) > L(S(kFloatOffset)));
}

/// Pixels of [0, size) whose centre is within [center - half, center + half], as a half-open range.
template <class L>
GSNAV_HD void pixel_range(L center, L half, int size, L& low, L& high) noexcept {
  using S = scalar_of<L>;
  const L one(S(1)), end(static_cast<S>(size));
  const L first = clamp(center - half - L(S(0.5)), -one, end);
  const L last = clamp(center + half - L(S(0.5)), -one, end);
  // truncated() rounds toward zero. Correct it to ceil for the first pixel and floor for the last.
  const L f = truncated(first), l = truncated(last);
  low = max(select(f < first, f + one, f), L(S(0)));
  high = min(select(l > last, l - one, l) + one, end);
}

/// Pixels whose centres lie in the bounding box of a footprint.
template <class L>
GSNAV_HD PixelBox<L> pixel_box(const ProjectionCamera<scalar_of<L>>& camera,
                               const Projected<L>& p) noexcept {
  PixelBox<L> box;
  pixel_range(p.center_x, p.half_width, camera.width, box.x0, box.x1);
  pixel_range(p.center_y, p.half_height, camera.height, box.y0, box.y1);
  return box;
}

/// Limits a range to the pixels of the 16-pixel tiles that [center - radius, center + radius] reaches,
/// with the rounding of another renderer. `slack` is what INRIA adds to the upper end (tile - 1 pixels);
/// with 0, the end is rounded up as in gsplat.
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

/// Smallest integer >= x, for x >= 0.
template <class S>
GSNAV_HD S ceiling(S x) noexcept {
  if (!(x < S(8388608))) return x;
  const S whole = S(static_cast<std::int32_t>(x));
  return whole < x ? whole + S(1) : whole;
}

/// Narrows the bounds to the tiles that the renderer `compat` visits.
template <class S>
GSNAV_HD void narrow_to_compat(const ProjectionCamera<S>& camera, const Projected<S>& p,
                               SplatBounds& b) noexcept {
  const S scale2 = S(kWhitenScale * kWhitenScale);
  if (camera.compat == Compat::gsplat) {
    const S extent = min(S(3.33), footprint_radius(p.s_max));
    clip_to_tiles(p.mean_x, ceiling(extent * sqrt(p.variance_x)), S(0), camera.width, b.x0, b.x1);
    clip_to_tiles(p.mean_y, ceiling(extent * sqrt(p.variance_y)), S(0), camera.height, b.y0, b.y1);
    return;
  }
  // det = (scale^2 / (a b))^2. The larger eigenvalue is by INRIA's formula with its lower limit of 0.1.
  const S root_det = scale2 / (p.a * p.b);
  const S mid = S(0.5) * (p.variance_x + p.variance_y);
  const S radius = ceiling(S(3) * sqrt(mid + sqrt(max(S(0.1), fma(mid, mid, -(root_det * root_det))))));
  clip_to_tiles(p.mean_x - S(0.5), radius, S(15), camera.width, b.x0, b.x1);
  clip_to_tiles(p.mean_y - S(0.5), radius, S(15), camera.height, b.y0, b.y1);
}

/// Computes the pixels that a footprint may cover. Returns false if there are none.
template <class T>
GSNAV_HD bool splat_bounds(const ProjectionCamera<T>& camera, const Projected<T>& p,
                           SplatBounds& b) noexcept {
  const PixelBox<T> box = pixel_box(camera, p);
  b = {static_cast<std::int32_t>(box.x0), static_cast<std::int32_t>(box.y0),
       static_cast<std::int32_t>(box.x1), static_cast<std::int32_t>(box.y1)};
  if (camera.compat != Compat::none) narrow_to_compat(camera, p, b);
  return b.x0 < b.x1 && b.y0 < b.y1;
}

}  // namespace detail

/// Record that blending reads.
template <class L>
GSNAV_HD SplatGeometry<L> splat_geometry(const Projected<L>& p, const ReferencePixel<L>& ref) noexcept {
  return {ref.x, ref.y, p.a, p.k, p.b, p.a * ref.dx, fma(p.k, ref.dx, p.b * ref.dy), p.log2_opacity};
}

/// Record of a response that is not linearised.
template <class L>
GSNAV_HD SplatPerspective<L> splat_perspective(const Projected<L>& p,
                                               const ReferencePixel<L>& ref) noexcept {
  return {fma(p.slope_x, ref.dx, fma(p.slope_y, ref.dy, L(scalar_of<L>(1)))), p.slope_x, p.slope_y,
          p.bend};
}

/// Records of a projected Gaussian before they are written.
template <class S>
struct Splat {
  SplatBounds bounds;
  SplatGeometry<S> geometry;
  SplatDepth<S> depth;              ///< if depth is requested
  SplatPerspective<S> perspective;  ///< unless Response::ewa
};

/// Makes the records of a projected row, rounded to S. The row was projected in T and its mean in U.
/// Returns false if no pixel centre lies in its bounds.
/// @tparam GeometryOnly neither depth nor perspective is requested
template <bool GeometryOnly, class T, class U, class S>
GSNAV_HD bool make_splat(const ProjectionCamera<T>& camera, bool depth, const ProjectedRow<T>& projected,
                         U mean_x, U mean_y, Splat<S>& out) noexcept {
  if (!detail::splat_bounds(camera, projected.splat, out.bounds)) return false;
  const ReferencePixel<T> ref = reference_of<T>(camera.width, camera.height, mean_x, mean_y);
  out.geometry = record_cast<S>(splat_geometry(projected.splat, ref));
  if constexpr (!GeometryOnly) {
    if (camera.response != Response::ewa)
      out.perspective = record_cast<S>(splat_perspective(projected.splat, ref));
    if (depth) out.depth = record_cast<S>(make_splat_depth(camera, projected.axes, projected.splat));
  }
  return true;
}

/// Makes the records of a row for which float is precise enough. Only its mean is computed in double.
template <bool GeometryOnly>
GSNAV_HD bool make_splat(const ProjectionCamera<float>& camera, const ProjectionCamera<double>& camera64,
                         bool depth, const RowKey<float>& key, const ProjectedRow<float>& projected,
                         Splat<float>& out) noexcept {
  const PinholePoint<double> mean = detail::project_mean(camera64, key.delta64);
  return make_splat<GeometryOnly>(camera, depth, projected, mean.x, mean.y, out);
}

/// Makes the records of a row computed in double, for the float64 reference and for rows that need it
/// (needs_double).
template <class S, class Row>
GSNAV_HD bool make_splat64(const ProjectionCamera<double>& camera, bool depth, const Row& row,
                           const RowKey<float>& key, Splat<S>& out) noexcept {
  const ProjectedRow<double> projected(camera, row, key);
  return make_splat<false>(camera, depth, projected, projected.splat.mean_x, projected.splat.mean_y,
                           out);
}

}  // namespace gsnav
