// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// A projected Gaussian as blending reads it. With d = pixel centre - mean2d, the whitened offset is
/// w = (a dx, k dx + b dy) and alpha = 2^(log2_opacity - |w|^2): the Cholesky factor of the inverse 2D
/// covariance with sqrt(log2(e) / 2) folded in, so that the exponent cannot become positive.
template <class S>
struct SplatGeometry {
  S mean_x{}, mean_y{};  ///< pixels
  S a{}, k{}, b{};       ///< whitened (Cholesky) triple
  S s_max{};             ///< footprint: the pixels with |w|^2 <= s_max, where alpha >= 1/255
  S log2_opacity{};      ///< log2 of the opacity after the filter's compensation
  S z{};                 ///< depth of the centre, metres
};

/// Colour of a projected Gaussian, display-referred, >= 0.
template <class S>
struct SplatColor {
  S r{}, g{}, b{}, pad{};
};

/// What per-ray depth needs (kernels/depth.hpp): cofactor columns of the camera-space axes against the
/// ray through the mean (g) and its change per pixel in x and y.
template <class S>
struct SplatDepth {
  S g[3]{}, gx[3]{}, gy[3]{};
  S reach{};  ///< largest |z - centre z|, metres: k sigma_z of the contract
  S pad[2]{};
};

/// Half-open pixel rectangle [x0, x1) x [y0, y1) that contains a footprint, clipped to the image.
struct SplatBounds {
  std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

}  // namespace gsnav
