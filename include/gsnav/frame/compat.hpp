// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace gsnav {

/// Another renderer whose rules of footprint, stop and depth a frame follows. Everything but `none` is
/// for parity tests (docs/reference/image_contract.md, "Compat modes").
enum class Compat : std::uint8_t {
  none,    ///< the contract
  inria,   ///< 3-sigma square of 16-pixel tiles, exclusive stop, depth of the centre
  gsplat,  ///< box of min(3.33, sqrt(2 ln 255 o)) sigma in tiles, exclusive stop, depth of the centre
  habitat_gs,  ///< inria with opacity compensation of at least 0.005 for every set, near plane 0.2
};

}  // namespace gsnav
