// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/core/view.hpp"

// Images of meshes as the blending of Gaussians reads them.

namespace gsnav {

/// A surface that is seen through, at one pixel.
template <class S>
struct MeshFragment {
  S depth, alpha;  ///< planar z, metres; alpha in (0, 1]
  S r, g, b;       ///< display-referred, or linear where the frame is blended so; not times alpha
};

/// The fragments of a pixel, nearest first.
struct FragmentRange {
  std::uint64_t begin = 0;
  std::uint32_t count = 0;
};

/// What a mesh leaves of a frame for the Gaussians: planes [H][W] in a backend's memory.
template <class S>
struct MeshLayer {
  const S* depth =
      nullptr;  ///< planar z, metres; infinity where there is no mesh. Null: the frame has none
  const S* color = nullptr;                 ///< [H][W][3] display-referred; null: no colour asked for
  View<const S> tile_far;                   ///< [tiles], the largest depth of each
  View<const FragmentRange> ranges{};       ///< [H][W]; empty: nothing is seen through
  View<const MeshFragment<S>> fragments{};  ///< none behind `depth`

  GSNAV_HD bool empty() const noexcept { return depth == nullptr; }
};

}  // namespace gsnav
