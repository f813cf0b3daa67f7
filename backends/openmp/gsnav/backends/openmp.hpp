// SPDX-License-Identifier: Apache-2.0
#pragma once

// The compiled component gsnav::openmp has the lane kernels for SSE2, AVX2 and AVX-512 and chooses at
// run time. CMake's target sets GSNAV_OPENMP_COMPILED. Header-only use is possible, but must be asked
// for: every translation unit then compiles the kernels itself (about a minute and 1 GB), for the one
// instruction set of its own flags (-march=...), and without optimisation they are many times slower.
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
#include "gsnav/detail/mesh/mesh_shade.hpp"
#include "gsnav/detail/render/draw_frame.hpp"
#include "gsnav/detail/sweep/capsule_batch.hpp"
#include "gsnav/skin/lbs.hpp"
#include "gsnav/skin/skin.hpp"
#if !defined(GSNAV_OPENMP_COMPILED)
#include "gsnav/detail/lanes/kernels.hpp"
#endif

namespace gsnav {

#if !defined(GSNAV_OPENMP_COMPILED)
// Names of its own for each instruction set: a program may link units that were compiled for several of
// them, and others that use the component.
inline namespace GSNAV_LANES_TAG {
#endif

/// The lane kernels of one instruction set: Gaussians, meshes (which a frame draws first), skinning and
/// capsules. lanes::kernel_table fills it.
struct LaneKernels {
  const char* name;  ///< Name of the instruction set.
  int width;         ///< Floats per SIMD register.
  /// Projects one chunk.
  void (*project_chunk)(const ViewedSet<float>&, const ProjectOutputs<float>&,
                        std::size_t chunk) noexcept;
  /// Counts tiles of one block of splats.
  void (*count_tiles)(const CountTileIntersections<float>&, std::size_t block) noexcept;
  /// Counts tiles of one block of splats that no mesh hides.
  void (*count_tiles_before_mesh)(const CountTileIntersections<float, MeshCull<float>>&,
                                  std::size_t block) noexcept;
  /// Writes one block of splats to the lists of their tiles.
  void (*scatter_tiles)(const ScatterTileIntersections<float>&, std::size_t block) noexcept;
  /// Writes one block of splats that no mesh hides to the lists of their tiles.
  void (*scatter_tiles_before_mesh)(const ScatterTileIntersections<float, MeshCull<float>>&,
                                    std::size_t block) noexcept;
  void (*rasterize_tile)(const RasterArgs<float>&, std::size_t tile) noexcept;  ///< Blends one tile.
  /// Blends one tile of Gaussians and meshes.
  void (*composite_tile)(const RasterArgs<float>&, std::size_t tile) noexcept;
  /// Projects one chunk of vertices.
  void (*project_mesh_vertices)(const ProjectMeshVertices<float>&, std::size_t chunk) noexcept;
  /// Counts the visible triangles of one chunk.
  void (*count_mesh_triangles)(const CountMeshTriangles<float>&, std::size_t chunk) noexcept;
  /// Writes the visible triangles of one chunk.
  void (*write_mesh_triangles)(const WriteMeshTriangles<float>&, std::size_t chunk) noexcept;
  /// Rasterizes the triangles of one tile.
  void (*rasterize_mesh_tile)(const RasterizeMeshTile<float>&, std::size_t tile) noexcept;
  /// Shades one row of pixels.
  void (*shade_mesh_row)(const ShadeMeshRow<float>&, std::size_t row) noexcept;
  /// Skins Gaussians [begin, end).
  void (*skin_range)(const SkinningArgs<float>&, std::size_t begin, std::size_t end) noexcept;
  /// Measures gaps of capsules [begin, end).
  void (*gap_range)(const CapsuleGapArgs<float>&, std::size_t begin, std::size_t end) noexcept;
  /// Sweeps capsules [begin, end).
  void (*sweep_range)(const SweepArgs<float>&, std::size_t begin, std::size_t end) noexcept;
};

#if defined(GSNAV_OPENMP_COMPILED)
/// The widest lane kernels in gsnav::openmp that this processor runs (baseline, AVX2, AVX-512). The
/// environment variable GSNAV_ISA=baseline|avx2|avx512 lowers the choice.
const LaneKernels& lane_kernels() noexcept;
#else
/// Header only: the lane kernels that this translation unit's flags give.
inline const LaneKernels& lane_kernels() noexcept {
  static constexpr LaneKernels k = lanes::kernel_table<LaneKernels>("native");
  return k;
}
#endif

/// Runs on the processor's cores. float32 frames go through lane kernels; every other scalar through
/// the generic ones. Results do not depend on the number of threads. The threads are a pool of the
/// backend's own, which copies share (detail/core/thread_pool.hpp says what holds for them): OpenMP only
/// tells how many.
class OpenMPBackend : public HostMemory {
 public:
  /// `threads` = 0 takes OpenMP's default (OMP_NUM_THREADS), without OpenMP the number of cores.
  explicit OpenMPBackend(int threads = 0)
      : threads_(threads > 0 ? threads : default_threads()),
        pool_(threads_ > 1 ? std::make_shared<ThreadPool>(threads_) : nullptr) {}

  /// Number of threads.
  int threads() const noexcept { return threads_; }
  /// How many items the backend works on at a time.
  std::size_t concurrency() const noexcept { return static_cast<std::size_t>(threads_); }

  /// Optional member: batches of cameras go by whole frames, each on one thread.
  OpenMPBackend one_thread() const { return OpenMPBackend(1); }

  /// An exception that leaves f on more than one thread ends the process.
  template <class F>
  void parallel_for(std::size_t n, const F& f) {
    if (threads_ < 2 || n < 2) {
      for (std::size_t i = 0; i < n; ++i) f(i);
      return;
    }
    // Pieces are handed out as threads come free: work items differ in cost.
    const std::size_t piece = n / (concurrency() * 32) + 1;
    pool_->run(static_cast<std::uint32_t>((n + piece - 1) / piece), [&f, n, piece](std::uint32_t p) {
      const std::size_t begin = p * piece, end = std::min(n, begin + piece);
      for (std::size_t i = begin; i < end; ++i) f(i);
    });
  }
  /// Waits until all work of the backend is done. Errors: as of the device.
  Status synchronize() { return {}; }

  // Stages in lanes (core/stages.hpp).
  /// Runs a stage with SIMD kernels on all threads.
  void run(stage::Project, const ViewedSet<float>& args, const ProjectOutputs<float>& out) {
    const auto kernel = lane_kernels().project_chunk;
    parallel_for(args.chunk_count(), [&args, &out, kernel](std::size_t c) { kernel(args, out, c); });
  }
  /// Some of the chunks. Leaves out what reaches no open cell (ProjectOutputs::open).
  void run(stage::Project, const ViewedSet<float>& args, const ProjectOutputs<float>& out,
           View<const std::uint32_t> chunks) {
    const auto kernel = lane_kernels().project_chunk;
    parallel_for(chunks.size,
                 [&args, &out, chunks, kernel](std::size_t i) { kernel(args, out, chunks[i]); });
  }
  static constexpr bool bins_in_lanes = true;  ///< Says that this backend bins splats with SIMD kernels.
  void run(stage::Each, std::size_t n, const CountTileIntersections<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().count_tiles});
  }
  void run(stage::Each, std::size_t n, const CountTileIntersections<float, MeshCull<float>>& k) {
    parallel_for(n, Compiled{k, lane_kernels().count_tiles_before_mesh});
  }
  void run(stage::Each, std::size_t n, const ScatterTileIntersections<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().scatter_tiles});
  }
  void run(stage::Each, std::size_t n, const ScatterTileIntersections<float, MeshCull<float>>& k) {
    parallel_for(n, Compiled{k, lane_kernels().scatter_tiles_before_mesh});
  }
  void run(stage::Blend, const RasterArgs<float>& args) {
    parallel_for(args.grid.count(), Compiled{args, lane_kernels().rasterize_tile});
  }
  void run(stage::BlendWithMeshes, const RasterArgs<float>& args) {
    parallel_for(args.grid.count(), Compiled{args, lane_kernels().composite_tile});
  }
  void run(stage::Each, std::size_t n, const ProjectMeshVertices<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().project_mesh_vertices});
  }
  void run(stage::Each, std::size_t n, const CountMeshTriangles<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().count_mesh_triangles});
  }
  void run(stage::Each, std::size_t n, const WriteMeshTriangles<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().write_mesh_triangles});
  }
  void run(stage::Each, std::size_t n, const RasterizeMeshTile<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().rasterize_mesh_tile});
  }
  void run(stage::Each, std::size_t n, const ShadeMeshRow<float>& k) {
    parallel_for(n, Compiled{k, lane_kernels().shade_mesh_row});
  }
  void run(stage::Skin, const SkinningArgs<float>& args) { in_ranges(args, lane_kernels().skin_range); }
  void run(stage::CapsuleGaps, const CapsuleGapArgs<float>& args) {
    in_ranges(args, lane_kernels().gap_range);
  }
  void run(stage::SweepCapsules, const SweepArgs<float>& args) {
    in_ranges(args, lane_kernels().sweep_range);
  }

 private:
  /// A kernel as it was compiled for the processor's lanes.
  template <class Args>
  struct Compiled {
    const Args& args;
    void (*kernel)(const Args&, std::size_t) noexcept;
    void operator()(std::size_t i) const noexcept { kernel(args, i); }
  };
  template <class Args>
  Compiled(const Args&, void (*)(const Args&, std::size_t) noexcept) -> Compiled<Args>;

  /// kernel(args, begin, end) over all of args.size().
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
// Compiled in gsnav::openmp: whoever renders or skins need not.
extern template Status render_camera<float, OpenMPBackend>(OpenMPBackend&,
                                                           RenderWorkspace<float, OpenMPBackend>&,
                                                           std::span<const GaussianSet>, const Camera&,
                                                           const RenderConfig&,
                                                           const FrameImages<float>&, RenderStats*);
extern template Status draw_frame<float, OpenMPBackend>(OpenMPBackend&,
                                                        RenderWorkspace<float, OpenMPBackend>&,
                                                        std::span<const GaussianSet>, const MeshFrame&,
                                                        const Camera&, const RenderConfig&,
                                                        const FrameImages<float>&, RenderStats*);
extern template Status render_camera<double, OpenMPBackend>(OpenMPBackend&,
                                                            RenderWorkspace<double, OpenMPBackend>&,
                                                            std::span<const GaussianSet>, const Camera&,
                                                            const RenderConfig&,
                                                            const FrameImages<double>&, RenderStats*);
extern template Status draw_frame<double, OpenMPBackend>(OpenMPBackend&,
                                                         RenderWorkspace<double, OpenMPBackend>&,
                                                         std::span<const GaussianSet>, const MeshFrame&,
                                                         const Camera&, const RenderConfig&,
                                                         const FrameImages<double>&, RenderStats*);
extern template Status skin_gaussians<float, OpenMPBackend, float>(OpenMPBackend&,
                                                                   const SkinningArgs<float>&);
extern template Status skin_all<float, OpenMPBackend, float>(OpenMPBackend&,
                                                             std::span<const SkinningArgs<float>>);
#endif

}  // namespace gsnav
