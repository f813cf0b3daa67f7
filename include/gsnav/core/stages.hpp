// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/view.hpp"

// The table of stages: all work that a backend may do with code of its own, and the generic form of
// each.
//
// A stage is a tag type. `run(backend, stage, args...)` calls `backend.run(stage, args...)` if the
// backend has such a member for these arguments, and else the generic form, which uses `parallel_for`. A
// backend without such members can run everything; each member that it adds replaces one stage
// completely.
//
//     struct MyBackend : HostMemory {
//       ...
//       void run(stage::Blend, const RasterArgs<float>& args);   // only this stage, only in float
//     };
//
// A backend's form must produce the same bits as the generic form, except where RenderConfig::quality
// allows a less exact exponential.

namespace gsnav {

template <class S>
struct ViewedSet;
template <class S>
struct ProjectOutputs;
template <class S>
struct ProjectChunk;
template <class S>
struct BinArgs;
template <class S, class Cull>
struct CountTileIntersections;
template <class S>
struct ScanTileIntersections;
template <class S, class Cull>
struct ScatterTileIntersections;
template <class S>
struct RasterArgs;
template <class S>
struct GapOfPair;
template <class S>
struct SweepPair;
template <class S>
struct CapsuleGapArgs;
template <class S>
struct SweepArgs;
template <class S, class Out>
struct SkinningArgs;
template <class S, class Out>
struct SkinGaussian;

/// True if backend B has its own form of a stage for these arguments.
template <class B, class Stage, class... Args>
concept RunsStage = requires(B& backend, Stage stage, const Args&... args) {
  backend.run(stage, args...);
};

/// Runs a stage with the backend's own form if it has one, else with the generic form.
template <Backend B, class Stage, class... Args>
void run(B& backend, Stage stage, const Args&... args) {
  if constexpr (RunsStage<B, Stage, Args...>) {
    backend.run(stage, args...);
  } else {
    Stage::generic(backend, args...);
  }
}

namespace detail {
/// Blends all pixels of a frame without meshes with the generic kernels.
template <class S, Backend B>
void blend_pixels(B& backend, const RasterArgs<S>& args);
/// Blends all pixels of a frame with meshes with the generic kernels.
template <class S, Backend B>
void blend_pixels_with_meshes(B& backend, const RasterArgs<S>& args);
}  // namespace detail

namespace stage {

/// Runs a kernel once per item: kernel(i) for i in [0, n). A backend with precompiled kernels overloads
/// `run` on the kernel's type. Those types, each of float, are ProjectMeshVertices, CountMeshTriangles,
/// ScanMeshTriangles, WriteMeshTriangles, RasterizeMeshTile, ShadeMeshRow, CountTileIntersections,
/// ScatterTileIntersections and WeighTile. For WeighTile, a backend that draws in slices of depth must
/// obey the progress in its arguments, as its Blend does.
struct Each {
  /// Calls backend.parallel_for.
  template <Backend B, class Kernel>
  static void generic(B& backend, std::size_t n, const Kernel& kernel) {
    backend.parallel_for(n, kernel);
  }
};

/// Projects a set of Gaussians for one camera (detail/frame/project_chunk.hpp). A host backend may add a
/// form with a third argument, the list of chunks to project (see ProjectsChunks). Chunks hidden by a
/// mesh are then skipped. A backend that also has its own Blend can draw frames in slices of depth
/// (detail/render/depth_slices.hpp).
struct Project {
  /// Projects one chunk per work item.
  template <Backend B, class S>
  static void generic(B& backend, const ViewedSet<S>& args, const ProjectOutputs<S>& out) {
    backend.parallel_for(args.chunk_count(), ProjectChunk<S>{args, out});
  }
};

/// Counts the splats of each tile, without those that `cull` (NoCull or MeshCull) finds hidden. Fills
/// args.tile_offsets, and args.cursors for ScatterTiles (detail/frame/tiles.hpp).
struct CountTiles {
  /// Counts per block of splats, then scans the counts in one work item.
  template <Backend B, class S, class Cull>
  static void generic(B& backend, const BinArgs<S>& args, const Cull& cull) {
    gsnav::run(backend, Each{}, args.blocks, CountTileIntersections<S, Cull>{args, cull});
    gsnav::run(backend, Each{}, std::size_t{1}, ScanTileIntersections<S>{args});
  }
};

/// Writes the list of splats of each tile to args.tile_splats, which must have room for the total that
/// CountTiles found.
struct ScatterTiles {
  /// Scatters one block of splats per work item.
  template <Backend B, class S, class Cull>
  static void generic(B& backend, const BinArgs<S>& args, const Cull& cull) {
    gsnav::run(backend, Each{}, args.blocks, ScatterTileIntersections<S, Cull>{args, cull});
  }
};

/// Blends the pixels of a frame without meshes (detail/frame/blend.hpp). The form of a backend that
/// ProjectsChunks must obey args.progress. It starts from the pixel states of the previous slice of
/// depth, stores its own for the next slice, and marks the squares that are still open. The generic form
/// draws a frame of one slice.
struct Blend {
  /// Blends with the generic kernels.
  template <Backend B, class S>
  static void generic(B& backend, const RasterArgs<S>& args) {
    detail::blend_pixels<S>(backend, args);
  }
};

/// Blends the pixels of a frame with meshes (detail/frame/composite.hpp).
struct BlendWithMeshes {
  /// Blends with the generic kernels.
  template <Backend B, class S>
  static void generic(B& backend, const RasterArgs<S>& args) {
    detail::blend_pixels_with_meshes<S>(backend, args);
  }
};

/// Rasterizes the triangles of MeshRasterArgs. The generic form needs scratch memory for binning, so it
/// is in draw_meshes (detail/render/draw_meshes.hpp).
struct RasterizeMesh {};

/// Skins the Gaussians of one avatar: linear blend skinning (skin/skin.hpp).
struct Skin {
  /// Skins one Gaussian per work item.
  template <Backend B, class S, class Out>
  static void generic(B& backend, const SkinningArgs<S, Out>& args) {
    backend.parallel_for(args.size(), SkinGaussian<S, Out>{args});
  }
};

/// Skins the Gaussians of several avatars. The result equals Skin on each of them.
struct SkinAll {
  /// Runs Skin on one avatar after the other.
  template <Backend B, class S, class Out>
  static void generic(B& backend, const std::span<const SkinningArgs<S, Out>>& avatars) {
    for (const SkinningArgs<S, Out>& args : avatars) gsnav::run(backend, Skin{}, args);
  }
};

/// Computes the gaps of pairs of capsules (sweep/sweep.hpp).
struct CapsuleGaps {
  /// Computes one pair per work item.
  template <Backend B, class S>
  static void generic(B& backend, const CapsuleGapArgs<S>& args) {
    backend.parallel_for(args.size(), GapOfPair<S>{args});
  }
};

/// Sweeps pairs of moving capsules (sweep/sweep.hpp).
struct SweepCapsules {
  /// Sweeps one pair per work item.
  template <Backend B, class S>
  static void generic(B& backend, const SweepArgs<S>& args) {
    backend.parallel_for(args.size(), SweepPair<S>{args});
  }
};

}  // namespace stage

/// Host backends whose Project stage accepts a list of chunks.
template <class B, class S>
concept ProjectsChunks = is_host_backend<B> &&
    RunsStage<B, stage::Project, ViewedSet<S>, ProjectOutputs<S>, View<const std::uint32_t>>;

}  // namespace gsnav
