// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <type_traits>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/frame/depth.hpp"
#include "gsnav/detail/frame/output.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/image/mesh_layer.hpp"
#include "gsnav/frame/rules.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Alpha above which Habitat-GS has a depth, and draws Gaussians over a mesh.
inline constexpr double kHabitatReturnAlpha = 0.01;

/// Constants of blending, in the scalar of the kernel.
template <class S>
struct BlendRules {
  S max_alpha{S(kMaxAlpha)};
  S transmittance_min{S(kTransmittanceMin)};  ///< A pixel is closed by the Gaussian that makes its
                                              ///< transmittance less than this.
  S first_hit_tau{S(kFirstHitTau)};
  S log2_alpha_min{S(kLog2AlphaMin)};  ///< log2 of the smallest alpha that is blended
  S return_alpha{S(0)};                ///< Expected depth is 0 (no return) unless alpha exceeds this.
  bool exclusive_stop = false;         ///< The Gaussian that closes a pixel is not blended (Compat).
  bool normalize_closed =
      false;  ///< A closed pixel counts as opaque: its sums are divided by its alpha.
};

/// Transmittance of a pixel, or of a pack of pixels, before and after a splat or surface. `weight` is
/// its weight in the sums: before - after if it is blended, else 0.
template <class L>
struct TransmittanceStep {
  L before, after, weight;
};

/// True if transmittance falls from above `level` to `level` or less. This decides median and first-hit
/// depth.
template <class L>
GSNAV_HD mask_of<L> falls_through(L before, L after, scalar_of<L> level) noexcept {
  return (before > L(level)) && (after <= L(level));
}

/// Transmittance at whose crossing the median depth is taken.
template <class S>
inline constexpr S kMedianLevel = S(0.5);

/// Depths of one pixel, or of a pack of pixels, for a DepthMode. `accumulate` adds a contribution at
/// depth z(), in metres. z is called only if it is needed; if the weight is 0, it may return any finite
/// number.
template <class L, DepthMode D>
struct DepthState {
  template <class Z>
  GSNAV_HD void accumulate(const TransmittanceStep<L>&, scalar_of<L>, const Z&) noexcept {}
};
template <class L>
struct DepthState<L, DepthMode::median> {
  L median{scalar_of<L>(0)};

  template <class Z>
  GSNAV_HD void accumulate(const TransmittanceStep<L>& step, scalar_of<L>, const Z& z) noexcept {
    const auto crosses = falls_through(step.before, step.after, kMedianLevel<scalar_of<L>>);
    if (any(crosses)) median = select(crosses, z(), median);
  }
};
template <class L>
struct DepthState<L, DepthMode::all> {
  L median{scalar_of<L>(0)};
  /// Sum of w (z - z_ref), where z_ref is the first blended depth. The difference keeps precision for
  /// distant walls.
  L accumulated{scalar_of<L>(0)}, z_ref{scalar_of<L>(0)};
  L first_hit{scalar_of<L>(0)};

  template <class Z>
  GSNAV_HD void accumulate(const TransmittanceStep<L>& step, scalar_of<L> first_hit_tau,
                           const Z& z_of) noexcept {
    using S = scalar_of<L>;
    const L z = z_of();
    median = select(falls_through(step.before, step.after, kMedianLevel<S>), z, median);
    z_ref = select((step.before >= L(S(1))) && (step.weight > L(S(0))), z, z_ref);
    accumulated = fma(step.weight, z - z_ref, accumulated);
    first_hit = select(falls_through(step.before, step.after, S(1) - first_hit_tau), z, first_hit);
  }
};

/// Index of the splat that determines the median depth, for loops that compute only one depth per pixel.
/// It is the last splat met while transmittance is above kMedianLevel. It is valid only if transmittance
/// falls through that level.
template <class L, class Id>
GSNAV_HD Id last_above_half(L before, Id met, Id last) noexcept {
  return select(before > L(kMedianLevel<scalar_of<L>>), met, last);
}

/// Transmittance and accumulated colour of one pixel, or of a pack of pixels.
template <class L>
struct BlendColor {
  L transmittance{scalar_of<L>(1)};
  L r{scalar_of<L>(0)}, g{scalar_of<L>(0)}, b{scalar_of<L>(0)};

  /// True until a Gaussian has closed the pixel.
  template <class S>
  GSNAV_HD mask_of<L> open(const BlendRules<S>& rules) const noexcept {
    return transmittance >= L(rules.transmittance_min);
  }
};

/// Blending state of one pixel, or of a pack of pixels, front to back.
template <class L, DepthMode D>
struct BlendState : BlendColor<L>, DepthState<L, D> {
  /// Adds a contribution with colour color() at depth z(). Each callable is called only if it is needed.
  template <bool Color, class C, class Z>
  GSNAV_HD void accumulate(const TransmittanceStep<L>& step, scalar_of<L> first_hit_tau, const C& color,
                           const Z& z) noexcept {
    if constexpr (Color) {
      const Vec3<L> c = color();
      this->r = fma(step.weight, c.x, this->r);
      this->g = fma(step.weight, c.y, this->g);
      this->b = fma(step.weight, c.z, this->b);
    }
    DepthState<L, D>::accumulate(step, first_hit_tau, z);
  }
};

/// Records of one splat that blending may read. Null if no requested output needs them.
template <class S>
struct SplatRecords {
  const SplatGeometry<S>* geometry;
  const SplatColor<S>* color;
  const SplatDepth<S>* depth;
  const SplatPerspective<S>* perspective;
};

/// Terms of log2 alpha that are constant in one column of pixels. At pixel centre py, log2 alpha =
/// column - (b (py - ref_y) + w2)^2, with b and ref_y of SplatGeometry.
template <class L>
struct ColumnTerms {
  L column, w2;
};

/// Whitened offset (w1, w2) of a pixel centre from the mean, with dx = px - ref_x.
template <class L, class S>
GSNAV_HD L whitened_1(const SplatGeometry<S>& g, const L& dx) noexcept {
  return fma(dx, L(g.a), L(g.w1));
}
/// w2 in the row of the reference pixel. `whitened_2` gives it for any row, with dy = py - ref_y.
template <class L, class S>
GSNAV_HD L whitened_2(const SplatGeometry<S>& g, const L& dx) noexcept {
  return fma(dx, L(g.k), L(g.w2));
}
template <class L>
GSNAV_HD L whitened_2(const L& in_reference_row, const L& dy, const L& b) noexcept {
  return fma(dy, b, in_reference_row);
}

template <class L, class S>
GSNAV_HD ColumnTerms<L> column_terms(const SplatGeometry<S>& g, L px) noexcept {
  const L dx = px - L(g.ref_x);
  const L w1 = whitened_1(g, dx);
  return {fma(-w1, w1, L(g.log2_opacity)), whitened_2(g, dx)};
}

/// log2 alpha at the pixel centre `py` of a column. Never greater than log2 of the opacity.
template <class L>
GSNAV_HD L column_exponent(const ColumnTerms<L>& terms, L ref_y, L b, L py) noexcept {
  const L w2 = whitened_2(terms.w2, py - ref_y, b);
  return fma(-w2, w2, terms.column);
}

/// log2 alpha where nothing is drawn: far below BlendRules::log2_alpha_min, and finite.
template <class S>
inline constexpr S kNothingDrawn = S(-1e30);

/// log2 alpha for responses that are not linearised (Response). Behind the camera it is far below any
/// that is drawn.
template <class L, class S>
GSNAV_HD L perspective_exponent(const SplatGeometry<S>& g, const SplatPerspective<S>& v, L px,
                                L py) noexcept {
  const L dx = px - L(g.ref_x), dy = py - L(g.ref_y);
  const L w1 = whitened_1(g, dx), w2 = whitened_2(whitened_2(g, dx), dy, L(g.b));
  const L s = fma(w2, w2, w1 * w1);
  const L f = fma(dx, L(v.fx), fma(dy, L(v.fy), L(v.f0)));
  const L exponent = L(g.log2_opacity) - s / fma(f, f, L(v.c) * s);
  return select(f > L(S(0)), exponent, L(kNothingDrawn<S>));
}

/// log2 alpha of a splat at pixel centres. If `along_rays`, of the response along each ray, with
/// `perspective`; else of the splat's ellipse.
template <class L, class S>
GSNAV_HD L splat_exponent(bool along_rays, const SplatGeometry<S>& g,
                          const SplatPerspective<S>* perspective, L px, L py) noexcept {
  if (along_rays) return perspective_exponent(g, *perspective, px, py);
  return column_exponent(column_terms(g, px), L(g.ref_y), L(g.b), py);
}

/// True for pixels in the footprint: alpha >= 2^log2_alpha_min. The comparison uses the exponent, so the
/// result does not depend on tiles and alpha is positive wherever it is drawn.
template <class L, class S>
GSNAV_HD mask_of<L> in_footprint(const BlendRules<S>& rules, L exponent) noexcept {
  return exponent >= L(rules.log2_alpha_min);
}

/// Alpha in the footprint, from log2 alpha. Outside the footprint it may be any value, also NaN.
template <Exp2 M, class L, class S>
GSNAV_HD L alpha_in_footprint(const BlendRules<S>& rules, L exponent) noexcept {
  const L alpha = exp2_in_range<M>(exponent), largest(rules.max_alpha);
#if GSNAV_DEVICE_CODE
  // The hardware's minimum instruction. gsnav's `min` defines the result for NaN, which costs a
  // comparison and a selection.
  if constexpr (std::is_same_v<L, float>) {
    return ::fminf(alpha, largest);
  } else
#endif
  {
    return min(alpha, largest);
  }
}

/// Alpha of a splat at a pixel, from log2 alpha (`exponent`). 0 outside the footprint.
template <Exp2 M, class L, class S>
GSNAV_HD L footprint_alpha(const BlendRules<S>& rules, L exponent) noexcept {
  return select(in_footprint(rules, exponent), alpha_in_footprint<M>(rules, exponent), L(S(0)));
}

/// Blends one splat with `alpha` onto the pixels in `drawn`. These must be open pixels in its footprint.
/// Other pixels keep their state bit for bit. `General` obeys rules.exclusive_stop; a pixel closed that
/// way keeps its transmittance, negated.
/// @param px, py pixel centres
template <bool Color, DepthMode D, bool General, class L, class S>
GSNAV_HD void blend_drawn(BlendState<L, D>& state, const BlendRules<S>& rules, mask_of<L> drawn, L alpha,
                          const SplatColor<S>* color, const SplatDepth<S>* depth, L px, L py) noexcept {
  const L zero(S(0)), before = state.transmittance;
  L weight = select(drawn, alpha * before, zero);
  L after = before - weight;
  state.transmittance = after;
  if constexpr (General) {
    if (rules.exclusive_stop) {
      const auto closes = drawn && (after < L(rules.transmittance_min));
      weight = select(closes, zero, weight);
      after = select(closes, before, after);
      state.transmittance = select(closes, -before, after);
    }
  }
  state.template accumulate<Color>(
      TransmittanceStep<L>{before, after, weight}, rules.first_hit_tau,
      [&]() GSNAV_INLINED {
        return Vec3<L>{L(color->r), L(color->g), L(color->b)};
      },
      [&]() GSNAV_INLINED { return ray_depth(*depth, px, py); });
}

/// Blends one splat onto the open pixels. `alpha` must already be 0 outside its footprint.
template <bool Color, DepthMode D, bool General, class L, class S>
GSNAV_HD void blend_alpha(BlendState<L, D>& state, const BlendRules<S>& rules, L alpha,
                          const SplatColor<S>* color, const SplatDepth<S>* depth, L px, L py) noexcept {
  blend_drawn<Color, D, General>(state, rules, state.open(rules), alpha, color, depth, px, py);
}

/// Default of `visible` in blend_splat(): the whole splat is visible.
struct WholeSplat {
  template <class L>
  GSNAV_HD L operator()(L alpha) const noexcept {
    return alpha;
  }
};

/// Blends one splat onto pixels with centres (px, py).
/// @param visible callable that takes the splat's alpha and returns the part of it that is blended: 0
///   where the splat is hidden
/// @return mask of the open pixels in its footprint
template <bool Color, DepthMode D, Exp2 M, bool General, class L, class S, class Visible = WholeSplat>
GSNAV_HD mask_of<L> blend_splat(BlendState<L, D>& state, const BlendRules<S>& rules,
                                const SplatRecords<S>& splat, L px, L py,
                                const Visible& visible = {}) noexcept {
  const L exponent = splat_exponent(General && splat.perspective != nullptr, *splat.geometry,
                                    splat.perspective, px, py);
  const auto hit = state.open(rules) && in_footprint(rules, exponent);
  // For packs, testing whether all lanes miss costs more than it saves: they rarely do.
  if constexpr (LaneTraits<L>::width == 1) {
    if (!hit) return hit;
  }
  blend_drawn<Color, D, General>(state, rules, hit, visible(alpha_in_footprint<M>(rules, exponent)),
                                 splat.color, splat.depth, px, py);
  return hit;
}

}  // namespace gsnav
