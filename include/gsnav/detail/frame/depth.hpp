// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Depth along a pixel's ray at which a Gaussian's response is greatest, in metres. Clamped to the depth
/// of the centre +- reach.
///
/// Let M be the camera-space axes (columns m_i), c_i = m_j x m_k their cofactor columns, and m the mean.
/// Along the ray t r with r = (u, v, 1), the response has its maximum at t = sum (c_i.r)(c_i.m) / sum
/// (c_i.r)^2. Nothing is inverted, so flat Gaussians (s = 0) give the depth of their plane.
///
/// It is evaluated as z + delta, relative to the ray through the mean. delta = -z sum h_i p_i / sum
/// h_i^2, where p_i is the change of c_i.r from that ray to the pixel's ray, and h_i = g_i + p_i.
/// Rounding is then relative to delta and not to z.
/// @param px, py pixel centre
template <class L, class S>
GSNAV_HD L ray_depth(const SplatDepth<S>& d, L px, L py) noexcept {
  const L dx = px - L(d.mean_x), dy = py - L(d.mean_y);
  L numerator(S(0)), denominator(S(0));
  for (int i = 0; i < 3; ++i) {
    const L p = fma(L(d.gx[i]), dx, L(d.gy[i]) * dy);
    const L h = p + L(d.g[i]);
    numerator = fma(h, p, numerator);
    denominator = fma(h, h, denominator);
  }
  const L reach(d.reach);
  const L delta = (L(-d.z) * numerator) / denominator;
  // For an edge-on disk the response along the ray is undefined (0/0). Use the depth of its centre.
  const L defined = select(denominator > L(S(0)), delta, L(S(0)));
  return L(d.z) + clamp(defined, -reach, reach);
}

/// Upper bound of ray_depth of a splat, in metres, rounding included.
template <class S>
GSNAV_HD S farthest_depth(const SplatDepth<S>& d) noexcept {
  return d.z + d.reach;
}

/// True if a splat lies behind `depth` (metres) at every pixel.
template <class S>
GSNAV_HD bool behind(const SplatDepth<S>& d, S depth) noexcept {
  return d.z - d.reach > depth;
}

/// True where a depth along the pixel's ray lies behind `surface`, metres.
template <class L>
GSNAV_HD mask_of<L> behind(const L& depth, const L& surface) noexcept {
  return depth > surface;
}

/// True if a splat with this farthest_depth may lie behind `depth` at some pixel. If false, it is in
/// front at all pixels.
template <class L>
GSNAV_HD mask_of<L> may_reach_behind(const L& farthest, const L& depth) noexcept {
  return farthest > depth;
}

}  // namespace gsnav
