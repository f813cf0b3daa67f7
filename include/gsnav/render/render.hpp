// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/color_space.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/render/blend_projected.hpp"
#include "gsnav/detail/render/order_visible.hpp"
#include "gsnav/detail/render/render_workspace.hpp"
#include "gsnav/detail/render/rules.hpp"
#include "gsnav/detail/render/tuning.hpp"
#include "gsnav/detail/render/validate_set.hpp"
#include "gsnav/render/config.hpp"

namespace gsnav {

namespace detail {

/// Grid of tiles of one camera's image.
template <Backend B>
TileGrid grid_of(const RenderConfig& config, const Camera& camera) noexcept {
  return TileGrid::of(camera.width, camera.height, tile_size_of<B>(config, camera.width, camera.height));
}

/// Blends one row of pixels per work item. On a CPU that is enough parallelism, at little overhead.
template <class S, class PixelKernel>
struct RasterizeRow {
  PixelKernel kernel;
  std::size_t width;
  GSNAV_HD void operator()(std::size_t y) const noexcept {
    for (std::size_t x = 0; x < width; ++x) kernel(y * width + x);
  }
};

/// Exponential that a backend's kernels use where `asked` is asked for.
template <Backend B>
constexpr Exp2 exp2_on(Exp2 asked) noexcept {
  if constexpr (requires { B::exp2_of(asked); }) {
    return B::exp2_of(asked);
  } else {
    return asked;
  }
}

template <class S, Backend B>
void blend_pixels(B& backend, const RasterArgs<S>& args) {
  const std::size_t width = static_cast<std::size_t>(args.grid.width);
  const std::size_t height = static_cast<std::size_t>(args.grid.height);
  dispatch_raster(args, [&]<bool C, DepthMode D, Exp2 M, bool P>() {
    using Kernel = RasterizePixel<S, C, D, exp2_on<B>(M), P>;
    if constexpr (is_host_backend<B>) {
      backend.parallel_for(height, RasterizeRow<S, Kernel>{{args}, width});
    } else {
      backend.parallel_for(width * height, Kernel{args});
    }
  });
}

/// True if a backend bins the frames of scalar S by entries (SortEntry).
template <class S, Backend B>
inline constexpr bool bins_by_entries = sizeof(S) == sizeof(float) && requires {
  B::bins_in_lanes;
};

/// Sizes the scratch memory of one camera's frame and writes the arguments of the projection.
template <class S, Backend B>
void prepare_projection(RenderWorkspace<S, B>& ws, std::span<const GaussianSet> sets,
                        const Camera& camera, const RenderConfig& config, const FrameImages<S>& images,
                        bool meshes) {
  ws.projections.resize(sets.size());
  std::size_t chunks = 0;
  bool ranked = false;
  for (const GaussianSet& set : sets) {
    chunks += set.drawn_chunk_count();
    ranked = ranked || !set.gaussians.row_ids.empty();
  }
  ws.visible.by_rank = ranked;
  const std::size_t slots = chunks * kProjectChunk;
  const bool color = images.rgb != nullptr;
  const bool depth = meshes || images.depth_mode() != DepthMode::none;

  ws.geometry.resize_discard(slots);
  ws.bounds.resize_discard(slots);
  ws.visible.chunk_keys.resize_discard(slots);
  ws.visible.ranks.resize_discard(ranked || !ws.weights.empty() ? slots : 0);
  ws.colors.resize_discard(color ? slots : 0);
  ws.depths.resize_discard(depth ? slots : 0);
  ws.perspectives.resize_discard(config.response != Response::ewa ? slots : 0);
  ws.visible.counts.resize_discard(chunks);
  ws.visible.drawn.resize_discard(bins_by_entries<S, B> ? chunks : 0);
  ws.spans.resize_discard(bins_by_entries<S, B> ? slots : 0);
  ws.visible.words.resize_discard(ws.spans.size());
  ProjectOutputs<S>& out = ws.projected;
  out = {};
  out.geometry = ws.geometry.view();
  out.colors = ws.colors.view();
  out.depths = ws.depths.view();
  out.perspectives = ws.perspectives.view();
  out.bounds = ws.bounds.view();
  out.keys = ws.visible.chunk_keys.view();
  out.ranks = ws.visible.ranks.view();
  out.counts = ws.visible.counts.view();
  out.grid = grid_of<B>(config, camera);
  out.spans = ws.spans.view();
  out.words = ws.visible.words.view();

  const ProjectionRules rules = projection_rules(config);
  ws.host_offsets.clear();
  std::size_t first_chunk = 0, first_rank = 0;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    ViewedSet<S>& a = ws.projections[i];
    a = view_set<S>(camera, sets[i], rules, config.quality.max_sh_degree);
    a.first_chunk = first_chunk;
    a.first_rank = static_cast<std::uint32_t>(first_rank);
    a.offsets.size = origin_count(a.gaussians);
    for (std::size_t o = 0; o < a.offsets.size; ++o) ws.host_offsets.push_back(origin_offset(a, o));
    first_chunk += a.chunk_count();
    first_rank += a.gaussians.size();
  }
  ws.offsets.upload(ws.host_offsets.data(), ws.host_offsets.size());
  const Vec3d* offsets = ws.offsets.data();
  for (ViewedSet<S>& a : ws.projections) {
    a.offsets.data = offsets;
    offsets += a.offsets.size;
  }
}

/// True if some set's colours must be converted before blending.
inline bool any_other_space(std::span<const GaussianSet> sets, const RenderConfig& config) noexcept {
  return std::any_of(sets.begin(), sets.end(),
                     [&](const GaussianSet& s) { return s.color_space != config.blend_space; });
}

/// Converts the colours of one projected set from `from` to `to`. Does nothing if both are the same
/// space.
template <class S, Backend B>
void convert_set(B& backend, const ViewedSet<S>& args, const ProjectOutputs<S>& out, ColorSpace from,
                 ColorSpace to) {
  if (from == to || out.colors.empty()) return;
  backend.parallel_for(args.chunk_count(),
                       ConvertSplatColors<S>{out.colors, out.counts, args.first_chunk, from, to});
}

/// Sorts, bins and blends the projected Gaussians whose key is in `range`. Adds to `stats`.
template <class S, Backend B>
Status draw_projected(B& backend, RenderWorkspace<S, B>& ws, const Camera& camera,
                      const RenderConfig& config, const KeyRange& range, const TileProgress<S>& progress,
                      const MeshLayer<S>& mesh, const FrameImages<S>& images, RenderStats& stats) {
  // ---- sort
  std::uint32_t base = range.low;  // lower bound of all keys
  if (!ws.projections.empty())     // all sets have the same near plane
    base = std::max(base, ws.projections[0].camera.key_code.lowest(ws.projections[0].camera.near_plane));
  BinArgs<S> bin;
  bin.grid = grid_of<B>(config, camera);
  std::size_t visible = 0;
  if constexpr (bins_by_entries<S, B>) {
    bin.entry = SortEntry::of(ws.visible.words.size(), bin.grid.count());
    bin.entries = order_entries(backend, ws.visible, bin.entry, base, range);
    visible = bin.entries.size;
  } else {
    const Result<std::size_t> ordered =
        order_visible(backend, ws.visible, base, config.quality.key_bits, range);
    if (!ordered) return ordered.status();
    visible = ordered.value();
    bin.order = ws.visible.order.view();
  }

  // ---- bin
  bin.geometry = ws.geometry.view();
  bin.bounds = ws.bounds.view();
  bin.log2_alpha_min = static_cast<S>(log2_alpha_min(config.quality));
  bin.elliptic = config.response == Response::ewa;
  bin.blocks = bin_blocks(backend, visible);
  ws.cursors.resize_discard(bin.blocks * bin.grid.count());
  ws.tile_offsets.resize_discard(bin.grid.count() + 1);
  bin.cursors = ws.cursors.view();
  bin.tile_offsets = ws.tile_offsets.view();
  bin.spans = ws.spans.view();
  const MeshCull<S> cull{ws.depths.view(), mesh.tile_far};
  if (mesh.empty()) {
    run(backend, stage::CountTiles{}, bin, NoCull{});
  } else {
    run(backend, stage::CountTiles{}, bin, cull);
  }
  std::uint64_t intersections = 0;
  ws.tile_offsets.download(&intersections, 1, bin.grid.count());
  if (Status s = backend.synchronize(); !s) return s;
  ws.tile_splats.resize_discard(intersections);
  bin.tile_splats = ws.tile_splats.view();
  if (mesh.empty()) {
    run(backend, stage::ScatterTiles{}, bin, NoCull{});
  } else {
    run(backend, stage::ScatterTiles{}, bin, cull);
  }

  // ---- blend
  RasterArgs<S> raster;
  raster.grid = bin.grid;
  raster.tile_offsets = ws.tile_offsets.view();
  raster.tile_splats = ws.tile_splats.view();
  raster.geometry = ws.geometry.view();
  raster.colors = ws.colors.view();
  raster.depths = ws.depths.view();
  raster.perspectives = ws.perspectives.view();
  raster.rules = blend_rules<S>(config, images);
  raster.background = vec_cast<S>(config.background);
  raster.exp2_method = exp2_method(config.quality);
  raster.images = images;
  raster.progress = progress;
  raster.mesh = mesh;
  blend_projected(backend, ws, config, raster);

  stats.visible += visible;
  stats.tile_intersections += intersections;
  return {};
}

/// Projects and draws a frame in slices of depth, front to back. Returns false, having drawn nothing,
/// when a single slice would be as fast.
template <class B>
Result<bool> draw_in_slices(B& backend, RenderWorkspace<float, B>& ws, const Camera& camera,
                            const RenderConfig& config, const FrameImages<float>& images,
                            RenderStats& stats) {
  // The upper bound already says one slice: skip planning.
  const std::size_t threads = concurrency_of(backend);
  if (depth_slices_of(config, stats.gaussians, camera, threads) < 2) return false;
  DepthSlices& slices = ws.slices;
  const View<const ViewedSet<float>> sets = view_of(ws.projections);
  const TileGrid grid = grid_of<B>(config, camera);
  slices.plan(backend, sets, grid.tile_size);
  const int count = depth_slices_of(config, slices.candidates(), camera, threads);
  if (count < 2) return false;
  slices.split(count);
  const int last = slices.count() - 1;

  const std::size_t pixels =
      static_cast<std::size_t>(grid.tile_size) * static_cast<std::size_t>(grid.tile_size);
  ws.open.resize_discard(grid.count());
  ws.states.resize_discard(grid.count() * pixels * blend_state_values(images.depth_mode()));
  for (Buffer<std::uint32_t, B>* const of_chunks : {&ws.visible.counts, &ws.visible.drawn})
    std::fill_n(of_chunks->data(), of_chunks->size(), 0u);
  for (int s = 0; s <= last; ++s) {
    for (const ViewedSet<float>& args : sets) {
      const View<const std::uint32_t> chunks = slices.chunks(s, args, ws.projected.open);
      if (!chunks.empty()) run(backend, stage::Project{}, args, ws.projected, chunks);
    }
    const TileProgress<float> progress{ws.open.view(), ws.states.view(), s == 0, s == last};
    if (Status e =
            draw_projected(backend, ws, camera, config, slices.keys(s), progress, {}, images, stats);
        !e) {
      return e;
    }
    if (s == last) break;
    ws.projected.open = slices.open_squares(grid, ws.open.view());
    const View<const std::uint32_t>& sums = ws.projected.open.sums;
    if (sums[sums.size - 1] == 0) break;
  }
  return true;
}

/// Renders a camera like render_camera. If `mesh` is not empty, composites it with the Gaussians.
template <class S, Backend B>
Status render_frame(B& backend, RenderWorkspace<S, B>& ws, std::span<const GaussianSet> sets,
                    const Camera& camera, const RenderConfig& config, const MeshLayer<S>& mesh,
                    const FrameImages<S>& images, RenderStats& stats) {
  if (Status s = validate(config); !s) return s;
  if (Status s = validate(camera); !s) return s;
  std::size_t slots = 0;
  RenderStats counted;
  for (const GaussianSet& set : sets) {
    if (Status s = validate(set); !s) return s;
    slots += set.drawn_chunk_count() * kProjectChunk;
    counted.gaussians += set.gaussians.size();
  }
  if (slots > std::numeric_limits<std::uint32_t>::max()) {
    return {Errc::unsupported, "more than 2^32 Gaussians in one render"};
  }
  detail::prepare_projection(ws, sets, camera, config, images, !mesh.empty());
  bool drawn = false;
  if constexpr (sizeof(S) == sizeof(float) && SlicingBackend<B, S>) {
    if (mesh.empty() && !detail::any_other_space(sets, config)) {
      const Result<bool> sliced = detail::draw_in_slices(backend, ws, camera, config, images, counted);
      if (!sliced) return sliced.status();
      drawn = sliced.value();
    }
  }
  if (!drawn) {
    ws.visible.drawn.resize_discard(0);  // one slice
    for (std::size_t i = 0; i < sets.size(); ++i) {
      const ViewedSet<S>& args = ws.projections[i];
      if constexpr (sizeof(S) == sizeof(float) && ProjectsChunks<B, S>) {
        if (!mesh.empty()) {
          std::fill_n(ws.projected.counts.data + args.first_chunk, args.chunk_count(), 0u);
          detail::project_unhidden(backend, args, ws.projected, mesh.tile_far, ws.mesh.unhidden);
          detail::convert_set(backend, args, ws.projected, sets[i].color_space, config.blend_space);
          continue;
        }
      }
      run(backend, stage::Project{}, args, ws.projected);
      detail::convert_set(backend, args, ws.projected, sets[i].color_space, config.blend_space);
    }
    if (Status s = detail::draw_projected<S>(backend, ws, camera, config, {}, {}, mesh, images, counted);
        !s)
      return s;
  }
  stats = counted;
  return {};
}

}  // namespace detail

/// Renders sets of Gaussians into the images of one camera. All sets are drawn as one list, sorted by
/// (float32 key, set, row): project, sort, bin into tiles, blend.
///
/// Arrays of `sets` and pointers of `images` are in the backend's memory; images are row-major, [H][W]
/// or [H][W][3]. The result is complete after `backend.synchronize()`.
///
/// @param ws scratch memory, kept between calls
/// @param stats filled on success, if not null
/// @return invalid_argument naming the field; unsupported for more than 2^32 Gaussians; backend_failure.
///   The workspace throws gsnav::Error (out_of_memory).
template <class S, Backend B>
Status render_camera(B& backend, RenderWorkspace<S, B>& ws, std::span<const GaussianSet> sets,
                     const Camera& camera, const RenderConfig& config, const FrameImages<S>& images,
                     RenderStats* stats = nullptr) {
  RenderStats counted;
  Status s = detail::render_frame<S>(backend, ws, sets, camera, config, {}, images, counted);
  if (s.ok() && stats != nullptr) *stats = counted;
  return s;
}

}  // namespace gsnav
