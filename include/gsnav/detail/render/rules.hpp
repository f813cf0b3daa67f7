// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <iterator>

#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/render/config.hpp"

// Rules of the image that each stage of a frame derives from RenderConfig.

namespace gsnav {

/// Smallest log2(alpha) at which a Gaussian is blended. It is at least -126, the limit of exp2 in float,
/// also in double.
inline double log2_alpha_min(const Quality& q) noexcept {
  return std::max(std::log2(q.alpha_min), -126.0);
}

/// Settings for the projection.
inline ProjectionRules projection_rules(const RenderConfig& c) noexcept {
  return {c.sort_order, c.response, c.compat, log2_alpha_min(c.quality), c.quality.key_bits};
}

inline Exp2 exp2_method(const Quality& q) noexcept {
  return q.exponential == Exponential::fast ? Exp2::degree3 : Exp2::degree5;
}

namespace detail {

/// Changes blending rules to those of another renderer.
template <class S>
void follow(Compat compat, BlendRules<S>& r) noexcept {
  r.exclusive_stop = compat != Compat::none;
  // gsplat stops at T <= T_min where INRIA stops at T < T_min.
  if (compat == Compat::gsplat) r.transmittance_min = std::nextafter(r.transmittance_min, S(1));
  if (compat == Compat::habitat_gs) r.return_alpha = S(kHabitatReturnAlpha);
}

}  // namespace detail

/// Settings for blending, rounded to the scalar of the kernel.
template <class S>
BlendRules<S> blend_rules(const RenderConfig& c) noexcept {
  BlendRules<S> r;
  r.max_alpha = static_cast<S>(c.quality.max_alpha);
  r.transmittance_min = static_cast<S>(c.quality.transmittance_min);
  r.first_hit_tau = static_cast<S>(c.first_hit_tau);
  r.log2_alpha_min = static_cast<S>(log2_alpha_min(c.quality));
  if (c.quality.normalize_closed && c.compat == Compat::none) {
    r.normalize_closed = true;
    // A pixel that counts as opaque has a median and a first hit, so it must not close before it has
    // them.
    r.transmittance_min = std::min({r.transmittance_min, kMedianLevel<S>, S(1) - r.first_hit_tau});
  }
  detail::follow(c.compat, r);
  return r;
}

/// Settings for blending into given images. If neither colour, alpha nor an averaged depth is requested,
/// a pixel is closed as soon as its median and first-hit depths are known. The images keep their bits.
template <class S>
BlendRules<S> blend_rules(const RenderConfig& c, const FrameImages<S>& images) noexcept {
  BlendRules<S> r = blend_rules<S>(c);
  const bool sums =
      std::any_of(std::begin(kImages<S>), std::end(kImages<S>),
                  [&](const ImageKind<S>& k) { return k.sums && images.*k.image != nullptr; });
  if (sums || c.compat != Compat::none) return r;
  S needed(1);
  if (images.median_depth != nullptr) needed = kMedianLevel<S>;
  if (images.first_hit_depth != nullptr) needed = std::min(needed, S(1) - r.first_hit_tau);
  r.transmittance_min = std::max(r.transmittance_min, needed);
  return r;
}

}  // namespace gsnav
