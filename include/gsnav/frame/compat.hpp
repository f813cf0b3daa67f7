// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace gsnav {

/// Renderer whose rules for footprint, early stop and depth a frame follows. All values but `none` are
/// for parity tests (docs/reference/image_contract.md, "Compat modes"). "Exclusive stop" means that the
/// Gaussian that closes a pixel is not blended.
enum class Compat : std::uint8_t {
  none,    ///< gsnav's own rules: the image contract
  inria,   ///< Footprint: square of 3 standard deviations, extended to 16-pixel tiles. Exclusive stop,
           ///< depth of the centre.
  gsplat,  ///< Footprint: box of min(3.33, sqrt(2 ln(255 opacity))) standard deviations, extended to
           ///< 16-pixel tiles. Exclusive stop, depth of the centre.
  habitat_gs,  ///< As inria, with opacity compensation of at least 0.005 for every set and near plane
               ///< 0.2.
};

}  // namespace gsnav
