// SPDX-License-Identifier: Apache-2.0
// Frames with meshes among the Gaussians. Each row has the time and the error against the float64 oracle
// of merged images.
//
//   bench_composite [WIDTHxHEIGHT]
//   GSNAV_BENCH_SCENE and GSNAV_BENCH_CAMERAS as for bench_render
//
// A ball of triangles stands 2 m in front of each view, as furniture would. Rows: `alone` is the frame
// without meshes, `meshes` the frame without Gaussians. `glass` has transparent balls whose front and
// back are both drawn; tests/hard_cases has its errors. `hard_depth` is Habitat-GS's rule on the same
// scene.
//
// Errors are the worst of the views. median_ms is the median over views of each view's median, from the
// call until the images are in host memory. Numbers of (tile, Gaussian) pairs are means. Where there is
// a GPU, it has rows too.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/eval/image_error.hpp"
#include "gsnav/eval/oracle.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/mesh_scene.hpp"
#include "samples.hpp"
#include "workload.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#endif

using namespace gsnav;
using gsnav_bench::median;

namespace {

constexpr int kRepeats = 15;

/// A ball with a wavy surface, so that no two of its triangles look alike.
SurfaceMesh ball(std::uint32_t around, std::uint32_t down) {
  using std::numbers::pi;
  SurfaceMesh m;
  for (std::uint32_t i = 0; i <= down; ++i) {
    for (std::uint32_t j = 0; j < around; ++j) {
      const double polar = pi * i / down, turn = 2 * pi * j / around;
      const double r = 0.35 * (1 + 0.1 * std::sin(6 * turn) * std::sin(5 * polar));
      m.geometry.vertices.push_back(vec_cast<float>(
          Vec3d{std::sin(polar) * std::cos(turn), std::cos(polar), std::sin(polar) * std::sin(turn)} *
          r));
      m.colors.push_back(
          vec_cast<float>(Vec3d{0.5 + 0.4 * std::sin(3 * turn), 0.4, 0.5 + 0.4 * std::cos(4 * polar)}));
    }
  }
  for (std::uint32_t i = 0; i < down; ++i) {
    for (std::uint32_t j = 0; j < around; ++j) {
      const std::uint32_t a = i * around + j, b = i * around + (j + 1) % around;
      m.geometry.triangles.push_back({a, b, a + around});
      m.geometry.triangles.push_back({b, b + around, a + around});
    }
  }
  return m;
}

struct Row {
  const char* name;
  bool gaussians, meshes;
  Composite composite;
  bool through = false;  ///< transparent balls, front and back drawn
};

struct Shown {
  const GaussianCloud& cloud;
  const MeshScene& scene;
  const std::vector<MeshInstance>& instances;  ///< of the scene's first mesh
  const std::vector<Camera>& cameras;
  const std::vector<eval::OracleFrames>& truth;  ///< one per camera
};

template <class B>
void print_rows(B& backend, const std::string& where, const Shown& shown) {
  const GaussianArrays<B> arrays(backend, shown.cloud);
  const GaussianSet set = arrays.set();
  const MeshArrays<B> mesh(backend, shown.scene.view(0));
  std::vector<MeshInstance> instances;
  for (const MeshInstance& i : shown.instances)
    instances.push_back(mesh.instance(i.world_from_mesh, i.id));
  for (const Row& row :
       {Row{"alone", true, false, Composite::merged}, Row{"meshes", false, true, Composite::merged},
        Row{"merged", true, true, Composite::merged}, Row{"glass", true, true, Composite::merged, true},
        Row{"hard_depth", true, true, Composite::hard_depth}}) {
    RenderConfig config;
    config.composite = row.composite;
    BasicRenderer<float, B> renderer(backend, config);
    std::vector<MeshInstance> seen = instances;
    for (MeshInstance& i : seen) {
      i.mesh.two_sided = row.through;
      i.mesh.base_alpha = row.through ? 0.5f : 1.0f;
      i.mesh.alpha_mode = row.through ? MeshAlpha::blend : MeshAlpha::opaque;
    }
    if (row.meshes) renderer.set_meshes(seen);
    const std::span<const GaussianSet> sets(&set, row.gaussians ? 1 : 0);
    Frames<float> frames;
    std::vector<double> view_ms;
    eval::ImageError worst;
    worst.psnr = 1e9;
    double pairs = 0;
    for (std::size_t v = 0; v < shown.cameras.size(); ++v) {
      std::vector<double> ms;
      for (int r = 0; r <= kRepeats; ++r) {
        const auto begin = std::chrono::steady_clock::now();
        renderer.render(sets, std::span(&shown.cameras[v], 1), frames).throw_if_error();
        const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
        if (r > 0) ms.push_back(took.count());
      }
      view_ms.push_back(median(ms));
      pairs += static_cast<double>(frames.stats[0].tile_intersections) /
               static_cast<double>(shown.cameras.size());
      if (!row.gaussians || !row.meshes || row.through) continue;
      const eval::ImageError e =
          eval::image_error(shown.truth[v].rgb, frames.rgb, 3, shown.truth[v].undecided).value();
      worst.psnr = std::min(worst.psnr, e.psnr);
      worst.p999 = std::max(worst.p999, e.p999);
      worst.max = std::max(worst.max, e.max);
    }
    std::printf("%-11s %-11s  %9.2f", row.name, where.c_str(), median(view_ms));
    if (row.gaussians && row.meshes && !row.through) {
      std::printf(" %9.1f %9.1e %9.1e", worst.psnr, worst.p999, worst.max);
    } else {
      std::printf(" %9s %9s %9s", "", "", "");
    }
    std::printf(" %12.0f\n", pairs);
  }
}

}  // namespace

int main(int argc, char** argv) {
  int width = 256, height = 256;
  if (argc > 1 && std::sscanf(argv[1], "%dx%d", &width, &height) != 2) {
    std::fprintf(stderr, "usage: bench_composite [WIDTHxHEIGHT]\n");
    return 1;
  }
  const std::vector<Camera> cameras = gsnav_bench::sized(width, height);
  const GaussianSet set = gsnav_bench::workload().cloud.set();
  MeshScene scene;
  const std::size_t mesh = scene.add(ball(256, 128)).value();
  std::vector<MeshInstance> instances;
  for (const Camera& c : cameras) {
    const Affine3<double> world = rigid_inverse(c.viewmat);
    instances.push_back(scene.instance(mesh, {{}, world * Vec3d{0.1, 0.2, 2}, 1},
                                       static_cast<std::uint32_t>(instances.size())));
  }
  std::printf("%dx%d, %zu Gaussians, %zu triangles\n", width, height, set.gaussians.size(),
              instances.size() * scene.mesh(mesh).geometry.triangles.size());

  OpenMPBackend openmp;
  std::vector<eval::OracleFrames> truth;
  for (const Camera& c : cameras) {
    MeshWorkspace<double, OpenMPBackend> ws(openmp);
    draw_meshes<double>(openmp, ws, instances, c, {}, 16, true).throw_if_error();
    const eval::OracleMesh planes{{ws.depth.data(), ws.depth.data() + ws.depth.size()},
                                  {ws.color.data(), ws.color.data() + ws.color.size()}};
    eval::OracleConfig config;
    config.mesh = &planes;
    truth.push_back(eval::oracle_render(openmp, set, c, config).value());
  }
  std::printf("%-24s %9s %9s %9s %9s %12s\n", "", "median_ms", "rgb_psnr", "rgb_p99.9", "rgb_max",
              "pairs");
  const Shown shown{gsnav_bench::workload().cloud, scene, instances, cameras, truth};
  for (const int threads : {1, openmp.threads()}) {
    OpenMPBackend backend(threads);
    print_rows(backend, std::to_string(threads) + (threads == 1 ? " thread" : " threads"), shown);
  }
#if defined(GSNAV_HAS_CUDA)
  if (CudaBackend::device_count() > 0) {
    CudaBackend cuda;
    print_rows(cuda, "cuda", shown);
  }
#endif
  return 0;
}
