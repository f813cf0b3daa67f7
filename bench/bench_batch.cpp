// SPDX-License-Identifier: Apache-2.0
// Many cameras in one call on a GPU. Each row has the milliseconds per frame, the error against float64
// and the memory.
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_batch [--size 256x256]
//       [--compact] [--balls 8] [--rgb] [--depth] [--visible] [--visible-rows 8] [--visible-margin 0.5]
//       [--visible-weight 0.00001] [batch sizes...]      (or --device: prints the name of the GPU)
//
// Without the variables, the scene is the embedded flat from its four viewpoints. A batch larger than
// the number of views repeats the views from slightly different places. Times are measured on the
// device, between events on the stream. `host us` is the duration of the call that enqueues the work.
// Errors are of judged_views(), taken together; `least` is the PSNR of the worst view.
//
// --balls N: N meshes of 4000 triangles stand in front of the first cameras, and all cameras see them.
// --rgb: colours alone. --depth: median depth alone. Errors of images that are not drawn are nan.
// --visible: each camera draws only the Gaussians that are visible from its cell (VisibleSettings::rows,
// min_weight, margin). The images of all views are then compared with images of the whole scene.
#include <cuda_runtime.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "error.hpp"
#include "gsnav/backends/cuda/batch.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/mesh_scene.hpp"
#include "samples.hpp"
#include "visible_workload.hpp"
#include "workload.hpp"

using namespace gsnav;

namespace {

constexpr int kRepeats = 9;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
int g_width = 256, g_height = 256;
bool g_rgb = true, g_depth = true;   ///< images that are drawn: both with alpha
std::vector<MeshInstance> g_meshes;  ///< on the device
VisibleSets g_visible;               ///< empty: every camera draws the whole scene

/// A ball of radius 1.
SurfaceMesh ball() {
  constexpr std::uint32_t kAround = 64, kDown = 32;
  constexpr double kPi = 3.14159265358979323846;
  SurfaceMesh m;
  for (std::uint32_t i = 0; i <= kDown; ++i) {
    for (std::uint32_t j = 0; j <= kAround; ++j) {
      const double polar = kPi * i / kDown, turn = 2 * kPi * j / kAround;
      const Vec3d at{std::sin(polar) * std::cos(turn), std::cos(polar),
                     std::sin(polar) * std::sin(turn)};
      m.geometry.vertices.push_back(vec_cast<float>(at));
      m.normals.push_back(vec_cast<float>(at));
      if (i == kDown || j == kAround) continue;
      const std::uint32_t a = i * (kAround + 1) + j, b = a + kAround + 1;
      m.geometry.triangles.push_back({a, a + 1, b});
      m.geometry.triangles.push_back({a + 1, b + 1, b});
    }
  }
  return m;
}

/// `count` cameras, the first one with index `first`. Indices beyond the number of views give the same
/// views again, moved by some centimetres.
std::vector<BatchCamera> cameras_of(std::size_t first, std::size_t count) {
  const std::vector<Camera> views = gsnav_bench::sized(g_width, g_height);
  std::vector<BatchCamera> batch;
  for (std::size_t i = first; i < first + count; ++i) {
    BatchCamera c{views[i % views.size()], {}};
    c.camera.viewmat.translation.x += 0.02 * static_cast<double>(i / views.size());
    c.meshes.instances = g_meshes;
    batch.push_back(c);
  }
  return batch;
}

/// The cameras of the judged views.
std::vector<BatchCamera> judged_cameras() {
  std::vector<BatchCamera> cameras;
  for (const Camera& view : gsnav_bench::judged_views(gsnav_bench::sized(g_width, g_height))) {
    cameras.push_back({view, {}});
    cameras.back().meshes.instances = g_meshes;
  }
  return cameras;
}

/// Visible sets of the cameras' cells, on the device.
struct ViewSets {
  explicit ViewSets(CudaBackend& cuda) : bits(cuda) {
    bits.upload(g_visible.bits.data(), g_visible.bits.size());
  }
  /// Sets each camera's visible set to the one of its cell. The call has one Gaussian set.
  void choose(std::vector<BatchCamera>& cameras) {
    if (g_visible.cells() == 0) return;
    views.assign(cameras.size(), {});
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      if (const auto cell = g_visible.cell_of(cameras[c].camera))
        views[c] = g_visible.seen_from(*cell, bits.data());
      cameras[c].seen = std::span(views).subspan(c, 1);
    }
  }
  Buffer<std::uint32_t, CudaBackend> bits;
  std::vector<View<const std::uint32_t>> views;
};

struct DeviceImages {
  DeviceImages(CudaBackend& cuda, std::size_t pixels) : memory(cuda) {
    memory.resize_discard(5 * pixels);
    if (g_rgb) images.floats.rgb = memory.data();
    if (g_rgb && g_depth) images.floats.alpha = memory.data() + 3 * pixels;
    if (g_depth) images.floats.median_depth = memory.data() + 4 * pixels;
  }
  Buffer<float, CudaBackend> memory;
  BatchImages images;
};

/// Errors of the images of the judged views; NaN for images that are not drawn.
struct Judged {
  gsnav_bench::ErrorStats rgb{kNan, kNan, kNan, kNan};  ///< of all views together
  double least = kNan;                                  ///< PSNR of the worst view, dB
  double depth_p99 = kNan;                              ///< metres, where alpha exceeds 0.9
};

/// Draws the judged views in calls of at most `count` cameras and compares them with `truth`.
Judged judge(CudaBackend& cuda, CudaBatchRenderer& renderer, const std::vector<GaussianSet>& sets,
             const Frames<double>& truth, std::size_t count, ViewSets& seen, const BatchImages& images) {
  const std::vector<BatchCamera> cameras = judged_cameras();
  const std::size_t pixels = static_cast<std::size_t>(g_width) * static_cast<std::size_t>(g_height);
  std::vector<float> rgb(3 * cameras.size() * pixels), depth(cameras.size() * pixels), depth_seen;
  for (std::size_t first = 0; first < cameras.size(); first += count) {
    const std::size_t n = std::min(count, cameras.size() - first);
    std::vector<BatchCamera> part(&cameras[first], &cameras[first] + n);
    seen.choose(part);
    renderer.render(sets, part, images).throw_if_error();
    renderer.finish().throw_if_error();
    const std::size_t at = first * pixels, bytes = n * pixels * sizeof(float);
    constexpr CopyKind kDown = CopyKind::device_to_host;
    if (g_rgb) cuda.copy(rgb.data() + 3 * at, images.floats.rgb, 3 * bytes, kDown);
    if (g_depth) cuda.copy(depth.data() + at, images.floats.median_depth, bytes, kDown);
    cuda.synchronize().throw_if_error();
  }
  std::vector<double> depth_truth;
  Judged judged;
  if (g_rgb) {
    judged.rgb = gsnav_bench::error_of(rgb, truth.rgb);
    for (std::size_t v = 0; v < cameras.size(); ++v) {
      const auto part = [&](const auto& image) {
        const auto from = image.begin() + static_cast<std::ptrdiff_t>(3 * v * pixels);
        return std::vector(from, from + static_cast<std::ptrdiff_t>(3 * pixels));
      };
      judged.least = std::fmin(judged.least, gsnav_bench::error_of(part(rgb), part(truth.rgb)).psnr);
    }
  }
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (!g_depth || truth.alpha[i] <= 0.9) continue;
    depth_seen.push_back(depth[i]);
    depth_truth.push_back(truth.median_depth[i]);
  }
  if (g_depth) judged.depth_p99 = gsnav_bench::error_of(depth_seen, depth_truth).p99;
  return judged;
}

void row(CudaBackend& cuda, const GaussianArrays<CudaBackend>& arrays, const Frames<double>& truth,
         std::size_t count, Quality quality) {
  RenderConfig config;
  config.quality = quality;
  CudaBatchRenderer renderer(cuda, config);
  const std::size_t pixels = static_cast<std::size_t>(g_width) * static_cast<std::size_t>(g_height);
  DeviceImages out(cuda, count * pixels);
  const std::vector<GaussianSet> sets{arrays.set()};
  ViewSets seen(cuda);
  cudaEvent_t begin, end;
  cudaEventCreate(&begin);
  cudaEventCreate(&end);
  const std::size_t views = gsnav_bench::workload().cameras.size();
  const std::size_t batches = std::max<std::size_t>(1, views / count);
  std::vector<double> ms, host_us;
  double pairs = 0;
  // The first repeat allocates the scratch and is not counted.
  for (int repeat = -1; repeat < kRepeats; ++repeat) {
    for (std::size_t b = 0; b < batches; ++b) {
      std::vector<BatchCamera> cameras = cameras_of(b * count, count);
      seen.choose(cameras);
      cudaEventRecord(begin, cuda.stream());
      const auto called = std::chrono::steady_clock::now();
      renderer.render(sets, cameras, out.images).throw_if_error();
      const std::chrono::duration<double, std::micro> host = std::chrono::steady_clock::now() - called;
      cudaEventRecord(end, cuda.stream());
      renderer.finish().throw_if_error();
      if (repeat < 0) continue;
      float t = 0;
      cudaEventElapsedTime(&t, begin, end);
      host_us.push_back(host.count());
      ms.push_back(static_cast<double>(t) / static_cast<double>(count));
      pairs += static_cast<double>(renderer.stats().tile_intersections);
    }
  }
  const Judged judged = judge(cuda, renderer, sets, truth, count, seen, out.images);
  std::printf("%-6s %5zu  %9.4f %9.4f %9.0f   %.1e  %.1e  %6.1f %6.1f  %.1e  %9.0f  %8.1f  %7.1f\n",
              quality == Quality::fast() ? "fast" : "exact", count, gsnav_bench::median(ms),
              gsnav_bench::quantile(ms, 0.9), 1000.0 / gsnav_bench::median(ms), judged.rgb.max,
              judged.rgb.p999, judged.rgb.psnr, judged.least, judged.depth_p99,
              pairs / static_cast<double>(ms.size() * count),
              static_cast<double>(renderer.stats().scratch_bytes) / 1e6, gsnav_bench::median(host_us));
  std::fflush(stdout);
  cudaEventDestroy(begin);
  cudaEventDestroy(end);
}

/// Effect of visible sets: draws every view with and without them, in the profile `fast`, and compares.
void compare_visible(CudaBackend& cuda, const GaussianArrays<CudaBackend>& arrays) {
  const std::size_t views = gsnav_bench::workload().cameras.size();
  const std::size_t values = 3 * static_cast<std::size_t>(g_width) * static_cast<std::size_t>(g_height);
  RenderConfig config;
  config.quality = Quality::fast();
  CudaBatchRenderer renderer(cuda, config);
  const std::vector<GaussianSet> sets{arrays.set()};
  Buffer<float, CudaBackend> there(cuda);
  there.resize_discard(values);
  BatchImages images;
  images.floats.rgb = there.data();
  ViewSets seen(cuda);
  double least = 1e9, worst = 0, sum = 0;
  for (std::size_t v = 0; v < views; ++v) {
    std::vector<float> rgb[2];
    for (const int with : {0, 1}) {
      std::vector<BatchCamera> camera = cameras_of(v, 1);
      if (with == 1) seen.choose(camera);
      renderer.render(sets, camera, images).throw_if_error();
      renderer.finish().throw_if_error();
      rgb[with].resize(values);
      cuda.copy(rgb[with].data(), there.data(), values * sizeof(float), CopyKind::device_to_host);
      cuda.synchronize().throw_if_error();
    }
    const gsnav_bench::ErrorStats e =
        gsnav_bench::error_of(rgb[1], std::vector<double>(rgb[0].begin(), rgb[0].end()));
    least = std::min(least, e.psnr);
    worst = std::max(worst, e.max);
    sum += std::pow(10.0, -0.1 * e.psnr);
  }
  std::printf(
      "with visible sets compared with none, %zu views: least %.1f dB, of all %.1f dB, largest error "
      "%.1e\n",
      views, least, -10 * std::log10(sum / static_cast<double>(views)), worst);
}

/// Handles an argument that chooses images. Returns false for others.
bool chooses_images(const std::string& argument) {
  if (argument == "--rgb") {
    g_depth = false;
  } else if (argument == "--depth") {
    g_rgb = false;
  } else {
    return false;
  }
  return true;
}

bool has_gpu() {
  const bool has = CudaBackend::device_count() != 0;
  if (!has) std::fprintf(stderr, "bench_batch: no GPU\n");
  return has;
}

const char* drawn_images() {
  return !g_depth ? "RGB" : g_rgb ? "RGB + alpha + median depth" : "median depth";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "--device")
    return has_gpu() ? std::puts(CudaBackend().device_name().c_str()) < 0 : 1;
  std::vector<std::size_t> counts;
  bool compact = false, visible = false;
  VisibleSettings sets_of;
  std::size_t balls = 0;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--size" && i + 1 < argc) {
      if (std::sscanf(argv[++i], "%dx%d", &g_width, &g_height) == 2 && g_width > 0 && g_height > 0)
        continue;
    } else if (const std::string o = argv[i]; o == "--compact" || o == "--visible") {
      (o == "--compact" ? compact : visible) = true;
      continue;
    } else if (o.starts_with("--visible-") && i + 1 < argc) {
      const double value = std::atof(argv[++i]);
      if (o == "--visible-rows") sets_of.rows = static_cast<int>(value);
      if (o == "--visible-weight") sets_of.min_weight = value;
      if (o == "--visible-margin") sets_of.margin = value;
      if (const auto s = o.substr(10); s == "rows" || s == "weight" || s == "margin") continue;
    } else if (chooses_images(argv[i])) {
      continue;
    } else if (std::string(argv[i]) == "--balls" && i + 1 < argc) {
      balls = std::strtoull(argv[++i], nullptr, 10);
      if (balls > 0) continue;
    } else if (char* end = nullptr; const std::size_t count = std::strtoull(argv[i], &end, 10)) {
      if (*end == '\0') {
        counts.push_back(count);
        continue;
      }
    }
    std::fprintf(stderr,
                 "bench_batch: '%s' is no size (256x256), batch size, --compact, --rgb, --depth, "
                 "--visible, --visible-rows, --visible-margin, --visible-weight, --device or --balls\n",
                 argv[i]);
    return 2;
  }
  if (!has_gpu()) return 1;
  CudaBackend cuda;
  GaussianCloud shown = gsnav_bench::workload().cloud;
  if (compact) compact_sh(shown);
  const GaussianArrays<CudaBackend> arrays(cuda, shown);
  if (visible) g_visible = gsnav_bench::workload_visible_sets(sets_of);
  OpenMPBackend cpu;
  BasicRenderer<double, OpenMPBackend> reference(cpu);
  const auto cameras = gsnav_bench::judged_views(gsnav_bench::sized(g_width, g_height));
  const std::vector<GaussianSet> sets{gsnav_bench::workload().cloud.set()};
  MeshScene scene;
  scene.add(ball()).value();
  const MeshArrays<CudaBackend> there(cuda, scene.instance(0, {}, 0).mesh);
  std::vector<MeshInstance> here;
  for (const BatchCamera& c : cameras_of(0, balls)) {
    const Vec3d forward = c.camera.viewmat.linear.row[2];
    const Similarity at{{1, 0, 0, 0}, c.camera.position() + 1.5 * forward, 0.3};
    const auto id = static_cast<std::uint32_t>(here.size());
    here.push_back(scene.instance(0, at, id));
    g_meshes.push_back(there.instance(at, id));
  }
  reference.set_meshes(here);
  const Frames<double> truth = reference.render(sets, cameras).value();
  std::printf("%s: %zu Gaussians, %zu views, %d x %d, %s%s, %zu meshes\n", cuda.device_name().c_str(),
              gsnav_bench::workload().cloud.size(), gsnav_bench::workload().cameras.size(), g_width,
              g_height, drawn_images(), compact ? ", SH in half precision" : "", balls);
  if (visible) compare_visible(cuda, arrays);
  std::printf(
      "profile batch  ms/frame       p90  frames/s   rgb max  p99.9  psnr dB  least  depth p99     "
      "pairs  "
      "scratch MB  host us\n");
  if (counts.empty()) counts = {1, 8, 64, 256, 512};
  for (const Quality& quality : {Quality::fast(), Quality::exact()}) {
    for (const std::size_t count : counts) row(cuda, arrays, truth, count, quality);
  }
}
