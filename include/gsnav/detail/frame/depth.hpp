// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Depth along a pixel's ray at which a Gaussian responds most, clamped to centre z +- reach.
/// (px, py): pixel centre.
///
/// With camera-space axes M (columns) and cofactor columns c_i = m_j x m_k, the maximum of the response
/// along the ray t r, r = (u, v, 1), is at t = sum (c_i.r)(c_i.m) / sum (c_i.r)^2, m the mean. Nothing
/// is inverted, so flat (s = 0) Gaussians give their plane. Written as z + delta relative to the ray
/// through the mean: delta = -z sum h_i p_i / sum h_i^2 with p_i the change of c_i.r from that ray to
/// the pixel's and h_i = g_i + p_i, so that rounding is relative to delta and not to z.
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
  // An edge-on disk has no response along the ray (0/0): its centre's depth stands.
  const L defined = select(denominator > L(S(0)), delta, L(S(0)));
  return L(d.z) + clamp(defined, -reach, reach);
}

/// No ray_depth of a splat is beyond, metres; also when rounded.
template <class S>
GSNAV_HD S farthest_depth(const SplatDepth<S>& d) noexcept {
  return d.z + d.reach;
}

/// Whether a splat lies behind `depth`, metres, at every pixel.
template <class S>
GSNAV_HD bool behind(const SplatDepth<S>& d, S depth) noexcept {
  return d.z - d.reach > depth;
}

/// Whether a splat of this farthest_depth may lie behind `depth` at some pixel; else it is before it at
/// all.
template <class L>
GSNAV_HD mask_of<L> may_reach_behind(const L& farthest, const L& depth) noexcept {
  return farthest > depth;
}

}  // namespace gsnav
