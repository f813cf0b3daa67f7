// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cub/block/block_reduce.cuh>
#include <cub/block/block_scan.cuh>

#include "gsnav/backends/cuda/device.cuh"
#include "mesh_work.cuh"

// Meshes on the device (docs/reference/composition.md), with one vertex, triangle or pixel per thread.
// There are no tile lists: an atomic maximum of PixelWord finds the triangle that a pixel shows.

namespace gsnav {

namespace cuda {

namespace {

constexpr unsigned kThreads = kMeshChunk;  ///< Threads of a block that processes a chunk.
using Policy = policy::Mesh;
constexpr unsigned kScanThreads = Policy::kScanThreads, kDrawThreads = Policy::kDrawThreads;
constexpr int kSmallBox = Policy::kSmallBox, kUnit = Policy::kUnit;
constexpr unsigned kUnitBits = 40;

template <class Work>
__global__ void __launch_bounds__(kThreads)
    project_vertices_kernel(const MeshSetupArgs<float> args, const Work work) {
  const MeshChunk chunk = work.vertex_chunk(args);
  const MeshPlacement& placement = args.placements[chunk.placement];
  const std::size_t i = chunk.begin + threadIdx.x;
  if (i < placement.mesh.vertices.size)
    project_mesh_vertex(placed_for(args, work, chunk.placement), placement, i);
}

template <class Work>
__global__ void __launch_bounds__(kThreads)
    count_triangles_kernel(const MeshSetupArgs<float> args, const Work work) {
  using Reduce = cub::BlockReduce<std::uint32_t, kThreads>;
  __shared__ typename Reduce::TempStorage storage;
  const MeshChunk chunk = work.triangle_chunk(args);
  const std::size_t t = chunk.begin + threadIdx.x;
  std::uint32_t n = 0;
  bool finite = true;
  if (t < args.placements[chunk.placement].mesh.triangle_count()) {
    finite = detail::for_each_piece<false>(placed_for(args, work, chunk.placement), chunk.placement, t,
                                           [&n](const MeshTriangle<float>&) { ++n; });
  }
  const int bad = __syncthreads_count(finite ? 0 : 1);
  n = Reduce(storage).Sum(n);
  if (threadIdx.x != 0) return;
  args.counts[blockIdx.x] = n;
  work.note(args, bad);
}

/// Computes exclusive sums of [begin, end) with one block. Returns the total.
template <class From>
__device__ std::uint64_t scan_by_block(const From* from, std::size_t begin, std::size_t end,
                                       std::uint64_t* to) {
  using Scan = cub::BlockScan<std::uint64_t, kScanThreads>;
  __shared__ typename Scan::TempStorage storage;
  std::uint64_t before = 0;
  for (std::size_t first = begin; first < end; first += kScanThreads) {
    const std::size_t c = first + threadIdx.x;
    std::uint64_t n = c < end ? from[c] : 0, sum = 0;
    Scan(storage).ExclusiveSum(n, n, sum);
    if (c < end) to[c] = before + n;
    before += sum;
    __syncthreads();
  }
  return before;
}

/// Launched with one block.
__global__ void __launch_bounds__(kScanThreads) scan_triangles_kernel(const MeshSetupArgs<float> args) {
  const std::uint64_t sum = scan_by_block(args.counts.data, 0, args.counts.size, args.offsets.data);
  if (threadIdx.x == 0) args.offsets[args.counts.size] = sum;
}

/// Sums the triangle counts of each camera's chunks: where a chunk begins, and the camera's total.
__global__ void __launch_bounds__(kScanThreads)
    scan_cameras_kernel(const MeshSetupArgs<float> args, const MeshWave wave) {
  const std::uint64_t sum = scan_by_block(args.counts.data, wave.chunk_begins[blockIdx.x],
                                          wave.chunk_begins[blockIdx.x + 1], args.offsets.data);
  if (threadIdx.x == 0) wave.camera_begins[blockIdx.x] = sum;
}

/// Converts numbers of triangles per camera to begins. Launched with one block.
__global__ void __launch_bounds__(kScanThreads) begin_cameras_kernel(const MeshWave wave) {
  const std::uint64_t sum = scan_by_block(wave.camera_begins, 0, wave.camera_count, wave.camera_begins);
  if (threadIdx.x != 0) return;
  MeshCounters& n = *wave.counters;
  n.triangles = sum;
  n.drawn += sum;
  if (n.most < sum) n.most = sum;
}

template <class Work>
__global__ void __launch_bounds__(kThreads)
    write_triangles_kernel(const MeshSetupArgs<float> args, const Work work) {
  using Scan = cub::BlockScan<std::uint32_t, kThreads>;
  __shared__ typename Scan::TempStorage storage;
  if (args.counts[blockIdx.x] == 0) return;
  const MeshChunk chunk = work.triangle_chunk(args);
  const MeshSetupArgs<float> setup = placed_for(args, work, chunk.placement);
  const std::size_t t = chunk.begin + threadIdx.x;
  const bool exists = t < args.placements[chunk.placement].mesh.triangle_count();
  std::uint32_t n = 0;
  if (exists)
    detail::for_each_piece<false>(setup, chunk.placement, t, [&n](const MeshTriangle<float>&) { ++n; });
  std::uint32_t at = 0;
  Scan(storage).ExclusiveSum(n, at);
  if (n == 0) return;
  std::uint64_t to = work.first_triangle(args, chunk.placement) + at;
  const std::uint64_t room = work.room();
  detail::for_each_piece<true>(setup, chunk.placement, t, [&](const MeshTriangle<float>& piece) {
    if (to < room) args.triangles.data[to] = piece;
    ++to;
  });
}

/// Makes a triangle the visible one at a pixel of its box if it covers the pixel and is nearest so far.
__device__ void show(const MeshRasterArgs<float>& args, const MeshTriangle<float>& t, std::uint32_t id,
                     int x, int y, PixelWord* pixels) {
  const float inverse_z = mesh_inverse_z(t, x, y);
  if (!(inverse_z > 0) || mesh_hole(args, t, x, y, inverse_z)) return;
  const PixelWord word = word_of(inverse_z, id);
  PixelWord* const at = pixels +
                        static_cast<std::size_t>(y) * static_cast<std::size_t>(args.bin.grid.width) +
                        static_cast<std::size_t>(x);
  if (*at < word) atomicMax(at, word);
}

/// Pixels of the camera that sees a triangle.
template <class Work>
__device__ PixelWord* pixels_of(const MeshRasterArgs<float>& args, const Work& work,
                                const MeshTriangle<float>& t, PixelWord* pixels) {
  const TileGrid& grid = args.bin.grid;
  return pixels + work.camera_of(t.placement) * static_cast<std::size_t>(grid.width) *
                      static_cast<std::size_t>(grid.height);
}

/// Draws a small triangle, or adds it to the list of large ones. `count` holds the number of squares,
/// and from bit kUnitBits on the number of large triangles.
template <class Work>
__device__ void draw_small(const MeshRasterArgs<float>& args, const Work& work, std::uint32_t id,
                           PixelWord* all, LargeTriangle* large, unsigned long long* count) {
  const MeshTriangle<float>& t = args.triangles[id];
  const int width = t.x1 - t.x0, height = t.y1 - t.y0;
  if (width * height > kSmallBox * kSmallBox) {
    const unsigned long long units = static_cast<unsigned long long>((width + kUnit - 1) / kUnit) *
                                     static_cast<unsigned long long>((height + kUnit - 1) / kUnit);
    const unsigned long long before = atomicAdd(count, units | 1ull << kUnitBits);
    large[before >> kUnitBits] = {before & ((1ull << kUnitBits) - 1), id};
    return;
  }
  PixelWord* const pixels = pixels_of(args, work, t, all);
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

/// Draws one triangle per thread, up to Policy::kMostLarge from `begin` on.
template <class Work>
__global__ void __launch_bounds__(kDrawThreads)
    draw_small_kernel(const MeshRasterArgs<float> args, const Work work, std::uint64_t begin,
                      PixelWord* pixels, LargeTriangle* large, unsigned long long* count) {
  const std::uint64_t n = work.count(),
                      end = begin + Policy::kMostLarge < n ? begin + Policy::kMostLarge : n;
  const std::uint64_t stride = std::uint64_t{gridDim.x} * blockDim.x;
  for (std::uint64_t id = begin + std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; id < end;
       id += stride) {
    draw_small(args, work, static_cast<std::uint32_t>(id), pixels, large, count);
  }
}

/// Draws one square of a large triangle per warp, one column per lane.
template <class Work>
__global__ void __launch_bounds__(kDrawThreads)
    draw_large_kernel(const MeshRasterArgs<float> args, const Work work, PixelWord* all,
                      const LargeTriangle* large, const unsigned long long* count) {
  const std::uint64_t units = *count & ((1ull << kUnitBits) - 1), triangles = *count >> kUnitBits;
  const int lane = static_cast<int>(threadIdx.x % 32);
  const std::uint64_t stride = std::uint64_t{gridDim.x} * (blockDim.x / 32);
  for (std::uint64_t u = (std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x) / 32; u < units;
       u += stride) {
    const LargeTriangle& of = large[last_start(std::uint64_t{0}, triangles,
                                               [&](std::uint64_t i) { return large[i].unit <= u; })];
    const std::uint32_t id = of.triangle;
    const MeshTriangle<float>& t = args.triangles[id];
    const int at = static_cast<int>(u - of.unit), columns = (t.x1 - t.x0 + kUnit - 1) / kUnit;
    const int x0 = t.x0 + at % columns * kUnit, y0 = t.y0 + at / columns * kUnit;
    const int width = min(kUnit, t.x1 - x0), height = min(kUnit, t.y1 - y0);
    if (!MeshEdges::of(t, args.bin.grid, x0, y0).reach(width, height) || lane >= width) continue;
    PixelWord* const pixels = pixels_of(args, work, t, all);
    MeshEdges e = MeshEdges::of(t, args.bin.grid, x0 + lane, y0);
    for (int y = y0; y < y0 + height; ++y) {
      if (e.inside()) show(args, t, id, x0 + lane, y, pixels);
      e.step_down();
    }
  }
}

/// Converts words of pixels to depths and triangles, and finds the largest depth of a tile per block.
__global__ void __launch_bounds__(1024)
    resolve_kernel(const MeshRasterArgs<float> args, const PixelWord* pixels) {
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
    const float depth = depth_of(word);
    args.depth[pixel] = depth;
    args.visible[pixel] = triangle_of(word);
    atomicMax(&far, __float_as_uint(depth));  // ordered like floats: none is negative
  }
  __syncthreads();
  if (t == 0) args.tile_far[blockIdx.x] = __uint_as_float(far);
}

/// Writes the depth of a pixel and, if requested, its colour, with one pixel of one camera per thread.
__global__ void __launch_bounds__(kDrawThreads)
    finish_pixels_kernel(MeshShadeArgs<float> shade, const MeshWave wave, std::size_t pixels) {
  const std::size_t pixel = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x,
                    at = blockIdx.y * pixels + pixel;
  if (pixel >= pixels) return;
  const PixelWord word = wave.pixels[at];
  const float depth = depth_of(word);
  wave.depth[at] = depth;
  if (wave.color == nullptr) return;
  const MeshShadeArgs<float>& light = wave.lights[blockIdx.y];
  shade.unlit = light.unlit;
  shade.ambient = light.ambient;
  shade.light = light.light;
  shade.diffuse = light.diffuse;
  shade.images.color = wave.color + 3 * blockIdx.y * pixels;
  shade_mesh_pixel(shade, pixel, triangle_of(word), depth);
}

/// Draws up to `count` triangles, with at most `blocks` blocks. `queue` has large_bytes(count) bytes.
template <class Work>
void draw_triangles(const MeshRasterArgs<float>& args, const Work& work, std::uint64_t count,
                    unsigned blocks, PixelWord* pixels, unsigned long long* queue, cudaStream_t stream) {
  auto* const large = reinterpret_cast<LargeTriangle*>(queue + 2);
  for (std::uint64_t begin = 0; begin < count; begin += Policy::kMostLarge) {
    const std::uint64_t most = std::min<std::uint64_t>(count - begin, Policy::kMostLarge);
    const auto needed = static_cast<unsigned>((most + kDrawThreads - 1) / kDrawThreads);
    cudaMemsetAsync(queue, 0, sizeof *queue, stream);
    draw_small_kernel<<<std::min(needed, blocks), kDrawThreads, 0, stream>>>(args, work, begin, pixels,
                                                                             large, queue);
    draw_large_kernel<<<blocks, kDrawThreads, 0, stream>>>(args, work, pixels, large, queue);
  }
}

struct ShadePixel {
  MeshShadeArgs<float> args;
  __device__ void operator()(std::size_t pixel) const { shade_mesh_pixel(args, pixel); }
};

}  // namespace

void launch_mesh_wave(const MeshSetupArgs<float>& setup, int width, int height, const MeshWave& wave,
                      int multiprocessors, cudaStream_t stream) {
  const ManyCameras work{wave};
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  MeshRasterArgs<float> raster;
  raster.bin.grid = TileGrid::of(width, height, 16);
  raster.triangles = setup.triangles;
  raster.placements = setup.placements;
  cudaMemsetAsync(wave.pixels, 0, wave.camera_count * pixels * sizeof(PixelWord), stream);
  if (wave.placements != 0) {
    if (wave.vertex_chunks != 0)
      project_vertices_kernel<<<wave.vertex_chunks, kThreads, 0, stream>>>(setup, work);
    count_triangles_kernel<<<wave.triangle_chunks, kThreads, 0, stream>>>(setup, work);
    scan_cameras_kernel<<<wave.camera_count, kScanThreads, 0, stream>>>(setup, wave);
    begin_cameras_kernel<<<1, kScanThreads, 0, stream>>>(wave);
    write_triangles_kernel<<<wave.triangle_chunks, kThreads, 0, stream>>>(setup, work);
    draw_triangles(raster, work, wave.capacity,
                   static_cast<unsigned>(multiprocessors) * Policy::kDrawBlocks, wave.pixels, wave.large,
                   stream);
  }
  MeshShadeArgs<float> shade;
  shade.placements = setup.placements;
  shade.triangles = setup.triangles;
  shade.width = static_cast<std::size_t>(width);
  const dim3 blocks(static_cast<unsigned>((pixels + kDrawThreads - 1) / kDrawThreads),
                    wave.camera_count);
  finish_pixels_kernel<<<blocks, kDrawThreads, 0, stream>>>(shade, wave, pixels);
}

}  // namespace cuda

void CudaBackend::run(stage::Each, std::size_t chunks, const ProjectMeshVertices<float>& k) {
  if (chunks == 0 || !usable()) return;
  cuda::project_vertices_kernel<<<static_cast<unsigned>(chunks), cuda::kThreads, 0, stream_>>>(
      k.args, cuda::OneCamera{});
  note(cudaGetLastError(), "the projection of vertices");
}

void CudaBackend::run(stage::Each, std::size_t chunks, const CountMeshTriangles<float>& k) {
  if (chunks == 0 || !usable()) return;
  cuda::count_triangles_kernel<<<static_cast<unsigned>(chunks), cuda::kThreads, 0, stream_>>>(
      k.args, cuda::OneCamera{});
  note(cudaGetLastError(), "the counting of triangles");
}

void CudaBackend::run(stage::Each, std::size_t, const ScanMeshTriangles<float>& k) {
  if (!usable()) return;
  cuda::scan_triangles_kernel<<<1, cuda::kScanThreads, 0, stream_>>>(k.args);
  note(cudaGetLastError(), "a scan of triangles");
}

void CudaBackend::run(stage::Each, std::size_t chunks, const WriteMeshTriangles<float>& k) {
  if (chunks == 0 || !usable()) return;
  cuda::write_triangles_kernel<<<static_cast<unsigned>(chunks), cuda::kThreads, 0, stream_>>>(
      k.args, cuda::OneCamera{});
  note(cudaGetLastError(), "the set-up of triangles");
}

void CudaBackend::run(stage::RasterizeMesh, const MeshRasterArgs<float>& args) {
  if (!usable()) return;
  const TileGrid& grid = args.bin.grid;
  const std::size_t n = args.triangles.size;
  const std::size_t bytes = static_cast<std::size_t>(grid.width) *
                            static_cast<std::size_t>(grid.height) * sizeof(cuda::PixelWord);
  auto* const pixels = static_cast<cuda::PixelWord*>(scratch(kMeshPixels, bytes));
  auto* const queue = static_cast<unsigned long long*>(scratch(kMeshLarge, cuda::large_bytes(n)));
  fill(pixels, 0, bytes);
  cuda::draw_triangles(args, cuda::OneCamera{static_cast<std::uint32_t>(n)}, n,
                       cuda::policy::Mesh::kFrameDrawBlocks, pixels, queue, stream_);
  const unsigned threads = static_cast<unsigned>(grid.tile_size * grid.tile_size);
  cuda::resolve_kernel<<<static_cast<unsigned>(grid.count()), threads, 0, stream_>>>(args, pixels);
  note(cudaGetLastError(), "the drawing of triangles");
}

void CudaBackend::run(stage::Each, std::size_t rows, const ShadeMeshRow<float>& k) {
  parallel_for(rows * k.args.width, cuda::ShadePixel{k.args});
}

}  // namespace gsnav
