// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <functional>

#include "gsnav/backends/cuda/device.cuh"
#include "gsnav/backends/cuda/pinned.hpp"
#include "gsnav/detail/core/host_threads.hpp"
#include "pinned_ring.cuh"

namespace gsnav {

namespace {

/// Counts the tiles that each visible splat intersects, and the splats of each tile.
template <class Cull>
struct CountSplatTiles {
  BinArgs<float> args;
  Cull cull;
  std::uint32_t* per_splat;
  std::uint32_t* per_tile;
  __device__ void operator()(std::size_t i) const {
    const std::uint32_t splat = args.order[i];
    std::uint32_t n = 0;
    for_each_tile(args, splat, [&](std::size_t tile) {
      if (cull.hides(tile, splat)) return;
      atomicAdd(per_tile + tile, 1u);  // Order does not matter for a sum of ones.
      ++n;
    });
    per_splat[i] = n;
  }
};

/// Writes (tile, splat) pairs in depth order. A stable sort by tile then gives the lists.
template <class Cull>
struct EmitSplatTiles {
  BinArgs<float> args;
  Cull cull;
  const std::uint64_t* offsets;
  std::uint32_t* tiles;
  std::uint32_t* splats;
  __device__ void operator()(std::size_t i) const {
    const std::uint32_t splat = args.order[i];
    std::uint64_t at = offsets[i];
    for_each_tile(args, splat, [&](std::size_t tile) {
      if (cull.hides(tile, splat)) return;
      tiles[at] = static_cast<std::uint32_t>(tile);
      splats[at++] = splat;
    });
  }
};

std::string describe(int device, int error, const char* what) {
  return std::string("CUDA device ") + std::to_string(device) + ": " + what +
         " failed: " + cudaGetErrorString(static_cast<cudaError_t>(error));
}

}  // namespace

void* cuda::allocate_pinned(std::size_t bytes) noexcept {
  void* p = nullptr;
  if (cudaMallocHost(&p, bytes) == cudaSuccess) return p;
  cudaGetLastError();
  return nullptr;
}
void cuda::free_pinned(void* p) noexcept { cudaFreeHost(p); }

int CudaBackend::device_count() noexcept {
  int n = 0;
  if (cudaGetDeviceCount(&n) != cudaSuccess) {
    cudaGetLastError();
    return 0;
  }
  return n;
}

CudaBackend::CudaBackend(int device, CUstream_st* stream) : stream_(stream), device_(device) {
  const int count = device_count();
  if (count == 0) {
    detail::fail(Errc::backend_failure,
                 "CUDA: no device; install a driver for this GPU, or use the openmp backend");
  }
  if (device < 0 || device >= count) {
    detail::fail(Errc::invalid_argument, std::string("CudaBackend: device = ") + std::to_string(device) +
                                             ": must be in [0, " + std::to_string(count) + ")");
  }
  const auto need = [&](cudaError_t e, const char* what) {
    if (e != cudaSuccess) detail::fail(Errc::backend_failure, describe(device, e, what));
  };
  need(cudaSetDevice(device), "cudaSetDevice");
  if (stream_ == nullptr) {
    need(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate");
    owns_stream_ = true;
  }
  // Keep freed memory for the next frame.
  cudaMemPool_t pool;
  need(cudaDeviceGetDefaultMemPool(&pool, device), "cudaDeviceGetDefaultMemPool");
  std::uint64_t keep = ~std::uint64_t{0};
  need(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keep), "cudaMemPoolSetAttribute");
  uploads_ = std::make_unique<cuda::PinnedRing>();
  host_threads_ = std::make_unique<ThreadPool>(threads_of_machine());
}

CudaBackend::~CudaBackend() {
  for (Block& b : scratch_) {
    if (b.data != nullptr) cudaFreeAsync(b.data, stream_);
  }
  cudaStreamSynchronize(stream_);
  if (handed_over_ != nullptr) cudaEventDestroy(handed_over_);
  if (owns_stream_) cudaStreamDestroy(stream_);
}

void CudaBackend::note(int error, const char* what) noexcept {
  if (error_ == 0 && error != cudaSuccess) {
    error_ = error;
    failed_ = what;
  }
}

std::string CudaBackend::device_name() const {
  cudaDeviceProp properties;
  return cudaGetDeviceProperties(&properties, device_) == cudaSuccess ? properties.name : "unknown";
}

void* CudaBackend::allocate(std::size_t bytes, std::size_t) {
  void* p = nullptr;
  if (!usable() || cudaMallocAsync(&p, bytes, stream_) != cudaSuccess) {
    cudaGetLastError();  // The caller reports that memory is exhausted.
    return nullptr;
  }
  return p;
}

void CudaBackend::deallocate(void* p, std::size_t) noexcept { cudaFreeAsync(p, stream_); }
void* CudaBackend::allocate_host(std::size_t bytes) noexcept { return cuda::allocate_pinned(bytes); }
void CudaBackend::deallocate_host(void* p) noexcept { cuda::free_pinned(p); }

void CudaBackend::copy(void* dst, const void* src, std::size_t bytes, CopyKind kind) {
  if (bytes == 0 || !usable()) return;
  if (kind == CopyKind::host_to_device && bytes <= cuda::PinnedRing::kMaxBytes) {
    return note(uploads_->send(dst, src, bytes, stream_), "a copy");
  }
  const cudaMemcpyKind kinds[] = {cudaMemcpyHostToHost, cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost,
                                  cudaMemcpyDeviceToDevice};
  note(cudaMemcpyAsync(dst, src, bytes, kinds[static_cast<int>(kind)], stream_), "a copy");
}

void CudaBackend::fill(void* p, unsigned char byte, std::size_t bytes) {
  if (bytes != 0 && usable()) note(cudaMemsetAsync(p, byte, bytes, stream_), "a fill");
}

Status CudaBackend::synchronize() {
  if (usable()) note(cudaStreamSynchronize(stream_), "work on the stream");
  if (usable()) return {};
  return {Errc::backend_failure, describe(device_, error_, failed_)};
}

void CudaBackend::hand_over_to(CUstream_st* consumer) {
  if (!usable()) return;
  if (handed_over_ == nullptr)
    note(cudaEventCreateWithFlags(&handed_over_, cudaEventDisableTiming), "an event");
  if (usable()) note(cudaEventRecord(handed_over_, stream_), "an event");
  if (usable()) note(cudaStreamWaitEvent(consumer, handed_over_), "a wait between streams");
}

void* CudaBackend::scratch(int slot, std::size_t bytes) {
  Block& b = scratch_[slot];
  if (bytes > b.bytes) {
    if (b.data != nullptr) cudaFreeAsync(b.data, stream_);
    b.bytes = bytes + bytes / 8;
    b.data = allocate(b.bytes, 256);
    if (b.data == nullptr) {
      b.bytes = 0;
      detail::fail(Errc::out_of_memory,
                   std::string("CUDA: cannot allocate ") + std::to_string(bytes) + " bytes of scratch");
    }
  }
  return b.data;
}

bool CudaBackend::sort_pairs(std::uint32_t* keys, std::uint32_t* values, std::uint32_t* keys_alt,
                             std::uint32_t* values_alt, std::size_t n, int bits) {
  if (!usable()) return false;
  cub::DoubleBuffer<std::uint32_t> k(keys, keys_alt), v(values, values_alt);
  std::size_t bytes = 0;
  note(cub::DeviceRadixSort::SortPairs(nullptr, bytes, k, v, n, 0, bits, stream_), "a sort");
  void* temp = scratch(kCubTemp, bytes);
  note(cub::DeviceRadixSort::SortPairs(temp, bytes, k, v, n, 0, bits, stream_), "a sort");
  return k.Current() == keys_alt;
}

template <class Cull>
void CudaBackend::list(const BinArgs<float>& args, const Cull& cull) {
  if (!usable()) return;
  const std::size_t tiles = args.grid.count(), n = args.order.size;
  auto* per_splat = static_cast<std::uint32_t*>(scratch(kPerSplat, (n + 1) * sizeof(std::uint32_t)));
  auto* per_tile = static_cast<std::uint32_t*>(scratch(kPerTile, (tiles + 1) * sizeof(std::uint32_t)));
  auto* offsets = static_cast<std::uint64_t*>(scratch(kSplatOffsets, (n + 1) * sizeof(std::uint64_t)));
  fill(per_splat + n, 0, sizeof(std::uint32_t));
  fill(per_tile, 0, (tiles + 1) * sizeof(std::uint32_t));
  parallel_for(n, CountSplatTiles<Cull>{args, cull, per_splat, per_tile});
  const auto scan = [&](const std::uint32_t* counts, std::uint64_t* out, std::size_t count) {
    std::size_t bytes = 0;
    note(cub::DeviceScan::ExclusiveScan(nullptr, bytes, counts, out, ::cuda::std::plus<>{},
                                        std::uint64_t{0}, count, stream_),
         "a scan");
    void* temp = scratch(kCubTemp, bytes);
    note(cub::DeviceScan::ExclusiveScan(temp, bytes, counts, out, ::cuda::std::plus<>{},
                                        std::uint64_t{0}, count, stream_),
         "a scan");
  };
  scan(per_splat, offsets, n + 1);
  scan(per_tile, args.tile_offsets.data, tiles + 1);
}

template <class Cull>
void CudaBackend::scatter(const BinArgs<float>& args, const Cull& cull) {
  const std::size_t pairs = args.tile_splats.size;
  if (!usable() || pairs == 0) return;
  auto* tiles = static_cast<std::uint32_t*>(scratch(kPairTiles, 2 * pairs * sizeof(std::uint32_t)));
  auto* splats = static_cast<std::uint32_t*>(scratch(kPairSplats, pairs * sizeof(std::uint32_t)));
  const auto* offsets = static_cast<const std::uint64_t*>(scratch_[kSplatOffsets].data);
  parallel_for(args.order.size, EmitSplatTiles<Cull>{args, cull, offsets, tiles, splats});
  const int bits = std::bit_width(args.grid.count() - 1) + (args.grid.count() == 1 ? 1 : 0);
  std::size_t bytes = 0;
  note(cub::DeviceRadixSort::SortPairs(nullptr, bytes, tiles, tiles + pairs, splats,
                                       args.tile_splats.data, pairs, 0, bits, stream_),
       "a sort");
  void* temp = scratch(kCubTemp, bytes);
  note(cub::DeviceRadixSort::SortPairs(temp, bytes, tiles, tiles + pairs, splats, args.tile_splats.data,
                                       pairs, 0, bits, stream_),
       "a sort");
}

void CudaBackend::run(stage::CountTiles, const BinArgs<float>& args, const NoCull& cull) {
  list(args, cull);
}
void CudaBackend::run(stage::CountTiles, const BinArgs<float>& args, const MeshCull<float>& cull) {
  list(args, cull);
}
void CudaBackend::run(stage::ScatterTiles, const BinArgs<float>& args, const NoCull& cull) {
  scatter(args, cull);
}
void CudaBackend::run(stage::ScatterTiles, const BinArgs<float>& args, const MeshCull<float>& cull) {
  scatter(args, cull);
}

GSNAV_FRAME_FUNCTIONS(, float, CudaBackend);
GSNAV_SKIN_FUNCTIONS(, CudaBackend);
template void run<CudaBackend, stage::Project>(CudaBackend&, stage::Project, const ViewedSet<float>&,
                                               const ProjectOutputs<float>&);
template void run<CudaBackend, stage::Blend>(CudaBackend&, stage::Blend, const RasterArgs<float>&);
template void CudaBackend::parallel_for<CutDepth>(std::size_t, const CutDepth&);

}  // namespace gsnav
