// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/detail/image/pixel_center.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Range of pixel columns. It starts with the column that contains `first` and ends before `end`, which
/// is an integer.
template <class L>
struct PixelColumns {
  mask_of<L> any;
  L first, end;  ///< valid if `any`
};

/// Ellipse of a splat's footprint, without its size r. With a, b, k of SplatGeometry, and X, Y from the
/// mean, it is (a X)^2 + (k X + b Y)^2 = r^2. Its edges in the row of pixel centres at Y are -s Y
/// +- sqrt((r^2 - (beta Y)^2) / alpha^2), where alpha^2 = a^2 + k^2, s = k b / alpha^2 and beta = a b /
/// alpha.
///
/// @tparam Rough uses sqrt_above and reciprocal_near
template <class L, bool Rough = false>
struct FootprintEllipse {
  L inv_a, inv_b;    ///< 1 / a, 1 / b
  L mean_x, mean_y;  ///< mean, from the reference pixel
  L pulled;          ///< k mean_x, a term of mean_y
  L aa, inv_aa;      ///< alpha^2, 1 / alpha^2
  L slope, beta2;    ///< s, beta^2

  GSNAV_HD explicit FootprintEllipse(const SplatGeometry<L>& g) noexcept
      : inv_a(inverse(g.a)),
        inv_b(inverse(g.b)),
        mean_x(-(g.w1 * inv_a)),
        pulled(g.k * mean_x),
        aa(fma(g.a, g.a, g.k * g.k)),
        inv_aa(inverse(aa)) {
    mean_y = -((pulled + g.w2) * inv_b);
    slope = (g.k * g.b) * inv_aa;
    const L beta = g.a * g.b;
    beta2 = (beta * beta) * inv_aa;
  }

  GSNAV_HD static L root(L a) noexcept {
    if constexpr (Rough) return sqrt_above(a);
    return sqrt(a);
  }
  GSNAV_HD static L inverse(L a) noexcept {
    if constexpr (Rough) return reciprocal_near(a);
    return L(scalar_of<L>(1)) / a;
  }
};

/// Columns that the ellipse of a splat's footprint covers in horizontal strips. Tiles, and blocks of a
/// tile, are listed by it. L is one splat, or a pack with one splat per lane. The result contains all
/// pixels that pass the pixel test in scalar_of<L>, because the ellipse is enlarged by the rounding of
/// both computations.
///
/// The right edge of FootprintEllipse is concave with its maximum at Y* = -k r / (a b). A strip's
/// rightmost point is therefore at Y* clamped to the strip, and its leftmost point at -Y* clamped.
///
/// @tparam Rough uses sqrt_above and reciprocal_near: faster; lengths are up to 0.3 % larger
template <class L, bool Rough = false>
class FootprintStrips {
  using S = scalar_of<L>;

 public:
  /// For strips within the pixels of `box`.
  GSNAV_HD FootprintStrips(const SplatGeometry<L>& g, S log2_alpha_min, const PixelBox<L>& box) noexcept
      : FootprintStrips(g, log2_alpha_min, box.x0 + L(S(0.5)), box.x1 - L(S(0.5)), box.y0 + L(S(0.5)),
                        box.y1 - L(S(0.5))) {}
  /// For strips within the pixel centres [x0, x1] x [y0, y1].
  GSNAV_HD FootprintStrips(const SplatGeometry<L>& g, S log2_alpha_min, L x0, L x1, L y0,
                           L y1) noexcept {
    const L zero(S(0));
    const Ellipse e(g);
    slope_ = e.slope;
    beta2_ = e.beta2;
    inv_alpha_ = root(e.inv_aa);

    // The error of w in the pixel test, and of the centre here, is a few roundings of this size.
    const L far_x = max(abs(x0 - g.ref_x), abs(x1 - g.ref_x));
    const L far_y = max(abs(y0 - g.ref_y), abs(y1 - g.ref_y));
    const L k = abs(g.k);
    const L size = fma(g.a + k, far_x, fma(g.b, far_y, abs(g.w1) + abs(g.w2) + abs(e.pulled)));
    const L edge = root(max(opacity_excess(g.log2_opacity, log2_alpha_min), zero));
    const L r = fma(size, L(S(2e-6)), edge * L(S(1.000002)));
    r2_ = r * r;
    turn_y_ = ((k * r) * e.inv_a) * e.inv_b;
    negative_k_ = g.k < zero;
    if constexpr (Rough) {
      half_height_ = (r * root(e.aa)) * (abs(e.inv_a) * e.inv_b);
    } else {
      half_height_ = r / sqrt(beta2_);
    }
    center_x_ = g.ref_x + e.mean_x;
    center_y_ = g.ref_y + e.mean_y;
    pad_x_ = fma(fma(abs(slope_), far_y + abs(e.mean_y), abs(g.ref_x) + abs(e.mean_x)), L(S(1e-6)),
                 L(S(1e-3)));
    pad_y_ = fma(abs(g.ref_y) + abs(e.mean_y), L(S(1e-6)), L(S(1e-3)));
  }

  /// Range [left, right] of x that the ellipse covers for pixel centres in the rows [y0, y1]. Returns
  /// false (per lane) if it covers none.
  GSNAV_HD mask_of<L> columns(L y0, L y1, L& left, L& right) const noexcept {
    const L low = max(y0 - pad_y_ - center_y_, -half_height_);
    const L high = min(y1 + pad_y_ - center_y_, half_height_);
    const L at_k = clamp(turn_y_, low, high), against_k = clamp(-turn_y_, low, high);
    const L y_right = select(negative_k_, at_k, against_k);
    const L y_left = select(negative_k_, against_k, at_k);
    const L zero(S(0));
    const L reach_right = root(max(fma(-beta2_ * y_right, y_right, r2_), zero));
    const L reach_left = root(max(fma(-beta2_ * y_left, y_left, r2_), zero));
    right = center_x_ + (fma(reach_right, inv_alpha_, pad_x_) - slope_ * y_right);
    left = center_x_ - (fma(reach_left, inv_alpha_, pad_x_) + slope_ * y_left);
    return low <= high;
  }

  /// Pixels of the box that the ellipse may cover in the rows [top, end).
  GSNAV_HD PixelColumns<L> pixels(const PixelBox<L>& box, L top, L end) const noexcept {
    const L half(S(0.5));
    L left, right;
    const auto covered = columns(max(top, box.y0) + half, min(end, box.y1) - half, left, right);
    // The padding of left and right exceeds what rounding to a pixel may lose.
    const L first = clamp(left + half, box.x0, box.x1),
            behind = truncated(clamp(right + half, box.x0, box.x1));
    return {covered && (first < behind), first, behind};
  }

 private:
  using Ellipse = FootprintEllipse<L, Rough>;
  GSNAV_HD static L root(L a) noexcept { return Ellipse::root(a); }

  L center_x_{}, center_y_{}, pad_x_{}, pad_y_{};
  L slope_{}, beta2_{}, inv_alpha_{}, r2_{};
  L half_height_{};
  L turn_y_{};  // |Y*|
  mask_of<L> negative_k_{};
};

/// Columns that the ellipse of a splat's footprint covers in single rows of pixels, from a corner on.
/// The result contains all pixels that pass the pixel test, because the ellipse is enlarged by more than
/// the rounding of both computations.
class FootprintRows {
 public:
  /// @param x,y the corner, pixels
  /// @param far bound of the distance of pixels from the reference pixel, along each image axis
  GSNAV_HD FootprintRows(const SplatGeometry<float>& g, float log2_alpha_min, float x, float y,
                         float far) noexcept {
    const FootprintEllipse<float, true> e(g);
    const float size = fma(g.a + abs(g.k) + g.b, far, abs(g.w1) + abs(g.w2) + abs(e.pulled));
    const float r =
        fma(size, 4e-6f, 1.001f * sqrt_above(max(opacity_excess(g.log2_opacity, log2_alpha_min), 0.0f)));
    r2_ = r * r * e.inv_aa;
    fall_ = e.beta2 * e.inv_aa;
    slope_ = e.slope;
    left_ = g.ref_x + e.mean_x - 0.5f - x;
    down_ = pixel_center<float>(y) - g.ref_y - e.mean_y;
    pad_ = fma(abs(e.mean_x) + abs(e.slope) * (abs(e.mean_y) + far), 4e-6f, 2e-3f);
  }

  /// Range [left, right] of columns that the row covers, counted from the corner. Returns false if it
  /// covers none.
  GSNAV_HD bool columns(float row, float& left, float& right) const noexcept {
    const float y = down_ + row, room = fma(-fall_ * y, y, r2_);
    const float center = fma(-slope_, y, left_), half = sqrt_above(room) + pad_;
    left = center - half;
    right = center + half;
    return room >= 0;
  }

 private:
  float r2_, fall_, slope_, left_, down_, pad_;
};

}  // namespace gsnav
