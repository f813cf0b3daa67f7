// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/mesh/mesh_fragments.hpp"
#include "gsnav/detail/render/draw_meshes.hpp"
#include "gsnav/detail/render/scratch_memory.hpp"

namespace gsnav {

/// Scratch memory of `draw_fragments`. It grows to the largest frame, and is empty while there are no
/// see-through surfaces.
template <class S, Backend B>
struct FragmentWorkspace : ScratchMemory<FragmentWorkspace<S, B>> {
  explicit FragmentWorkspace(B& b) : mesh(b), ranges(b), tile_begin(b), fragments(b) {}

  MeshWorkspace<S, B> mesh;  ///< workspace for the triangles of see-through surfaces
  Buffer<FragmentRange, B> ranges;
  Buffer<std::uint64_t, B> tile_begin;
  Buffer<MeshFragment<S>, B> fragments;

  template <class A, class C, class F>
  static void for_each(A& a, C& b, const F& f) {
    f(a.mesh, b.mesh), f(a.ranges, b.ranges), f(a.tile_begin, b.tile_begin), f(a.fragments, b.fragments);
  }
};

/// True if some mesh is see-through.
inline bool any_seen_through(std::span<const MeshInstance> meshes) noexcept {
  return std::any_of(meshes.begin(), meshes.end(), detail::seen_through);
}

/// Lists the see-through surfaces (MeshAlpha::blend) at each pixel, near to far, up to the opaque depth.
/// Stores the lists in `layer`, where they are valid until the next call. Adds to `stats`.
///
/// @param meshes the instances that were given to draw_meshes, which has validated them
/// @param color whether to compute colours, lit as in draw_meshes
/// @param linear whether colours are in linear light
/// @param behind [H][W], depth of the opaque meshes
/// @return unsupported for 2^32 triangles or more; backend_failure. The workspace throws gsnav::Error
///   (out_of_memory).
template <class S, Backend B>
Status draw_fragments(B& backend, FragmentWorkspace<S, B>& ws, std::span<const MeshInstance> meshes,
                      const Camera& camera, const MeshLight& light, int tile_size, bool color,
                      bool linear, const S* behind, MeshLayer<S>& layer, MeshStats& stats) {
  if (Status s = detail::set_up_meshes(backend, ws.mesh, meshes, camera, true, stats); !s) return s;
  if (ws.mesh.triangles.size() == 0) return {};
  FragmentArgs<S> args;
  args.raster = detail::raster_args(ws.mesh, camera, tile_size);
  if (Status s = detail::bin_meshes(backend, ws.mesh, args.raster); !s) return s;
  const std::size_t tiles = args.raster.bin.grid.count();
  ws.ranges.resize_discard(static_cast<std::size_t>(camera.width) *
                           static_cast<std::size_t>(camera.height));
  ws.tile_begin.resize_discard(tiles + 1);
  args.shade = detail::shade_args(ws.mesh, camera, light);
  args.behind = behind;
  args.color = color;
  args.linear = linear;
  args.ranges = ws.ranges.view();
  args.tile_begin = ws.tile_begin.view();
  backend.parallel_for(tiles, CountFragments<S>{args});
  backend.parallel_for(1, ScanFragments<S>{args});
  std::uint64_t count = 0;
  ws.tile_begin.download(&count, 1, tiles);
  if (Status s = backend.synchronize(); !s) return s;
  stats.fragments += count;
  if (count == 0) return {};
  ws.fragments.resize_discard(count);
  args.fragments = ws.fragments.view();
  backend.parallel_for(tiles, FillFragments<S>{args});
  layer.ranges = std::as_const(ws.ranges).view();
  layer.fragments = std::as_const(ws.fragments).view();
  return {};
}

}  // namespace gsnav
