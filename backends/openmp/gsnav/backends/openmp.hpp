// SPDX-License-Identifier: Apache-2.0
#pragma once

// The compiled component gsnav::openmp has SIMD kernels for SSE2, AVX2 and AVX-512 and chooses at run
// time. Its CMake target sets GSNAV_OPENMP_COMPILED.
//
// Header-only use must be requested with GSNAV_OPENMP_HEADER_ONLY. Every translation unit then compiles
// the kernels itself (about a minute and 1 GB), for the instruction set of its own flags (-march=...).
// Without optimisation they are many times slower.
#if defined(GSNAV_OPENMP_HEADER_ONLY)
#undef GSNAV_OPENMP_COMPILED
#elif !defined(GSNAV_OPENMP_COMPILED)
#error "gsnav::OpenMPBackend: link the CMake target gsnav::openmp, or define GSNAV_OPENMP_HEADER_ONLY"
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>

#if defined(_OPENMP)
#include <omp.h>
#endif

#include "gsnav/core/backend.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/detail/core/host_memory.hpp"
#include "gsnav/detail/core/thread_pool.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/composite.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/frame/weigh.hpp"
#include "gsnav/detail/mesh/mesh_shade.hpp"
#include "gsnav/detail/render/draw_frame.hpp"
#include "gsnav/detail/render/instantiate.hpp"
#include "gsnav/detail/sweep/capsule_batch.hpp"
#include "gsnav/skin/lbs.hpp"
#include "gsnav/skin/skin.hpp"
#if !defined(GSNAV_OPENMP_COMPILED)
#include "gsnav/detail/lanes/kernels.hpp"
#endif

namespace gsnav {

#if !defined(GSNAV_OPENMP_COMPILED)
// A namespace per instruction set, so that a program may link units compiled for several sets, and
// others that use the component.
inline namespace GSNAV_LANES_TAG {
#endif

/// SIMD kernels of one instruction set, for Gaussians, meshes, skinning and capsules.
/// lanes::kernel_table fills it.
struct LaneKernels {
  /// Name of the instruction set: "baseline", "avx2", "avx512", "neon" or "native".
  const char* name;
  /// Number of float lanes.
  int width;
  /// Projects a chunk of Gaussians.
  void (*project_chunk)(const ViewedSet<float>&, const ProjectOutputs<float>&,
                        std::size_t chunk) noexcept;
  /// Counts the splats of each tile for one block of splats.
  void (*count_tiles)(const CountTileIntersections<float>&, std::size_t block) noexcept;
  /// Like count_tiles, without splats behind a mesh.
  void (*count_tiles_before_mesh)(const CountTileIntersections<float, MeshCull<float>>&,
                                  std::size_t block) noexcept;
  /// Writes the splats of one block to the lists of their tiles.
  void (*scatter_tiles)(const ScatterTileIntersections<float>&, std::size_t block) noexcept;
  /// Like scatter_tiles, without splats behind a mesh.
  void (*scatter_tiles_before_mesh)(const ScatterTileIntersections<float, MeshCull<float>>&,
                                    std::size_t block) noexcept;
  /// Blends a tile of a frame without meshes.
  void (*rasterize_tile)(const RasterArgs<float>&, std::size_t tile) noexcept;
  /// Blends a tile of a frame with meshes.
  void (*composite_tile)(const RasterArgs<float>&, std::size_t tile) noexcept;
  /// Weighs the Gaussians of a tile.
  void (*weigh_tile)(const WeighTile&, std::size_t tile) noexcept;
  /// Projects a chunk of mesh vertices.
  void (*project_mesh_vertices)(const ProjectMeshVertices<float>&, std::size_t chunk) noexcept;
  /// Counts the visible pieces of a chunk of triangles.
  void (*count_mesh_triangles)(const CountMeshTriangles<float>&, std::size_t chunk) noexcept;
  /// Writes the visible pieces of a chunk of triangles.
  void (*write_mesh_triangles)(const WriteMeshTriangles<float>&, std::size_t chunk) noexcept;
  /// Finds the nearest triangle at each pixel of a tile.
  void (*rasterize_mesh_tile)(const RasterizeMeshTile<float>&, std::size_t tile) noexcept;
  /// Shades a row of pixels.
  void (*shade_mesh_row)(const ShadeMeshRow<float>&, std::size_t row) noexcept;
  /// Skins the Gaussians [begin, end).
  void (*skin_range)(const SkinningArgs<float>&, std::size_t begin, std::size_t end) noexcept;
  /// Computes the gaps of the pairs [begin, end) of capsules.
  void (*gap_range)(const CapsuleGapArgs<float>&, std::size_t begin, std::size_t end) noexcept;
  /// Sweeps the pairs [begin, end) of capsules.
  void (*sweep_range)(const SweepArgs<float>&, std::size_t begin, std::size_t end) noexcept;
};

#if defined(GSNAV_OPENMP_COMPILED)
/// Kernels of gsnav::openmp for the widest instruction set that this processor supports (baseline, AVX2,
/// AVX-512). The environment variable GSNAV_ISA=baseline|avx2|avx512 can lower the choice.
const LaneKernels& lane_kernels() noexcept;
#else
/// Kernels for this translation unit's flags (header-only use).
inline const LaneKernels& lane_kernels() noexcept {
  static constexpr LaneKernels k = lanes::kernel_table<LaneKernels>("native");
  return k;
}
#endif

/// Backend for all CPU cores. float32 frames use SIMD kernels; other scalars use the generic ones.
/// Results do not depend on the number of threads.
///
/// Threads are a pool that the backend owns and its copies share (see detail/core/thread_pool.hpp).
/// OpenMP only determines the default number.
class OpenMPBackend : public HostMemory {
 public:
  /// @param threads number of threads. 0: OpenMP's default (OMP_NUM_THREADS), or without OpenMP the
  ///   number of cores.
  explicit OpenMPBackend(int threads = 0)
      : threads_(threads > 0 ? threads : default_threads()),
        pool_(threads_ > 1 ? std::make_shared<ThreadPool>(threads_) : nullptr) {}

  /// Number of threads, including the caller.
  int threads() const noexcept { return threads_; }
  /// Number of threads: work is cut into that many pieces.
  std::size_t concurrency() const noexcept { return static_cast<std::size_t>(threads_); }

  /// Backend for one thread. With it, batches of cameras run one frame per thread.
  OpenMPBackend one_thread() const { return OpenMPBackend(1); }

  /// Calls f(i) for i in [0, n), in any order. An exception that leaves f terminates the process if
  /// there is more than one thread.
  template <class F>
  void parallel_for(std::size_t n, const F& f) {
    if (threads_ < 2 || n < 2) {
      for (std::size_t i = 0; i < n; ++i) f(i);
      return;
    }
    // More pieces than threads, because work items differ in cost.
    const std::size_t piece = n / (concurrency() * 32) + 1;
    pool_->run(static_cast<std::uint32_t>((n + piece - 1) / piece), [&f, n, piece](std::uint32_t p) {
      const std::size_t begin = p * piece, end = std::min(n, begin + piece);
      for (std::size_t i = begin; i < end; ++i) f(i);
    });
  }
  /// Returns success: work is done when the call returns.
  Status synchronize() { return {}; }

  // Stages with SIMD kernels (core/stages.hpp).
  /// Projects a set.
  void run(stage::Project, const ViewedSet<float>& args, const ProjectOutputs<float>& out) {
    const auto kernel = lane_kernels().project_chunk;
    parallel_for(args.chunk_count(), [&args, &out, kernel](std::size_t c) { kernel(args, out, c); });
  }
  /// Projects the listed chunks. Skips splats that reach no open square (ProjectOutputs::open).
  void run(stage::Project, const ViewedSet<float>& args, const ProjectOutputs<float>& out,
           View<const std::uint32_t> chunks) {
    const auto kernel = lane_kernels().project_chunk;
    parallel_for(chunks.size,
                 [&args, &out, chunks, kernel](std::size_t i) { kernel(args, out, chunks[i]); });
  }
  /// Binning reads the tiles that projection found (BinArgs::spans).
  static constexpr bool bins_in_lanes = true;
  /// Counts the splats of each tile.
  void run(stage::Each, std::size_t n, const CountTileIntersections<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().count_tiles});
  }
  /// Counts the splats of each tile that are not behind a mesh.
  void run(stage::Each, std::size_t n, const CountTileIntersections<float, MeshCull<float>>& k) {
    parallel_for(n, Compiled{k, lane_kernels().count_tiles_before_mesh});
  }
  /// Writes the splats to the lists of their tiles.
  void run(stage::Each, std::size_t n, const ScatterTileIntersections<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().scatter_tiles});
  }
  /// Writes the splats that are not behind a mesh to the lists of their tiles.
  void run(stage::Each, std::size_t n, const ScatterTileIntersections<float, MeshCull<float>>& k) {
    parallel_for(n, Compiled{k, lane_kernels().scatter_tiles_before_mesh});
  }
  /// Blends a frame without meshes.
  void run(stage::Blend, const RasterArgs<float>& args) {
    parallel_for(args.grid.count(), Compiled{args, lane_kernels().rasterize_tile});
  }
  /// Blends a frame with meshes.
  void run(stage::BlendWithMeshes, const RasterArgs<float>& args) {
    parallel_for(args.grid.count(), Compiled{args, lane_kernels().composite_tile});
  }
  /// Weighs the Gaussians of a frame, also in slices of depth.
  void run(stage::Each, std::size_t n, const WeighTile& k) {
    parallel_for(n, Compiled{k, lane_kernels().weigh_tile});
  }
  /// Projects the vertices of meshes.
  void run(stage::Each, std::size_t n, const ProjectMeshVertices<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().project_mesh_vertices});
  }
  /// Counts the visible pieces of triangles.
  void run(stage::Each, std::size_t n, const CountMeshTriangles<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().count_mesh_triangles});
  }
  /// Writes the visible pieces of triangles.
  void run(stage::Each, std::size_t n, const WriteMeshTriangles<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().write_mesh_triangles});
  }
  /// Finds the nearest triangle at each pixel.
  void run(stage::Each, std::size_t n, const RasterizeMeshTile<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().rasterize_mesh_tile});
  }
  /// Shades the pixels of meshes.
  void run(stage::Each, std::size_t n, const ShadeMeshRow<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().shade_mesh_row});
  }
  /// Skins the Gaussians of an avatar.
  void run(stage::Skin, const SkinningArgs<float>& args) { in_ranges(args, lane_kernels().skin_range); }
  /// Computes gaps of pairs of capsules.
  void run(stage::CapsuleGaps, const CapsuleGapArgs<float>& args) {
    in_ranges(args, lane_kernels().gap_range);
  }
  /// Sweeps pairs of capsules.
  void run(stage::SweepCapsules, const SweepArgs<float>& args) {
    in_ranges(args, lane_kernels().sweep_range);
  }

 private:
  /// A kernel compiled for the processor's lanes, with its arguments.
  template <class Args>
  struct Compiled {
    const Args& args;
    void (*kernel)(const Args&, std::size_t) noexcept;
    void operator()(std::size_t i) const noexcept { kernel(args, i); }
  };
  template <class Args>
  Compiled(const Args&, void (*)(const Args&, std::size_t) noexcept) -> Compiled<Args>;

  /// Calls kernel(args, begin, end) for ranges that cover [0, args.size()).
  template <class Args>
  void in_ranges(const Args& args, void (*kernel)(const Args&, std::size_t, std::size_t) noexcept) {
    constexpr std::size_t kRange = 1024;
    const std::size_t n = args.size();
    parallel_for((n + kRange - 1) / kRange, [&args, kernel, n](std::size_t r) {
      kernel(args, r * kRange, (r + 1) * kRange < n ? (r + 1) * kRange : n);
    });
  }

  static int default_threads() noexcept {
#if defined(_OPENMP)
    return omp_get_max_threads();
#else
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
#endif
  }

  int threads_;
  std::shared_ptr<ThreadPool> pool_;
};

static_assert(Backend<OpenMPBackend>);

#if !defined(GSNAV_OPENMP_COMPILED)
}  // namespace GSNAV_LANES_TAG
#else
// Compiled in gsnav::openmp, so that users need not compile them.
GSNAV_FRAME_FUNCTIONS(extern, float, OpenMPBackend);
GSNAV_FRAME_FUNCTIONS(extern, double, OpenMPBackend);
GSNAV_SKIN_FUNCTIONS(extern, OpenMPBackend);
#endif

}  // namespace gsnav
