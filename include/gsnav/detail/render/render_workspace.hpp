// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
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
  explicit RenderWorkspace(B& b)
      : offsets(b),
        geometry(b),
        colors(b),
        depths(b),
        perspectives(b),
        bounds(b),
        visible(b),
        cursors(b),
        tile_offsets(b),
        tile_splats(b),
        spans(b),
        open(b),
        states(b),
        mesh(b),
        fragments(b),
        composite(b) {}

  Buffer<Vec3d, B> offsets;
  Buffer<SplatGeometry<S>, B> geometry;
  Buffer<SplatColor<S>, B> colors;
  Buffer<SplatDepth<S>, B> depths;
  Buffer<SplatPerspective<S>, B> perspectives;
  Buffer<SplatBounds, B> bounds;
  VisibleOrder<B> visible;
  Buffer<std::uint64_t, B> cursors, tile_offsets;
  Buffer<std::uint32_t, B> tile_splats;
  Buffer<TileSpans, B> spans;
  Buffer<std::uint64_t, B> open;  ///< of frames in slices: open cells of each tile; `states` has the
                                  ///< state of each pixel
  Buffer<S, B> states;
  DepthSlices slices;
  MeshWorkspace<S, B> mesh;
  FragmentWorkspace<S, B> fragments;
  Buffer<S, B> composite;  ///< of Composite::hard_depth: alpha and depth of the Gaussians alone
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
