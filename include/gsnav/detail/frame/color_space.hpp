// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// The sRGB-encoded value of a linear one >= 0.
template <class S>
GSNAV_HD S srgb_encoded(S linear) noexcept {
  const S small = S(0.0031308);
  const S curve = S(1.055) * exp2(log2(max(linear, small)) * S(1 / 2.4)) - S(0.055);
  return linear > small ? curve : S(12.92) * max(linear, S(0));
}

/// The linear value of an sRGB-encoded one >= 0.
template <class S>
GSNAV_HD S srgb_decoded(S encoded) noexcept {
  const S small = S(0.04045);
  const S curve = exp2(log2((max(encoded, small) + S(0.055)) * S(1 / 1.055)) * S(2.4));
  return encoded > small ? curve : S(1 / 12.92) * max(encoded, S(0));
}

/// A colour's value in another space.
template <class S>
GSNAV_HD S converted(S value, ColorSpace from, ColorSpace to) noexcept {
  if (from == to) return value;
  return to == ColorSpace::linear ? srgb_decoded(value) : srgb_encoded(value);
}

/// Takes the colours of one set's projected Gaussians to the space that they are blended in, chunk by
/// chunk.
template <class S>
struct ConvertSplatColors {
  View<SplatColor<S>> colors;        ///< Colours of the projected Gaussians, converted in place.
  View<const std::uint32_t> counts;  ///< Number of projected Gaussians per chunk.
  std::size_t first_chunk = 0;       ///< First chunk of the set.
  ColorSpace from{}, to{};           ///< Color space to convert from and to.

  /// Converts chunk c.
  GSNAV_HD void operator()(std::size_t c) const noexcept {
    const std::size_t base = (first_chunk + c) * kProjectChunk;
    for (std::size_t i = base; i < base + counts[first_chunk + c]; ++i) {
      SplatColor<S>& color = colors[i];
      color.r = converted(color.r, from, to);
      color.g = converted(color.g, from, to);
      color.b = converted(color.b, from, to);
    }
  }
};

/// Decodes a display-referred image in place, one value a work item.
template <class S>
struct DecodeImage {
  S* values = nullptr;  ///< First value of the image.
  /// Decodes value i.
  GSNAV_HD void operator()(std::size_t i) const noexcept { values[i] = srgb_decoded(values[i]); }
};

}  // namespace gsnav
