// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include <cub/block/block_scan.cuh>

#include "gsnav/backends/cuda.hpp"
#include "gsnav/backends/cuda/policy.hpp"

// Device code of gsnav::cuda: the library's kernels in loops that suit a GPU.

namespace gsnav {
namespace cuda {

template <class F>
__global__ void for_each(std::size_t n, const F f) {
  const std::size_t i = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < n) f(i);
}

inline constexpr int kProjectThreads = policy::Stages::kProjectThreads;

/// Projects one chunk per block. Gaussians are projected in parallel, and visible ones are packed in
/// order by a block scan.
static __global__ void __launch_bounds__(kProjectThreads)
    project_kernel(const ViewedSet<float> args, const ProjectOutputs<float> out) {
  using Scan = cub::BlockScan<std::uint32_t, kProjectThreads>;
  __shared__ typename Scan::TempStorage storage;
  const std::size_t chunk = blockIdx.x, id = args.selection.chunk_id(chunk),
                    size = args.gaussians.size();
  const std::size_t begin = id * kProjectChunk;
  const std::size_t end = begin + kProjectChunk < size ? begin + kProjectChunk : size;
  const std::size_t base = (args.first_chunk + chunk) * kProjectChunk;
  std::uint32_t written = 0;
  const std::uint32_t parts = candidate_parts(args, chunk);
  const SeenRows seen = parts != 0 ? args.seen_rows(id) : SeenRows{};
  for (std::size_t first = begin; first < end && parts != 0; first += kProjectThreads) {
    const std::size_t i = first + threadIdx.x;
    RowSplat<float> row;
    const bool keep = i < end && (parts >> ((i - begin) / kChunkPart) & 1u) != 0 &&
                      seen.has(i - begin) && project_row(args, !out.depths.empty(), i, row);
    std::uint32_t at = 0, total = 0;
    Scan(storage).ExclusiveSum(keep ? 1u : 0u, at, total);
    if (keep) write_splat(args, out, base + written + at, i, row);
    written += total;
    __syncthreads();
  }
  if (threadIdx.x == 0) out.counts[args.first_chunk + chunk] = written;
}

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

inline constexpr int kRasterBatch = policy::Stages::kBlendChunk;

/// Blends one tile per block and one pixel per thread. Splats are staged in shared memory in batches.
/// `Mesh`: the frame has a mesh.
template <bool Color, DepthMode D, Exp2 M, bool General, bool Mesh>
__global__ void __launch_bounds__(1024) rasterize_kernel(const RasterArgs<float> args) {
  __shared__ SplatGeometry<float> geometry[kRasterBatch];
  __shared__ SplatColor<float> colors[Color ? kRasterBatch : 1];
  __shared__ std::uint32_t ids[kRasterBatch];
  const TileGrid& grid = args.grid;
  const int ts = grid.tile_size, threads = ts * ts, t = static_cast<int>(threadIdx.x);
  const int x = static_cast<int>(blockIdx.x) % grid.columns * ts + t % ts;
  const int y = static_cast<int>(blockIdx.x) / grid.columns * ts + t / ts;
  const bool inside = x < grid.width && y < grid.height;
  const float px = static_cast<float>(x) + 0.5f, py = static_cast<float>(y) + 0.5f;
  const std::size_t pixel =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(x);
  const float mesh = Mesh && inside ? args.mesh.depth[pixel] : 0;
  BlendState<float, D> state;
  bool open = inside;
  const std::uint64_t end = args.tile_offsets[blockIdx.x + 1];
  for (std::uint64_t first = args.tile_offsets[blockIdx.x]; first < end; first += kRasterBatch) {
    if (__syncthreads_count(open ? 1 : 0) == 0) break;
    const int n = end - first < kRasterBatch ? static_cast<int>(end - first) : kRasterBatch;
    for (int j = t; j < n; j += threads) {
      const std::uint32_t id = args.tile_splats[first + static_cast<std::uint64_t>(j)];
      ids[j] = id;
      geometry[j] = args.geometry[id];
      if constexpr (Color) colors[j] = args.colors[id];
    }
    __syncthreads();
    for (int j = 0; open && j < n; ++j) {
      const SplatRecords<float> splat{
          geometry + j, Color ? colors + j : nullptr,
          D == DepthMode::none && !Mesh ? nullptr : args.depths.data + ids[j],
          args.perspectives.empty() ? nullptr : args.perspectives.data + ids[j]};
      if constexpr (Mesh) {
        composite_splat<Color, D, M, General>(state, args.rules, splat, mesh, px, py);
      } else {
        blend_splat<Color, D, M, General>(state, args.rules, splat, px, py);
      }
      open = state.open(args.rules);
    }
  }
  if (!inside) return;
  if constexpr (Mesh) close_by_mesh<Color>(state, args.rules, args.mesh, pixel);
  write_pixel(args, pixel, state);
}

}  // namespace cuda

template <class F>
void CudaBackend::parallel_for(std::size_t n, const F& f) {
  if (n == 0 || !usable()) return;
  constexpr unsigned kThreads = cuda::policy::Stages::kEachThreads;
  const std::size_t blocks = (n + kThreads - 1) / kThreads;
  if (blocks > 0x7fffffffu)
    return note(cudaErrorInvalidConfiguration, "a launch of too many work items");
  cuda::for_each<F><<<static_cast<unsigned>(blocks), kThreads, 0, stream_>>>(n, f);
  note(cudaGetLastError(), "a kernel launch");
}

}  // namespace gsnav
