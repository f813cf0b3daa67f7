// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/detail/image/validate_camera.hpp"
#include "gsnav/detail/mesh/mesh_shade.hpp"
#include "gsnav/detail/render/scratch_memory.hpp"
#include "gsnav/detail/render/tuning.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/render/frames.hpp"

namespace gsnav {

/// Scratch memory of `draw_meshes`. It grows to the largest frame, and is empty while there are no
/// meshes.
template <class S, Backend B>
struct MeshWorkspace : ScratchMemory<MeshWorkspace<S, B>> {
  explicit MeshWorkspace(B& b) : backend(&b) {}

  B* backend;  ///< Owner of the memory.
  Buffer<MeshPlacement, B> placements{*backend};
  Buffer<MeshChunk, B> vertex_chunks{*backend}, triangle_chunks{*backend};
  Buffer<MeshVertex, B> vertices{*backend};
  Buffer<std::uint32_t, B> counts{*backend}, not_finite{*backend};
  Buffer<std::uint64_t, B> offsets{*backend};
  Buffer<MeshTriangle<S>, B> triangles{*backend};
  Buffer<std::uint64_t, B> cursors{*backend}, tile_offsets{*backend};
  Buffer<std::uint32_t, B> tile_triangles{*backend};
  Buffer<S, B> depth{*backend};                ///< [H][W], depth of the last frame
  Buffer<std::uint32_t, B> visible{*backend};  ///< [H][W], index of the visible triangle
  Buffer<S, B> tile_far{*backend};
  Buffer<S, B> color{*backend};  ///< [H][W][3], if draw_meshes was called with layer_color
  std::vector<MeshPlacement> host_placements;
  std::vector<MeshChunk> host_vertex_chunks, host_triangle_chunks;
  std::vector<std::uint32_t> host_not_finite;
  std::vector<std::uint32_t> unhidden;  ///< chunks of Gaussians that no mesh hides

  template <class A, class C, class F>
  static void for_each(A& a, C& b, const F& f) {
    f(a.placements, b.placements), f(a.vertex_chunks, b.vertex_chunks);
    f(a.triangle_chunks, b.triangle_chunks), f(a.vertices, b.vertices), f(a.counts, b.counts);
    f(a.not_finite, b.not_finite), f(a.offsets, b.offsets), f(a.triangles, b.triangles);
    f(a.cursors, b.cursors), f(a.tile_offsets, b.tile_offsets), f(a.tile_triangles, b.tile_triangles);
    f(a.depth, b.depth), f(a.visible, b.visible), f(a.tile_far, b.tile_far), f(a.color, b.color);
    f(a.host_placements, b.host_placements);
    f(a.host_vertex_chunks, b.host_vertex_chunks), f(a.host_triangle_chunks, b.host_triangle_chunks);
    f(a.host_not_finite, b.host_not_finite), f(a.unhidden, b.unhidden);
  }
};

/// Checks an instance against the assumptions of kernels, except the values of its indices.
/// @return invalid_argument naming the field.
inline Status validate(const MeshInstance& instance) {
  const MeshView& m = instance.mesh;
  const BadArgument bad{"MeshInstance: "};
  const auto sized = [&](std::size_t n, const char* name) {
    if (n == 0 || n == m.vertices.size) return Status();
    return bad(std::string(name) + " has " + std::to_string(n) + " values where " +
               std::to_string(m.vertices.size) + " are needed, or none");
  };
  if (m.indices.size % 3 != 0)
    return bad("indices has " + std::to_string(m.indices.size) + " values: it needs three per triangle");
  if (m.vertices.size > std::numeric_limits<std::uint32_t>::max() ||
      m.triangle_count() > std::numeric_limits<std::uint32_t>::max()) {
    return bad("more than 2^32 vertices or triangles");
  }
  if (Status s = sized(m.normals.size, "normals"); !s) return s;
  if (Status s = sized(m.colors.size, "colors"); !s) return s;
  if (Status s = sized(m.uvs.size, "uvs"); !s) return s;
  if (Status s = sized(m.alphas.size, "alphas"); !s) return s;
  if (!(m.base_alpha >= 0 && m.base_alpha <= 1)) {
    return bad("base_alpha = " + std::to_string(m.base_alpha) + ": must be in [0, 1]");
  }
  if (!m.texture.empty()) {
    const TextureView& t = m.texture;
    std::size_t texels = 0;
    for (int l = 0, w = t.width, h = t.height; l < t.levels && w > 0 && h > 0; ++l) {
      texels += static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
      w = std::max(w / 2, 1);
      h = std::max(h / 2, 1);
    }
    if (t.width < 1 || t.height < 1 || t.levels < 1 || t.texels.size != 4 * texels ||
        t.decode.size != 256) {
      return bad("texture: sizes do not fit its texels");
    }
  }
  if (!is_valid(instance.world_from_mesh)) {
    return bad("world_from_mesh must have a unit quaternion, a positive scale and be finite");
  }
  return {};
}

namespace detail {

/// True if a mesh's box may be in the image. Conservative: never false if some of the box is.
inline bool box_may_be_visible(const MeshCamera& camera, const MeshPlacement& p) noexcept {
  const MeshView& m = p.mesh;
  if (m.low.x > m.high.x) return true;
  std::uint32_t all = ~0u;
  for (int k = 0; k < 8; ++k) {
    const Vec3d corner{(k & 1) != 0 ? m.high.x : m.low.x, (k & 2) != 0 ? m.high.y : m.low.y,
                       (k & 4) != 0 ? m.high.z : m.low.z};
    all &= camera.outcode(p.linear * corner + p.translation);
  }
  return all == 0 || (all & kMeshNotFinite) != 0;
}

/// True if a mesh is drawn as fragments.
inline bool seen_through(const MeshInstance& m) noexcept {
  return m.mesh.alpha_mode == MeshAlpha::blend;
}

/// Transforms an instance to a camera. Returns false if it draws nothing: it has no triangles, is out of
/// view, or its see-through property differs from `through`.
inline bool place_mesh(const MeshInstance& i, const Camera& camera, const MeshCamera& lens, bool through,
                       MeshPlacement& p) noexcept {
  p.mesh = i.mesh;
  const Mat3d rotation = rotation_matrix(i.world_from_mesh.rotation);
  p.linear = camera.viewmat.linear * rotation * i.world_from_mesh.scale;
  p.translation = camera.viewmat * i.world_from_mesh.translation;
  p.rotation = mat_cast<float>(rotation);
  p.id = i.id;
  return seen_through(i) == through && i.mesh.triangle_count() != 0 && box_may_be_visible(lens, p);
}

/// Lists the work items of the instances in view, of those whose see-through property is `through`.
template <class S, Backend B>
void place_meshes(MeshWorkspace<S, B>& ws, std::span<const MeshInstance> meshes, const Camera& camera,
                  bool through) {
  const MeshCamera lens = MeshCamera::of(camera);
  ws.host_placements.clear();
  ws.host_vertex_chunks.clear();
  ws.host_triangle_chunks.clear();
  std::size_t vertices = 0;
  const auto split = [](std::vector<MeshChunk>& chunks, std::size_t placement, std::size_t n) {
    for (std::size_t i = 0; i < n; i += kMeshChunk) {
      chunks.push_back({static_cast<std::uint32_t>(placement), static_cast<std::uint32_t>(i)});
    }
  };
  for (const MeshInstance& i : meshes) {
    MeshPlacement p;
    p.first_vertex = vertices;
    if (!place_mesh(i, camera, lens, through, p)) continue;
    split(ws.host_vertex_chunks, ws.host_placements.size(), i.mesh.vertices.size);
    split(ws.host_triangle_chunks, ws.host_placements.size(), i.mesh.triangle_count());
    vertices += i.mesh.vertices.size;
    ws.host_placements.push_back(p);
  }
  ws.placements.upload(ws.host_placements.data(), ws.host_placements.size());
  ws.vertex_chunks.upload(ws.host_vertex_chunks.data(), ws.host_vertex_chunks.size());
  ws.triangle_chunks.upload(ws.host_triangle_chunks.data(), ws.host_triangle_chunks.size());
  ws.vertices.resize_discard(vertices);
}

/// Checks the meshes, the camera and the light of a frame.
/// @return invalid_argument naming the field.
inline Status validate(std::span<const MeshInstance> meshes, const Camera& camera,
                       const MeshLight& light) {
  if (Status s = gsnav::validate(camera); !s) return s;
  for (const MeshInstance& m : meshes) {
    if (Status s = gsnav::validate(m); !s) return s;
  }
  if (!is_finite(light.ambient) || !is_finite(light.diffuse) || !is_finite(light.direction) ||
      !(light.unlit || norm(light.direction) > 0)) {
    return {Errc::invalid_argument, "MeshLight: must be finite, its direction not zero"};
  }
  return {};
}

/// Fills ws.triangles with the triangles that may cover a pixel centre: those of the see-through
/// instances if `through`, otherwise those of the others. Adds to `stats`.
template <class S, Backend B>
Status set_up_meshes(B& backend, MeshWorkspace<S, B>& ws, std::span<const MeshInstance> meshes,
                     const Camera& camera, bool through, MeshStats& stats) {
  place_meshes(ws, meshes, camera, through);
  const std::size_t chunks = ws.host_triangle_chunks.size();
  ws.counts.resize_discard(chunks);
  ws.not_finite.resize_discard(chunks);
  ws.offsets.resize_discard(chunks + 1);
  MeshSetupArgs<S> setup;
  setup.camera = MeshCamera::of(camera);
  setup.placements = std::as_const(ws.placements).view();
  setup.vertex_chunks = std::as_const(ws.vertex_chunks).view();
  setup.triangle_chunks = std::as_const(ws.triangle_chunks).view();
  setup.vertices = ws.vertices.view();
  setup.counts = ws.counts.view();
  setup.not_finite = ws.not_finite.view();
  setup.offsets = ws.offsets.view();
  run(backend, stage::Each{}, ws.host_vertex_chunks.size(), ProjectMeshVertices<S>{setup});
  run(backend, stage::Each{}, chunks, CountMeshTriangles<S>{setup});
  run(backend, stage::Each{}, std::size_t{1}, ScanMeshTriangles<S>{setup});
  ws.host_not_finite.resize(chunks);
  ws.not_finite.download(ws.host_not_finite.data(), chunks);
  std::uint64_t drawn = 0;
  ws.offsets.download(&drawn, 1, chunks);
  if (Status s = backend.synchronize(); !s) return s;
  for (const std::uint32_t n : ws.host_not_finite) stats.not_finite += n;
  if (drawn >= kNoTriangle) return {Errc::unsupported, "more than 2^32 triangles in one view"};
  stats.drawn += drawn;
  ws.triangles.resize_discard(drawn);
  setup.triangles = ws.triangles.view();
  run(backend, stage::Each{}, chunks, WriteMeshTriangles<S>{setup});
  return {};
}

/// Arguments for rasterising the triangles that set_up_meshes prepared.
template <class S, Backend B>
MeshRasterArgs<S> raster_args(MeshWorkspace<S, B>& ws, const Camera& camera, int tile_size) {
  MeshRasterArgs<S> raster;
  raster.bin.grid = TileGrid::of(camera.width, camera.height, tile_size);
  raster.triangles = std::as_const(ws.triangles).view();
  raster.placements = std::as_const(ws.placements).view();
  return raster;
}

/// Builds the list of triangles of each tile.
template <class S, Backend B>
Status bin_meshes(B& backend, MeshWorkspace<S, B>& ws, MeshRasterArgs<S>& raster) {
  BinArgs<S>& bin = raster.bin;
  bin.blocks = bin_blocks(backend, raster.triangles.size);
  ws.cursors.resize_discard(bin.blocks * bin.grid.count());
  ws.tile_offsets.resize_discard(bin.grid.count() + 1);
  bin.cursors = ws.cursors.view();
  bin.tile_offsets = ws.tile_offsets.view();
  backend.parallel_for(bin.blocks, CountMeshTiles<S>{raster});
  backend.parallel_for(1, ScanTileIntersections<S>{bin});
  std::uint64_t intersections = 0;
  ws.tile_offsets.download(&intersections, 1, bin.grid.count());
  if (Status s = backend.synchronize(); !s) return s;
  ws.tile_triangles.resize_discard(intersections);
  bin.tile_splats = ws.tile_triangles.view();
  backend.parallel_for(bin.blocks, ScatterMeshTiles<S>{raster});
  return {};
}

template <class S>
void set_light(MeshShadeArgs<S>& shade, const MeshLight& light) noexcept {
  shade.unlit = light.unlit;
  shade.ambient = vec_cast<S>(light.ambient);
  shade.diffuse = vec_cast<S>(light.diffuse);
  shade.light = light.unlit ? Vec3<S>{} : vec_cast<S>(normalized(light.direction));
}

/// Arguments for shading the triangles that set_up_meshes prepared.
template <class S, Backend B>
MeshShadeArgs<S> shade_args(MeshWorkspace<S, B>& ws, const Camera& camera, const MeshLight& light) {
  MeshShadeArgs<S> shade;
  shade.placements = std::as_const(ws.placements).view();
  shade.triangles = std::as_const(ws.triangles).view();
  shade.width = static_cast<std::size_t>(camera.width);
  set_light(shade, light);
  return shade;
}

}  // namespace detail

/// Draws meshes into ws.depth, ws.visible and ws.tile_far, and into the images that are not null in
/// `images`. See-through meshes (MeshAlpha::blend) are left to draw_fragments
/// (detail/render/draw_fragments.hpp). The result is complete after `backend.synchronize()` and valid
/// until the next call.
/// @param meshes instances; their arrays are in the backend's memory
/// @param tile_size width of the tiles of ws.tile_far, pixels
/// @param layer_color whether to write the colour to ws.color. Then `images.color` is replaced by it.
/// @param stats filled on success, if not null
/// @return invalid_argument naming the field; unsupported for 2^32 triangles or more; backend_failure.
template <class S, Backend B>
Status draw_meshes(B& backend, MeshWorkspace<S, B>& ws, std::span<const MeshInstance> meshes,
                   const Camera& camera, const MeshLight& light, int tile_size, bool layer_color,
                   MeshImages<S> images = {}, MeshStats* stats = nullptr) {
  if (Status s = detail::validate(meshes, camera, light); !s) return s;
  MeshStats counted;
  for (const MeshInstance& m : meshes) counted.triangles += m.mesh.triangle_count();
  if (Status s = detail::set_up_meshes(backend, ws, meshes, camera, false, counted); !s) return s;

  MeshRasterArgs<S> raster = detail::raster_args(ws, camera, tile_size);
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  ws.depth.resize_discard(pixels);
  ws.visible.resize_discard(pixels);
  ws.tile_far.resize_discard(raster.bin.grid.count());
  raster.depth = ws.depth.data();
  raster.visible = ws.visible.data();
  raster.tile_far = ws.tile_far.view();
  if constexpr (RunsStage<B, stage::RasterizeMesh, MeshRasterArgs<S>>) {
    run(backend, stage::RasterizeMesh{}, raster);
  } else {
    if (Status s = detail::bin_meshes(backend, ws, raster); !s) return s;
    run(backend, stage::Each{}, raster.bin.grid.count(), RasterizeMeshTile<S>{raster});
  }

  if (layer_color) {
    ws.color.resize_discard(3 * pixels);
    images.color = ws.color.data();
  }
  if (!images.empty()) {
    MeshShadeArgs<S> shade = detail::shade_args(ws, camera, light);
    shade.depth = raster.depth;
    shade.visible = raster.visible;
    shade.images = images;
    run(backend, stage::Each{}, static_cast<std::size_t>(camera.height), ShadeMeshRow<S>{shade});
  }
  if (stats != nullptr) *stats = counted;
  return {};
}

}  // namespace gsnav
