// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/view.hpp"

// The table of stages: all work that a backend may do by code of its own, and the generic form of each.
//
// A stage is a tag. `run(backend, stage, args...)` calls `backend.run(stage, args...)` where the backend
// has such a member for these arguments, and the generic form, written over `parallel_for`, where not.
// A backend with no such member runs everything; each member that it adds replaces one stage whole.
//
//     struct MyBackend : HostMemory {
//       ...
//       void run(stage::Blend, const RasterArgs<float>& args);   // only this stage, only in float
//     };
//
// A backend's form must leave the bits of the generic form, but where RenderConfig::quality allows
// another exponential.

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

/// Whether a backend has a form of its own of a stage for these arguments.
template <class B, class Stage, class... Args>
concept RunsStage = requires(B& backend, Stage stage, const Args&... args) {
  backend.run(stage, args...);
};

/// Runs a stage: the backend's form where there is one, else the generic one.
template <Backend B, class Stage, class... Args>
void run(B& backend, Stage stage, const Args&... args) {
  if constexpr (RunsStage<B, Stage, Args...>) {
    backend.run(stage, args...);
  } else {
    Stage::generic(backend, args...);
  }
}

namespace detail {
/// Blends all pixels by the generic kernels.
template <class S, Backend B>
void blend_pixels(B& backend, const RasterArgs<S>& args);
template <class S, Backend B>
void blend_pixels_with_meshes(B& backend, const RasterArgs<S>& args);
}  // namespace detail

namespace stage {

/// A kernel for each of n items. A backend names the kernels that it has compiled by overloads on their
/// type: ProjectMeshVertices, CountMeshTriangles, ScanMeshTriangles, WriteMeshTriangles,
/// RasterizeMeshTile, ShadeMeshRow, CountTileIntersections, ScatterTileIntersections, each of float.
struct Each {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class Kernel>
  static void generic(B& backend, std::size_t n, const Kernel& kernel) {
    backend.parallel_for(n, kernel);
  }
};

/// Projects a set of Gaussians for one camera (detail/frame/project_chunk.hpp). A host backend may have
/// a second form, whose third argument lists the chunks to project (ProjectsChunks): what a mesh hides
/// is then not projected. With a Blend of its own as well, frames may be drawn in slices of depth
/// (detail/render/depth_slices.hpp).
struct Project {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class S>
  static void generic(B& backend, const ViewedSet<S>& args, const ProjectOutputs<S>& out) {
    backend.parallel_for(args.chunk_count(), ProjectChunk<S>{args, out});
  }
};

/// Counts the splats of each tile, less those that `cull` (NoCull, MeshCull) hides: fills
/// args.tile_offsets, and args.cursors for ScatterTiles (detail/frame/tiles.hpp).
struct CountTiles {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class S, class Cull>
  static void generic(B& backend, const BinArgs<S>& args, const Cull& cull) {
    gsnav::run(backend, Each{}, args.blocks, CountTileIntersections<S, Cull>{args, cull});
    gsnav::run(backend, Each{}, std::size_t{1}, ScanTileIntersections<S>{args});
  }
};

/// Fills args.tile_splats, which has room for as many as CountTiles counted.
struct ScatterTiles {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class S, class Cull>
  static void generic(B& backend, const BinArgs<S>& args, const Cull& cull) {
    gsnav::run(backend, Each{}, args.blocks, ScatterTileIntersections<S, Cull>{args, cull});
  }
};

/// Blends the pixels of a frame without meshes (detail/frame/blend.hpp). The form of a backend that
/// ProjectsChunks must obey args.progress: it begins with the states that the slice of depth before
/// left, leaves its own to the next, and says which cells are open. The generic form draws one slice.
struct Blend {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class S>
  static void generic(B& backend, const RasterArgs<S>& args) {
    detail::blend_pixels<S>(backend, args);
  }
};

/// Blends the pixels of a frame with meshes (detail/frame/composite.hpp).
struct BlendWithMeshes {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class S>
  static void generic(B& backend, const RasterArgs<S>& args) {
    detail::blend_pixels_with_meshes<S>(backend, args);
  }
};

/// Rasterizes the triangles of MeshRasterArgs. The generic form bins them first and needs scratch for
/// that: it is in draw_meshes (detail/render/draw_meshes.hpp).
struct RasterizeMesh {};

/// Skins the Gaussians of one avatar linearly (skin/skin.hpp).
struct Skin {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class S, class Out>
  static void generic(B& backend, const SkinningArgs<S, Out>& args) {
    backend.parallel_for(args.size(), SkinGaussian<S, Out>{args});
  }
};

/// The same of many avatars.
struct SkinAll {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class S, class Out>
  static void generic(B& backend, const std::span<const SkinningArgs<S, Out>>& avatars) {
    for (const SkinningArgs<S, Out>& args : avatars) gsnav::run(backend, Skin{}, args);
  }
};

/// Gaps of pairs of capsules (sweep/sweep.hpp).
struct CapsuleGaps {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class S>
  static void generic(B& backend, const CapsuleGapArgs<S>& args) {
    backend.parallel_for(args.size(), GapOfPair<S>{args});
  }
};

/// Sweeps of pairs of moving capsules (sweep/sweep.hpp).
struct SweepCapsules {
  /// Generic form, for backends without a form of their own.
  template <Backend B, class S>
  static void generic(B& backend, const SweepArgs<S>& args) {
    backend.parallel_for(args.size(), SweepPair<S>{args});
  }
};

}  // namespace stage

/// Host backends that have the form of stage::Project for some chunks of a set.
template <class B, class S>
concept ProjectsChunks = is_host_backend<B> &&
    RunsStage<B, stage::Project, ViewedSet<S>, ProjectOutputs<S>, View<const std::uint32_t>>;

}  // namespace gsnav
