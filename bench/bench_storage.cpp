// SPDX-License-Identifier: Apache-2.0
// bench_storage [--scene FILE] [--cameras FILE] [--threads N]: a scene in each way of keeping it in
// memory: what that takes, what it changes, and the time of a frame (RGB, median over views and
// repeats), one row each, and what each packed plane changes by itself, as in docs/formats.md.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "compare.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/detail/scene/views_around.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/renderer.hpp"

namespace {

using namespace gsnav;

struct Size {
  int width, height;
};
constexpr Size kSizes[] = {{256, 256}, {640, 480}, {1920, 1080}};

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::vector<Camera> resized(const std::vector<Camera>& cameras, const Size& size) {
  std::vector<Camera> out = cameras;
  for (Camera& c : out) {
    const double x = static_cast<double>(size.width) / c.width,
                 y = static_cast<double>(size.height) / c.height;
    c.fx *= x;
    c.cx *= x;
    c.fy *= y;
    c.cy *= y;
    c.width = size.width;
    c.height = size.height;
  }
  return out;
}

/// Milliseconds of a frame, the median of `repeats` of each camera.
double frame_time(OpenMPBackend& backend, const GaussianSet& set, const std::vector<Camera>& cameras,
                  int repeats) {
  RenderConfig config;
  config.outputs = kRgb;
  Renderer<float, OpenMPBackend> renderer(backend, config);
  Frames<float> frames;
  std::vector<double> times;
  for (int r = 0; r <= repeats; ++r) {
    for (const Camera& camera : cameras) {
      const double start = now();
      renderer.render(std::span(&set, 1), std::span(&camera, 1), frames).throw_if_error();
      if (r > 0) times.push_back(1e3 * (now() - start));
    }
  }
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2),
                   times.end());
  return times[times.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  std::string scene, cameras_path;
  int threads = 0, repeats = 9;
  CLI::App app{"Memory, error and speed of each storage of a scene."};
  app.add_option("--scene", scene, "Any scene that can be read; the embedded flat if not given");
  app.add_option("--cameras", cameras_path,
                 "INRIA cameras.json; four views around the scene if not given");
  app.add_option("--threads", threads, "All cores if not given");
  app.add_option("--repeats", repeats, "Frames of each view")->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  GaussianCloud full;
  if (scene.empty()) {
    full = make_default_scene(1.0).value().cloud;
    sort_spatially(full);
  } else {
    auto loaded = io::load_scene(scene);
    if (!loaded) {
      std::fprintf(stderr, "bench_storage: %s\n", loaded.message().c_str());
      return 1;
    }
    full = std::move(loaded->cloud);
  }
  std::vector<Camera> cameras = views_around(full, guess_up(full).up, 4, 640, 480);
  if (!cameras_path.empty()) {
    auto read = io::load_cameras(cameras_path);
    if (!read) {
      std::fprintf(stderr, "bench_storage: %s\n", read.message().c_str());
      return 1;
    }
    cameras = std::move(*read);
  }
  GaussianCloud compact = full;
  compact_sh(compact);
  // What means in 16 bits would save and cost, where none moves by more than a tenth of its Gaussian's
  // deviation.
  PackLimits all_planes;
  all_planes.mean = 0.1;
  PackErrors errors;
  const PackedCloud packed = pack_cloud(full), smaller = pack_cloud(full, all_planes, &errors);
  GaussianCloud unpacked = unpack_cloud(smaller), widened = compact;
  const GaussianCloud unpacked_default = unpack_cloud(packed);
  expand_sh(widened);
  std::printf("%zu Gaussians of SH degree %d; packed, means too: means in %d bits, SH in %d\n\n",
              full.size(), full.sh_degree, errors.mean_bits, errors.sh_bits);
  OpenMPBackend backend(threads);
  std::printf(
      "| storage | MB | bytes each | 256x256, ms | 640x480, ms | 1920x1080, ms | PSNR, dB | worst view, "
      "dB |\n");
  std::printf("| --- | --- | --- | --- | --- | --- | --- | --- |\n");
  const auto row = [&](const char* name, std::size_t bytes, const GaussianSet& set,
                       const GaussianCloud* floats) {
    std::printf("| %s | %.1f | %.1f |", name, static_cast<double>(bytes) / 1e6,
                static_cast<double>(bytes) / static_cast<double>(full.size()));
    for (const Size& size : kSizes)
      std::printf(" %.2f |", frame_time(backend, set, resized(cameras, size), repeats));
    if (floats == nullptr) {
      std::printf(" | |\n");
    } else {
      const auto images =
          gsnav_convert::image_errors(full, *floats, resized(cameras, kSizes[1])).value();
      std::printf(" %.1f | %.1f |\n", images.psnr, images.worst);
    }
  };
  row("full", full.bytes(), full.set(), nullptr);
  row("compact", compact.bytes(), compact.set(), &widened);
  row("packed", packed.bytes(), packed.set(), &unpacked_default);
  row("packed, means too", smaller.bytes(), smaller.set(), &unpacked);
  std::printf(
      "\nthe last changes means by up to %.2g m (%.2g of a Gaussian's largest deviation), scales by "
      "%.2g of the "
      "largest,\n"
      "rotations by %.2g rad, opacities by %.2g, coefficients of degree 0 by %.2g, others by %.2g (root "
      "mean square "
      "%.2g)\n",
      errors.mean, errors.mean_deviations, errors.scale, errors.rotation, errors.opacity, errors.sh0,
      errors.sh, errors.sh_rms);
  std::printf("\n| packed alone | PSNR, dB | worst view, dB |\n| --- | --- | --- |\n");
  const auto alone = [&](const char* name, const auto& replace) {
    GaussianCloud one = full;
    replace(one);
    one.chunk_bounds.clear();  // they are those of the planes together
    const auto images = gsnav_convert::image_errors(full, one, resized(cameras, kSizes[1])).value();
    std::printf("| %s | %.1f | %.1f |\n", name, images.psnr, images.worst);
  };
  alone("means", [&](GaussianCloud& c) { c.means = unpacked.means; });
  alone("scales", [&](GaussianCloud& c) { c.scales = unpacked.scales; });
  alone("rotations", [&](GaussianCloud& c) { c.quats = unpacked.quats; });
  alone("opacities", [&](GaussianCloud& c) { c.opacities = unpacked.opacities; });
  alone("colours of degree 0", [&](GaussianCloud& c) { c.sh0 = unpacked.sh0; });
  alone("SH bands", [&](GaussianCloud& c) { c.shN = unpacked.shN; });
  return 0;
}
