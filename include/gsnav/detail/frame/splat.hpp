// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// A projected Gaussian in the form in which blending reads it. With d = pixel centre - reference pixel,
/// the whitened offset from the mean is w = (a dx + w1, k dx + b dy + w2), and alpha = 2^(log2_opacity -
/// |w|^2). (a, k, b) is the Cholesky factor of the inverse 2D covariance, times sqrt(log2(e) / 2). The
/// exponent can therefore never exceed log2_opacity.
///
/// The reference pixel is the pixel that contains the mean, or the image's nearest one. d is then exact.
/// The precision lost for a mean far outside the image is lost only once, in w1 and w2
/// (detail/frame/project_row.hpp).
template <class S>
struct SplatGeometry {
  S ref_x{}, ref_y{};  ///< centre of the reference pixel (an integer + 0.5)
  S a{}, k{}, b{};     ///< whitened triple: the Cholesky factor
  S w1{}, w2{};        ///< whitened offset of the reference pixel from the mean
  S log2_opacity{};    ///< log2 of the opacity after the filter's compensation
};

/// log2 of an opacity. The smallest normal float keeps it defined for 0.
template <class L>
GSNAV_HD L log2_of_opacity(L opacity) noexcept {
  return log2(max(opacity, L(scalar_of<L>(1.2e-38))));
}
/// log2 of an opacity over the smallest alpha: |w|^2 at the edge of the footprint, negative if there is
/// none. Both arguments are log2.
template <class L>
GSNAV_HD L opacity_excess(L log2_opacity, scalar_of<L> log2_alpha_min) noexcept {
  return log2_opacity - L(log2_alpha_min);
}

/// Colour of a projected Gaussian, >= 0. In the set's color space until ConvertSplatColors converts it
/// to the space of the frame.
template <class S>
struct SplatColor {
  S r{}, g{}, b{}, pad{};
};

/// Record for per-ray depth (detail/frame/depth.hpp). g holds the products of the cofactor columns of
/// the camera-space axes with the ray through the mean. gx and gy are their changes per pixel in x and
/// y.
template <class S>
struct SplatDepth {
  S mean_x{}, mean_y{};  ///< pixels
  S z{};                 ///< depth of the centre, metres
  S reach{};             ///< largest |z - centre z|, metres: k sigma_z of the contract
  S g[3]{}, gx[3]{}, gy[3]{};
};

/// Record that converts the linearised response of a Gaussian to its response along each ray
/// (every Response but ewa). (dx, dy) is the pixel's distance from the reference point of the splat, w
/// the whitened offset whose |w|^2 is the linearised exponent (both: SplatGeometry). With f = f0 + fx dx
/// + fy dy, the exponent becomes |w|^2 / (f^2 + c |w|^2), where c is a number of the Gaussian. A pixel
/// with f <= 0 is behind the camera and has no response.
template <class S>
struct SplatPerspective {
  S f0{}, fx{}, fy{}, c{};
};

/// Converts a record to another scalar, rounding each value.
template <class S, class T>
GSNAV_HD SplatGeometry<S> record_cast(const SplatGeometry<T>& g) noexcept {
  return {static_cast<S>(g.ref_x), static_cast<S>(g.ref_y),       static_cast<S>(g.a),
          static_cast<S>(g.k),     static_cast<S>(g.b),           static_cast<S>(g.w1),
          static_cast<S>(g.w2),    static_cast<S>(g.log2_opacity)};
}
template <class S, class T>
GSNAV_HD SplatPerspective<S> record_cast(const SplatPerspective<T>& p) noexcept {
  return {static_cast<S>(p.f0), static_cast<S>(p.fx), static_cast<S>(p.fy), static_cast<S>(p.c)};
}
template <class S, class T>
GSNAV_HD SplatDepth<S> record_cast(const SplatDepth<T>& d) noexcept {
  SplatDepth<S> out{static_cast<S>(d.mean_x), static_cast<S>(d.mean_y), static_cast<S>(d.z),
                    static_cast<S>(d.reach)};
  for (int i = 0; i < 3; ++i) {
    out.g[i] = static_cast<S>(d.g[i]);
    out.gx[i] = static_cast<S>(d.gx[i]);
    out.gy[i] = static_cast<S>(d.gy[i]);
  }
  return out;
}

/// Half-open rectangle of pixels [x0, x1) x [y0, y1) that contains a footprint, clipped to the image.
struct SplatBounds {
  std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// SplatBounds as integers in floating point, for one splat or a pack of splats.
template <class L>
struct PixelBox {
  L x0{}, y0{}, x1{}, y1{};

  GSNAV_HD static PixelBox of(const SplatBounds& b) noexcept {
    using S = scalar_of<L>;
    return {L(S(b.x0)), L(S(b.y0)), L(S(b.x1)), L(S(b.y1))};
  }
  GSNAV_HD mask_of<L> any_pixel() const noexcept { return (x0 < x1) && (y0 < y1); }
};

}  // namespace gsnav
