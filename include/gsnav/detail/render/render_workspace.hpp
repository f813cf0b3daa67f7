// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/render/depth_slices.hpp"
#include "gsnav/detail/render/draw_fragments.hpp"
#include "gsnav/detail/render/draw_meshes.hpp"
#include "gsnav/detail/render/order_visible.hpp"
#include "gsnav/detail/render/scratch_memory.hpp"
#include "gsnav/render/frames.hpp"

namespace gsnav {

/// Scratch memory of `render_camera`. It grows to the largest frame and is reused.
template <class S, Backend B>
struct RenderWorkspace : ScratchMemory<RenderWorkspace<S, B>> {
  explicit RenderWorkspace(B& b) : backend(&b) {}

  B* backend;  ///< Owner of the memory.
  Buffer<Vec3d, B> offsets{*backend};
  Buffer<SplatGeometry<S>, B> geometry{*backend};
  Buffer<SplatColor<S>, B> colors{*backend};
  Buffer<SplatDepth<S>, B> depths{*backend};
  Buffer<SplatPerspective<S>, B> perspectives{*backend};
  Buffer<SplatBounds, B> bounds{*backend};
  VisibleOrder<B> visible{*backend};
  Buffer<std::uint64_t, B> cursors{*backend}, tile_offsets{*backend};
  Buffer<std::uint32_t, B> tile_splats{*backend};
  Buffer<TileSpans, B> spans{*backend};
  Buffer<std::uint64_t, B> open{*backend};  ///< of frames in slices: open squares of each tile; `states`
                                            ///< has the state of each pixel
  Buffer<S, B> states{*backend};
  DepthSlices slices;
  /// If not empty: render_frame draws no images, but raises these values of all rows to the largest
  /// share of a pixel that each contributes (WeighArgs). Host backends only, in float, without meshes.
  View<float> weights;
  MeshWorkspace<S, B> mesh{*backend};
  FragmentWorkspace<S, B> fragments{*backend};
  /// Alpha and depth of the Gaussians alone, for Composite::hard_depth.
  Buffer<S, B> composite{*backend};
  std::vector<Vec3d> host_offsets;
  std::vector<ViewedSet<S>> projections;  ///< [sets], one projection per set
  ProjectOutputs<S> projected;            ///< outputs of the projection

  template <class A, class C, class F>
  static void for_each(A& a, C& b, const F& f) {
    f(a.offsets, b.offsets), f(a.geometry, b.geometry), f(a.colors, b.colors);
    f(a.depths, b.depths), f(a.perspectives, b.perspectives), f(a.bounds, b.bounds);
    f(a.cursors, b.cursors), f(a.tile_offsets, b.tile_offsets), f(a.tile_splats, b.tile_splats);
    f(a.spans, b.spans), f(a.host_offsets, b.host_offsets);
    f(a.projections, b.projections), f(a.open, b.open), f(a.states, b.states), f(a.slices, b.slices);
    f(a.mesh, b.mesh), f(a.fragments, b.fragments), f(a.composite, b.composite);
    VisibleOrder<B>::for_each(a.visible, b.visible, f);
  }
};

}  // namespace gsnav
