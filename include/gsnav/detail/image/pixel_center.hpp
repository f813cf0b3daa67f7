// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/config.hpp"

namespace gsnav {

/// Centre of a pixel along an image axis, in pixels (image/camera.hpp).
/// @param pixel column or row, an integer of any type
template <class S, class I>
GSNAV_HD constexpr S pixel_center(I pixel) noexcept {
  return static_cast<S>(pixel) + S(0.5);
}

}  // namespace gsnav
