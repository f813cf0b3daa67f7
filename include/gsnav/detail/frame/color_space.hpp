// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// Converts a colour value from one space to another.
template <class S>
GSNAV_HD S converted(S value, ColorSpace from, ColorSpace to) noexcept {
  if (from == to) return value;
  return to == ColorSpace::linear ? srgb_decoded(value) : srgb_encoded(value);
}

/// Kernel that converts the colours of one chunk of projected Gaussians to the space of blending.
template <class S>
struct ConvertSplatColors {
  View<SplatColor<S>> colors;        ///< [slots], colours of all sets
  View<const std::uint32_t> counts;  ///< [chunks], number of splats per chunk
  std::size_t first_chunk = 0;       ///< index of the first chunk of the set among those of all sets
  ColorSpace from{},                 ///< space of the set
      to{};                          ///< space of the frame

  /// Converts the colours of chunk c of the set.
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

/// Kernel that decodes one value of an sRGB-encoded image in place.
template <class S>
struct DecodeImage {
  S* values = nullptr;  ///< image, in sRGB encoding
  /// Decodes value i.
  GSNAV_HD void operator()(std::size_t i) const noexcept { values[i] = srgb_decoded(values[i]); }
};

}  // namespace gsnav
