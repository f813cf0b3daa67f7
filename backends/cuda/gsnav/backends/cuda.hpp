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
#include "gsnav/detail/sweep/first_impacts.hpp"
#include "gsnav/render/render.hpp"
#include "gsnav/skin/skin.hpp"

struct CUevent_st;
struct CUstream_st;

namespace gsnav {

namespace cuda {
class PinnedRing;

/// The cubic of `fast` saves a CPU work; a GPU has an instruction that is faster yet and as good as
/// degree 5.
constexpr Exp2 device_exp2(Exp2 asked) noexcept {
  return asked == Exp2::degree3 ? Exp2::hardware : asked;
}
}  // namespace cuda

class CudaBatchRenderer;

/// Device memory of one GPU.
struct CudaSpace {};

/// Runs on one NVIDIA GPU, by the same kernels as the CPU: keys and footprints, and float32 images of
/// the profile `exact`, have the CPU's bits; images of `fast` differ by the CPU's exponential
/// (docs/notes/cuda.md). Work goes to one stream in order. Link gsnav::cuda; the header itself needs no
/// CUDA.
///
/// A call that the driver refuses is remembered and reported by the next `synchronize()`; what was asked
/// for after it is not done.
class CudaBackend {
 public:
  using memory_space = CudaSpace;  ///< Where buffers of this backend are: memory of the GPU.
  /// What draws many cameras at once (optional member; gsnav/backends/cuda/batch.hpp, included below).
  using batch_renderer = CudaBatchRenderer;

  /// GPUs that the driver shows; 0 where there is no driver.
  static int device_count() noexcept;

  /// `device`: in [0, device_count()). `stream`: the caller's cudaStream_t, or null for one of its own.
  /// Throws gsnav::Error (backend_failure, invalid_argument) naming the device and what the driver said.
  explicit CudaBackend(int device = 0, CUstream_st* stream = nullptr);
  ~CudaBackend();
  CudaBackend(const CudaBackend&) = delete;
  CudaBackend& operator=(const CudaBackend&) = delete;

  /// Allocates device memory. Throws std::bad_alloc if there is not enough.
  void* allocate(std::size_t bytes, std::size_t align);
  void deallocate(void* p, std::size_t bytes) noexcept;  ///< Frees memory of allocate().
  /// Page-locked host memory; null where there is none.
  static void* allocate_host(std::size_t bytes) noexcept;
  static void deallocate_host(void* p) noexcept;  ///< Frees memory of allocate_host().
  /// Copies to the device of up to 1 MiB never wait for the stream, and what is copied may change at
  /// once. Others return early only from and to pinned memory.
  void copy(void* dst, const void* src, std::size_t bytes, CopyKind kind);
  /// Sets every byte of device memory, in order with the stream.
  void fill(void* p, unsigned char byte, std::size_t bytes);
  /// Defined where nvcc compiles (backends/cuda/device.cuh).
  template <class F>
  void parallel_for(std::size_t n, const F& f);
  Status synchronize();  ///< Waits until all work of the backend is done. Errors: as of the device.

  /// How many items the backend works on at a time.
  std::size_t concurrency() const noexcept { return 1; }
  /// Number of the GPU.
  int device() const noexcept { return device_; }
  /// The CUDA stream that all work goes to.
  CUstream_st* stream() const noexcept { return stream_; }
  /// What the consumer's stream is given from now on waits for what this one has been given so far; the
  /// host does not wait. For handing images over without a copy.
  void hand_over_to(CUstream_st* consumer);
  std::string device_name() const;  ///< Name of the GPU, as its driver reports it.

  /// Sorts pairs by key on the GPU, stably. Returns whether the result is in the alternative arrays.
  bool sort_pairs(std::uint32_t* keys, std::uint32_t* values, std::uint32_t* keys_alt,
                  std::uint32_t* values_alt, std::size_t n, int bits);

  // Stages by kernels of its own (core/stages.hpp).
  /// Runs a stage on the GPU, in order with the stream.
  void run(stage::Project, const ViewedSet<float>& args, const ProjectOutputs<float>& out);
  void run(stage::CountTiles, const BinArgs<float>& args, const NoCull& cull);
  void run(stage::CountTiles, const BinArgs<float>& args, const MeshCull<float>& cull);
  void run(stage::ScatterTiles, const BinArgs<float>& args, const NoCull& cull);
  void run(stage::ScatterTiles, const BinArgs<float>& args, const MeshCull<float>& cull);
  void run(stage::Blend, const RasterArgs<float>& args);
  void run(stage::BlendWithMeshes, const RasterArgs<float>& args);
  void run(stage::RasterizeMesh, const MeshRasterArgs<float>& args);
  void run(stage::Each, std::size_t chunks, const ProjectMeshVertices<float>& k);
  void run(stage::Each, std::size_t chunks, const CountMeshTriangles<float>& k);
  void run(stage::Each, std::size_t one, const ScanMeshTriangles<float>& k);
  void run(stage::Each, std::size_t chunks, const WriteMeshTriangles<float>& k);
  void run(stage::Each, std::size_t rows, const ShadeMeshRow<float>& k);
  void run(stage::Skin, const SkinningArgs<float>& args) { run(stage::SkinAll{}, std::span(&args, 1)); }
  /// One launch for all of four influences, one for all of eight.
  void run(stage::SkinAll, std::span<const SkinningArgs<float>> avatars);

 private:
  bool usable() const noexcept { return error_ == 0; }
  void note(int error, const char* what) noexcept;
  void* scratch(int slot, std::size_t bytes);
  template <class Cull>
  void list(const BinArgs<float>& args, const Cull& cull);
  template <class Cull>
  void scatter(const BinArgs<float>& args, const Cull& cull);

  /// Scratch that outlives a call, by use.
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
  CUevent_st* handed_over_ = nullptr;
};

static_assert(Backend<CudaBackend>);

#if !defined(__CUDACC__)
// Compiled in gsnav::cuda: what a host compiler cannot.
extern template Status render_camera<float, CudaBackend>(CudaBackend&,
                                                         RenderWorkspace<float, CudaBackend>&,
                                                         std::span<const GaussianSet>, const Camera&,
                                                         const RenderConfig&, const FrameImages<float>&,
                                                         RenderStats*);
extern template Status draw_frame<float, CudaBackend>(CudaBackend&, RenderWorkspace<float, CudaBackend>&,
                                                      std::span<const GaussianSet>, const MeshFrame&,
                                                      const Camera&, const RenderConfig&,
                                                      const FrameImages<float>&, RenderStats*);
extern template Status detail::render_frame<float, CudaBackend>(
    CudaBackend&, RenderWorkspace<float, CudaBackend>&, std::span<const GaussianSet>, const Camera&,
    const RenderConfig&, const MeshLayer<float>&, const FrameImages<float>&, RenderStats&);
extern template Status draw_meshes<float, CudaBackend>(CudaBackend&, MeshWorkspace<float, CudaBackend>&,
                                                       std::span<const MeshInstance>, const Camera&,
                                                       const MeshLight&, int, bool, MeshImages<float>,
                                                       MeshStats*);
extern template Status skin_gaussians<float, CudaBackend, float>(CudaBackend&,
                                                                 const SkinningArgs<float>&);
extern template Status skin_all<float, CudaBackend, float>(CudaBackend&,
                                                           std::span<const SkinningArgs<float>>);
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
