// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/cut_depth.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/render/draw_frame.hpp"
#include "gsnav/detail/render/instantiate.hpp"
#include "gsnav/detail/sweep/first_impacts.hpp"
#include "gsnav/render/render.hpp"
#include "gsnav/skin/skin.hpp"

struct CUevent_st;
struct CUstream_st;

namespace gsnav {

namespace cuda {
class PinnedRing;

/// Exponential that device kernels use. The cubic of `fast` saves time on a CPU. On a GPU the hardware
/// instruction is faster, and as accurate as degree 5.
constexpr Exp2 device_exp2(Exp2 asked) noexcept {
  return asked == Exp2::degree3 ? Exp2::hardware : asked;
}
}  // namespace cuda

class CudaBatchRenderer;
class ThreadPool;

/// Memory space of one GPU.
struct CudaSpace {};

/// Backend for one NVIDIA GPU.
/// It uses the same kernels as the CPU. Keys, footprints, and float32 images of the profile `exact` are
/// bit-identical to those of the CPU. Images of `fast` differ by the CPU's exponential
/// (docs/notes/cuda.md). All work goes to one stream, in order. Link gsnav::cuda; the header itself does
/// not need CUDA.
///
/// If the driver rejects a call, the next `synchronize()` returns the error. Later calls before that do
/// nothing.
class CudaBackend {
 public:
  /// Memory of the backend's arrays.
  using memory_space = CudaSpace;
  /// Renderer for many cameras at once (optional member of a backend). Defined in
  /// gsnav/backends/cuda/batch.hpp, which is included below.
  using batch_renderer = CudaBatchRenderer;

  /// Number of GPUs that the driver reports. 0 if there is no driver.
  static int device_count() noexcept;

  /// Opens a GPU. Throws gsnav::Error (backend_failure or invalid_argument) with the device and the
  /// driver's message.
  /// @param device Index in [0, device_count()).
  /// @param stream The caller's cudaStream_t, or null for a stream of its own.
  explicit CudaBackend(int device = 0, CUstream_st* stream = nullptr);
  /// Waits for the work and frees the resources.
  ~CudaBackend();
  CudaBackend(const CudaBackend&) = delete;
  CudaBackend& operator=(const CudaBackend&) = delete;

  /// Allocates device memory. Returns null if there is not enough.
  void* allocate(std::size_t bytes, std::size_t align);
  /// Frees device memory.
  void deallocate(void* p, std::size_t bytes) noexcept;
  /// Allocates page-locked host memory. Returns null if there is none.
  static void* allocate_host(std::size_t bytes) noexcept;
  /// Frees memory from allocate_host().
  static void deallocate_host(void* p) noexcept;
  /// Copies between host and device, in stream order. A copy of up to 1 MiB to the device never waits
  /// for the stream, and its source may change as soon as the call returns. Other copies return early
  /// only for pinned host memory.
  void copy(void* dst, const void* src, std::size_t bytes, CopyKind kind);
  /// Sets bytes of device memory, in stream order.
  void fill(void* p, unsigned char byte, std::size_t bytes);
  /// Calls f(i) for i in [0, n) on the GPU. Defined in backends/cuda/device.cuh, for nvcc only.
  template <class F>
  void parallel_for(std::size_t n, const F& f);
  /// Waits for the stream.
  /// @return backend_failure if a call since the last synchronize() failed.
  Status synchronize();

  /// Exponential of its kernels that blend.
  static constexpr Exp2 exp2_of(Exp2 asked) noexcept { return cuda::device_exp2(asked); }
  /// Number of pieces into which callers should divide work.
  std::size_t concurrency() const noexcept { return 1; }
  /// Index of the GPU.
  int device() const noexcept { return device_; }
  /// The stream that all work goes to.
  CUstream_st* stream() const noexcept { return stream_; }
  /// Makes all later work on the consumer's stream wait for the work submitted here so far. The host
  /// does not wait. Use it to hand over images without a copy.
  void hand_over_to(CUstream_st* consumer);
  /// Threads for the host's part of the work, one per core. They start with the first job.
  ThreadPool& host_threads() noexcept { return *host_threads_; }
  /// Name of the GPU.
  std::string device_name() const;

  /// Sorts pairs by the lowest `bits` bits of the key, stable. Arrays have n elements in device memory.
  /// @return true if the result is in the alternate arrays, false if it is in `keys` and `values`.
  bool sort_pairs(std::uint32_t* keys, std::uint32_t* values, std::uint32_t* keys_alt,
                  std::uint32_t* values_alt, std::size_t n, int bits);

  // Stages with their own kernels (core/stages.hpp).
  /// Counts the splats of each tile.
  void run(stage::CountTiles, const BinArgs<float>& args, const NoCull& cull);
  /// Counts the splats of each tile that are not behind a mesh.
  void run(stage::CountTiles, const BinArgs<float>& args, const MeshCull<float>& cull);
  /// Writes the splats to the lists of their tiles.
  void run(stage::ScatterTiles, const BinArgs<float>& args, const NoCull& cull);
  /// Writes the splats that are not behind a mesh to the lists of their tiles.
  void run(stage::ScatterTiles, const BinArgs<float>& args, const MeshCull<float>& cull);
  /// Rasterizes the triangles of meshes.
  void run(stage::RasterizeMesh, const MeshRasterArgs<float>& args);
  /// Projects the vertices of meshes.
  void run(stage::Each, std::size_t chunks, const ProjectMeshVertices<float>& k);
  /// Counts the pieces of triangles in each chunk.
  void run(stage::Each, std::size_t chunks, const CountMeshTriangles<float>& k);
  /// Computes the index of each chunk's first piece.
  void run(stage::Each, std::size_t one, const ScanMeshTriangles<float>& k);
  /// Writes the pieces of triangles in each chunk.
  void run(stage::Each, std::size_t chunks, const WriteMeshTriangles<float>& k);
  /// Shades rows of pixels of meshes.
  void run(stage::Each, std::size_t rows, const ShadeMeshRow<float>& k);
  /// Skins one avatar.
  void run(stage::Skin, const SkinningArgs<float>& args) { run(stage::SkinAll{}, std::span(&args, 1)); }
  /// Skins several avatars: one launch for all with four influences, one for all with eight.
  void run(stage::SkinAll, std::span<const SkinningArgs<float>> avatars);

 private:
  bool usable() const noexcept { return error_ == 0; }
  void note(int error, const char* what) noexcept;
  void* scratch(int slot, std::size_t bytes);
  template <class Cull>
  void list(const BinArgs<float>& args, const Cull& cull);
  template <class Cull>
  void scatter(const BinArgs<float>& args, const Cull& cull);

  /// Uses of scratch memory that persists between calls.
  enum Slot {
    kCubTemp,
    kPerSplat,
    kPerTile,
    kSplatOffsets,
    kPairTiles,
    kPairSplats,
    kSkinJobs,
    kMeshPixels,
    kMeshLarge,
    kScratchSlots
  };
  struct Block {
    void* data = nullptr;
    std::size_t bytes = 0;
  };
  CUstream_st* stream_ = nullptr;
  int device_ = 0;
  bool owns_stream_ = false;
  int error_ = 0;
  const char* failed_ = "";
  Block scratch_[kScratchSlots];
  std::unique_ptr<cuda::PinnedRing> uploads_;
  std::unique_ptr<ThreadPool> host_threads_;
  CUevent_st* handed_over_ = nullptr;
};

static_assert(Backend<CudaBackend>);

#if !defined(__CUDACC__)
// Templates compiled into gsnav::cuda, because a host compiler cannot compile them.
GSNAV_FRAME_FUNCTIONS(extern, float, CudaBackend);
GSNAV_SKIN_FUNCTIONS(extern, CudaBackend);
extern template void run<CudaBackend, stage::Project>(CudaBackend&, stage::Project,
                                                      const ViewedSet<float>&,
                                                      const ProjectOutputs<float>&);
extern template void run<CudaBackend, stage::Blend>(CudaBackend&, stage::Blend,
                                                    const RasterArgs<float>&);
extern template void CudaBackend::parallel_for<CutDepth>(std::size_t, const CutDepth&);
extern template Status capsule_gaps<CudaBackend, float>(CudaBackend&, const CapsuleGapArgs<float>&);
extern template Status capsule_gaps<CudaBackend, double>(CudaBackend&, const CapsuleGapArgs<double>&);
extern template Status sweep_capsules<CudaBackend, float>(CudaBackend&, const SweepArgs<float>&);
extern template Status sweep_capsules<CudaBackend, double>(CudaBackend&, const SweepArgs<double>&);
extern template Status first_impacts<float, CudaBackend>(CudaBackend&, const FirstImpactArgs<float>&);
extern template Status first_impacts<double, CudaBackend>(CudaBackend&, const FirstImpactArgs<double>&);
#endif

}  // namespace gsnav

#include "gsnav/backends/cuda/batch.hpp"
