// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cub/block/block_reduce.cuh>
#include <cub/block/block_scan.cuh>

#include "gsnav/backends/cuda/device.cuh"

// Meshes on the device (docs/composition.md): the kernels of the CPU, a vertex, a triangle or a pixel a thread. Which
// triangle a pixel shows is found without lists of tiles: the largest of (1/z, first triangle) in one atomic word.

namespace gsnav {

namespace cuda {

namespace {

constexpr unsigned kThreads = kMeshChunk;  ///< of a block that takes a chunk
constexpr unsigned kScanThreads = 1024;
constexpr int kSmallBox = 8;               ///< a thread draws triangles of up to kSmallBox^2 pixels by itself
constexpr int kUnit = 32;                  ///< larger ones are drawn in squares of so many pixels, a warp each
constexpr std::size_t kMostLarge = std::size_t{1} << 24;  ///< triangles a launch
constexpr unsigned kUnitBits = 40;

using PixelWord = unsigned long long;

/// A triangle drawn in squares, the first of which is number `unit`.
struct LargeTriangle {
  std::uint64_t unit;
  std::uint32_t triangle;
};

__global__ void __launch_bounds__(kThreads) project_vertices_kernel(const MeshSetupArgs<float> args) {
  const MeshChunk chunk = args.vertex_chunks[blockIdx.x];
  const MeshPlacement& placement = args.placements[chunk.placement];
  const std::size_t i = chunk.begin + threadIdx.x;
  if (i < placement.mesh.vertices.size) project_mesh_vertex(args, placement, i);
}

__global__ void __launch_bounds__(kThreads) count_triangles_kernel(const MeshSetupArgs<float> args) {
  using Reduce = cub::BlockReduce<std::uint32_t, kThreads>;
  __shared__ typename Reduce::TempStorage storage;
  const MeshChunk chunk = args.triangle_chunks[blockIdx.x];
  const std::size_t t = chunk.begin + threadIdx.x;
  std::uint32_t n = 0;
  bool finite = true;
  if (t < args.placements[chunk.placement].mesh.triangle_count()) {
    finite = detail::for_each_piece<false>(args, chunk.placement, t, [&n](const MeshTriangle<float>&) { ++n; });
  }
  const int bad = __syncthreads_count(finite ? 0 : 1);
  n = Reduce(storage).Sum(n);
  if (threadIdx.x != 0) return;
  args.counts[blockIdx.x] = n;
  args.not_finite[blockIdx.x] = static_cast<std::uint32_t>(bad);
}

/// One block.
__global__ void __launch_bounds__(kScanThreads) scan_triangles_kernel(const MeshSetupArgs<float> args) {
  using Scan = cub::BlockScan<std::uint64_t, kScanThreads>;
  __shared__ typename Scan::TempStorage storage;
  std::uint64_t before = 0;
  for (std::size_t first = 0; first < args.counts.size; first += kScanThreads) {
    const std::size_t c = first + threadIdx.x;
    std::uint64_t n = c < args.counts.size ? args.counts[c] : 0, sum = 0;
    Scan(storage).ExclusiveSum(n, n, sum);
    if (c < args.counts.size) args.offsets[c] = before + n;
    before += sum;
    __syncthreads();
  }
  if (threadIdx.x == 0) args.offsets[args.counts.size] = before;
}

__global__ void __launch_bounds__(kThreads) write_triangles_kernel(const MeshSetupArgs<float> args) {
  using Scan = cub::BlockScan<std::uint32_t, kThreads>;
  __shared__ typename Scan::TempStorage storage;
  if (args.counts[blockIdx.x] == 0) return;
  const MeshChunk chunk = args.triangle_chunks[blockIdx.x];
  const std::size_t t = chunk.begin + threadIdx.x;
  const bool exists = t < args.placements[chunk.placement].mesh.triangle_count();
  std::uint32_t n = 0;
  if (exists) detail::for_each_piece<false>(args, chunk.placement, t, [&n](const MeshTriangle<float>&) { ++n; });
  std::uint32_t at = 0;
  Scan(storage).ExclusiveSum(n, at);
  if (n == 0) return;
  MeshTriangle<float>* out = args.triangles.data + args.offsets[blockIdx.x] + at;
  detail::for_each_piece<true>(args, chunk.placement, t, [&out](const MeshTriangle<float>& piece) { *out++ = piece; });
}

/// Shows a triangle at a pixel of its box, if it is inside, and nearer than what is shown there.
__device__ void show(const MeshRasterArgs<float>& args, const MeshTriangle<float>& t, std::uint32_t id, int x, int y,
                     PixelWord* pixels) {
  const float inverse_z = mesh_inverse_z(t, x, y);
  if (!(inverse_z > 0) || mesh_hole(args, t, x, y, inverse_z)) return;
  // Of equally near ones the first is the largest word.
  const PixelWord word = PixelWord{__float_as_uint(inverse_z)} << 32 | (0xffffffffu - id);
  PixelWord* const at =
      pixels + static_cast<std::size_t>(y) * static_cast<std::size_t>(args.bin.grid.width) + static_cast<std::size_t>(x);
  if (*at < word) atomicMax(at, word);
}

/// Draws small triangles and lists the others. `count`: of squares, and of large triangles from bit kUnitBits on.
__global__ void __launch_bounds__(128) draw_small_kernel(const MeshRasterArgs<float> args, std::uint32_t begin,
                                                         std::uint32_t end, PixelWord* pixels, LargeTriangle* large,
                                                         unsigned long long* count) {
  const std::uint32_t id = begin + blockIdx.x * blockDim.x + threadIdx.x;
  if (id >= end) return;
  const MeshTriangle<float>& t = args.triangles[id];
  const int width = t.x1 - t.x0, height = t.y1 - t.y0;
  if (width * height > kSmallBox * kSmallBox) {
    const unsigned long long units = static_cast<unsigned long long>((width + kUnit - 1) / kUnit) *
                                     static_cast<unsigned long long>((height + kUnit - 1) / kUnit);
    const unsigned long long before = atomicAdd(count, units | 1ull << kUnitBits);
    large[before >> kUnitBits] = {before & ((1ull << kUnitBits) - 1), id};
    return;
  }
  MeshEdges row = MeshEdges::of(t, args.bin.grid, t.x0, t.y0);
  for (int y = t.y0; y < t.y1; ++y) {
    MeshEdges e = row;
    for (int x = t.x0; x < t.x1; ++x) {
      if (e.inside()) show(args, t, id, x, y, pixels);
      e.step_right();
    }
    row.step_down();
  }
}

/// A warp a square of a large triangle: a column a lane.
__global__ void __launch_bounds__(128) draw_large_kernel(const MeshRasterArgs<float> args, PixelWord* pixels,
                                                         const LargeTriangle* large, const unsigned long long* count) {
  const std::uint64_t units = *count & ((1ull << kUnitBits) - 1), triangles = *count >> kUnitBits;
  const int lane = static_cast<int>(threadIdx.x % 32);
  const std::uint64_t stride = std::uint64_t{gridDim.x} * (blockDim.x / 32);
  for (std::uint64_t u = (std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x) / 32; u < units; u += stride) {
    std::uint64_t low = 0, high = triangles;
    while (high - low > 1) {
      const std::uint64_t mid = (low + high) / 2;
      (large[mid].unit <= u ? low : high) = mid;
    }
    const std::uint32_t id = large[low].triangle;
    const MeshTriangle<float>& t = args.triangles[id];
    const int at = static_cast<int>(u - large[low].unit), columns = (t.x1 - t.x0 + kUnit - 1) / kUnit;
    const int x0 = t.x0 + at % columns * kUnit, y0 = t.y0 + at / columns * kUnit;
    const int width = min(kUnit, t.x1 - x0), height = min(kUnit, t.y1 - y0);
    if (!MeshEdges::of(t, args.bin.grid, x0, y0).reach(width, height) || lane >= width) continue;
    MeshEdges e = MeshEdges::of(t, args.bin.grid, x0 + lane, y0);
    for (int y = y0; y < y0 + height; ++y) {
      if (e.inside()) show(args, t, id, x0 + lane, y, pixels);
      e.step_down();
    }
  }
}

/// A block a tile: depths, triangles and the tile's farthest from the words of its pixels.
__global__ void __launch_bounds__(1024) resolve_kernel(const MeshRasterArgs<float> args, const PixelWord* pixels) {
  __shared__ unsigned far;
  const TileGrid& grid = args.bin.grid;
  const int ts = grid.tile_size, t = static_cast<int>(threadIdx.x);
  const int x = static_cast<int>(blockIdx.x) % grid.columns * ts + t % ts;
  const int y = static_cast<int>(blockIdx.x) / grid.columns * ts + t / ts;
  if (t == 0) far = 0;
  __syncthreads();
  if (x < grid.width && y < grid.height) {
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) + static_cast<std::size_t>(x);
    const PixelWord word = pixels[pixel];
    const float depth = 1.0f / __uint_as_float(static_cast<unsigned>(word >> 32));  // infinity where there is none
    args.depth[pixel] = depth;
    args.visible[pixel] = word == 0 ? kNoTriangle : 0xffffffffu - static_cast<std::uint32_t>(word);
    atomicMax(&far, __float_as_uint(depth));  // in order, as none is negative
  }
  __syncthreads();
  if (t == 0) args.tile_far[blockIdx.x] = __uint_as_float(far);
}

struct ShadePixel {
  MeshShadeArgs<float> args;
  __device__ void operator()(std::size_t pixel) const { shade_mesh_pixel(args, pixel); }
};

}  // namespace
}  // namespace cuda

void CudaBackend::parallel_for(std::size_t chunks, const ProjectMeshVertices<float>& k) {
  if (chunks == 0 || !usable()) return;
  cuda::project_vertices_kernel<<<static_cast<unsigned>(chunks), cuda::kThreads, 0, stream_>>>(k.args);
  note(cudaGetLastError(), "the projection of vertices");
}

void CudaBackend::parallel_for(std::size_t chunks, const CountMeshTriangles<float>& k) {
  if (chunks == 0 || !usable()) return;
  cuda::count_triangles_kernel<<<static_cast<unsigned>(chunks), cuda::kThreads, 0, stream_>>>(k.args);
  note(cudaGetLastError(), "the counting of triangles");
}

void CudaBackend::parallel_for(std::size_t, const ScanMeshTriangles<float>& k) {
  if (!usable()) return;
  cuda::scan_triangles_kernel<<<1, cuda::kScanThreads, 0, stream_>>>(k.args);
  note(cudaGetLastError(), "a scan of triangles");
}

void CudaBackend::parallel_for(std::size_t chunks, const WriteMeshTriangles<float>& k) {
  if (chunks == 0 || !usable()) return;
  cuda::write_triangles_kernel<<<static_cast<unsigned>(chunks), cuda::kThreads, 0, stream_>>>(k.args);
  note(cudaGetLastError(), "the set-up of triangles");
}

void CudaBackend::rasterize_mesh(const MeshRasterArgs<float>& args) {
  if (!usable()) return;
  using cuda::LargeTriangle;
  const TileGrid& grid = args.bin.grid;
  const std::size_t n = args.triangles.size, most = std::min(n, cuda::kMostLarge);
  const std::size_t bytes = static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height) *
                            sizeof(cuda::PixelWord);
  auto* const pixels = static_cast<cuda::PixelWord*>(scratch(kMeshPixels, bytes));
  auto* const count = static_cast<unsigned long long*>(scratch(kMeshLarge, 16 + most * sizeof(LargeTriangle)));
  auto* const large = reinterpret_cast<LargeTriangle*>(count + 2);
  fill(pixels, 0, bytes);
  for (std::size_t begin = 0; begin < n; begin += most) {
    const std::size_t end = std::min(n, begin + most);
    fill(count, 0, sizeof *count);
    cuda::draw_small_kernel<<<static_cast<unsigned>((end - begin + 127) / 128), 128, 0, stream_>>>(
        args, static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end), pixels, large, count);
    cuda::draw_large_kernel<<<2048, 128, 0, stream_>>>(args, pixels, large, count);
  }
  const unsigned threads = static_cast<unsigned>(grid.tile_size * grid.tile_size);
  cuda::resolve_kernel<<<static_cast<unsigned>(grid.count()), threads, 0, stream_>>>(args, pixels);
  note(cudaGetLastError(), "the drawing of triangles");
}

void CudaBackend::parallel_for(std::size_t rows, const ShadeMeshRow<float>& k) {
  parallel_for(rows * k.args.width, cuda::ShadePixel{k.args});
}

}  // namespace gsnav
