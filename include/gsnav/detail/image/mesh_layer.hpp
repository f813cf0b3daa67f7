// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/math/functions.hpp"

// Images of meshes, in the form in which the blending of Gaussians reads them.

namespace gsnav {

/// True where a depth of a layer is that of a mesh, not infinite.
template <class L>
GSNAV_HD mask_of<L> has_mesh(L depth) noexcept {
  return depth <= L(scalar_of<L>(3.4e38));
}

/// A see-through surface at one pixel.
template <class S>
struct MeshFragment {
  S depth, alpha;  ///< Planar z in metres; alpha in (0, 1].
  S r, g, b;       ///< Colour in the frame's blend space, not multiplied by alpha.
};

/// Fragments of one pixel, nearest first: [begin, begin + count) of MeshLayer::fragments.
struct FragmentRange {
  std::uint64_t begin = 0;
  std::uint32_t count = 0;
};

/// Depth, colour and see-through surfaces of the meshes in a frame. Planes of shape [H][W] in a
/// backend's memory.
template <class S>
struct MeshLayer {
  const S* depth =
      nullptr;  ///< Planar z in metres, infinity where there is no mesh. Null: the frame has no meshes.
  const S* color = nullptr;  ///< [H][W][3] in the frame's blend space. Null: colour is not requested.
  View<const S> tile_far;    ///< [tiles], largest depth of each tile
  View<const FragmentRange> ranges{};       ///< [H][W], fragments of each pixel. Empty: no see-through
                                            ///< surfaces.
  View<const MeshFragment<S>> fragments{};  ///< fragments of all pixels, none behind `depth`

  GSNAV_HD bool empty() const noexcept { return depth == nullptr; }
};

}  // namespace gsnav
