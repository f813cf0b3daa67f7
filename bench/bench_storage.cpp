// SPDX-License-Identifier: Apache-2.0
// Compares the ways of keeping a scene in memory. A row each: bytes, time of a frame (RGB, median over
// views and repeats), and the change of the images. A second table has the change by each packed plane
// alone (docs/notes/speed.md).
//
//   bench_storage [--scene FILE] [--cameras FILE] [--threads N]
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "cloud_or_flat.hpp"
#include "compare.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/scene/describe_cloud.hpp"
#include "gsnav/detail/scene/views_around.hpp"
#include "gsnav/scene/basic_renderer.hpp"

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

/// Milliseconds per frame: the median of `repeats` frames of each camera.
double frame_time(OpenMPBackend& backend, const GaussianSet& set, const std::vector<Camera>& cameras,
                  int repeats) {
  RenderConfig config;
  config.outputs = kRgb;
  BasicRenderer<float, OpenMPBackend> renderer(backend, config);
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

/// A cloud in all the ways of keeping it in memory.
struct Storages {
  GaussianCloud full, compact;
  PackedCloud packed, packed_means;  ///< packed_means: with means in 16 bits
  PackErrors errors;                 ///< of packed_means

  explicit Storages(GaussianCloud cloud)
      : full(std::move(cloud)), compact(full), packed(pack_cloud(full)) {
    compact_sh(compact);
    PackLimits limits;
    limits.mean = 0.1;  // no mean moves by more than this part of its Gaussian's standard deviation
    packed_means = pack_cloud(full, limits, &errors);
  }
};

gsnav_convert::ImageErrors image_errors(const GaussianCloud& full, const GaussianCloud& other,
                                        const std::vector<Camera>& cameras) {
  return gsnav_convert::image_errors(full, other, resized(cameras, kSizes[1])).value();
}

void print_storages(const Storages& s, const std::vector<Camera>& cameras, int threads, int repeats) {
  OpenMPBackend backend(threads);
  std::printf(
      "| storage | MB | bytes each | 256x256, ms | 640x480, ms | 1920x1080, ms | PSNR, dB | worst view, "
      "dB |\n");
  std::printf("| --- | --- | --- | --- | --- | --- | --- | --- |\n");
  const auto row = [&](const char* name, std::size_t bytes, const GaussianSet& set,
                       const GaussianCloud* floats) {
    std::printf("| %s | %.1f | %.1f |", name, static_cast<double>(bytes) / 1e6,
                static_cast<double>(bytes) / static_cast<double>(s.full.size()));
    for (const Size& size : kSizes)
      std::printf(" %.2f |", frame_time(backend, set, resized(cameras, size), repeats));
    if (floats == nullptr) {
      std::printf(" | |\n");
    } else {
      const auto images = image_errors(s.full, *floats, cameras);
      std::printf(" %.1f | %.1f |\n", images.psnr, images.worst);
    }
  };
  GaussianCloud widened = s.compact;
  expand_sh(widened);
  const GaussianCloud unpacked = unpack_cloud(s.packed), unpacked_means = unpack_cloud(s.packed_means);
  row("full", s.full.bytes(), s.full.set(), nullptr);
  row("compact", s.compact.bytes(), s.compact.set(), &widened);
  row("packed", s.packed.bytes(), s.packed.set(), &unpacked);
  row("packed, means too", s.packed_means.bytes(), s.packed_means.set(), &unpacked_means);
}

void print_pack_errors(const PackErrors& e) {
  std::printf(
      "\nthe last changes means by up to %.2g m (%.2g of a Gaussian's largest deviation), scales by "
      "%.2g of the largest,\n"
      "rotations by %.2g rad, opacities by %.2g, coefficients of degree 0 by %.2g, others by %.2g (root "
      "mean square %.2g)\n",
      e.mean, e.mean_deviations, e.scale, e.rotation, e.opacity, e.sh0, e.sh, e.sh_rms);
}

/// Prints the change of images by each packed plane alone.
void print_planes(const Storages& s, const std::vector<Camera>& cameras) {
  const GaussianCloud unpacked = unpack_cloud(s.packed_means);
  std::printf("\n| packed alone | PSNR, dB | worst view, dB |\n| --- | --- | --- |\n");
  const auto alone = [&](const char* name, auto GaussianCloud::*plane) {
    GaussianCloud one = s.full;
    one.*plane = unpacked.*plane;
    one.chunk_bounds.clear();  // these bounds are of all planes together
    const auto images = image_errors(s.full, one, cameras);
    std::printf("| %s | %.1f | %.1f |\n", name, images.psnr, images.worst);
  };
  alone("means", &GaussianCloud::means);
  alone("scales", &GaussianCloud::scales);
  alone("rotations", &GaussianCloud::quats);
  alone("opacities", &GaussianCloud::opacities);
  alone("colours of degree 0", &GaussianCloud::sh0);
  alone("SH bands", &GaussianCloud::shN);
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
  auto cloud = gsnav_bench::cloud_or_flat(scene);
  if (!cloud) {
    std::fprintf(stderr, "bench_storage: %s\n", cloud.message().c_str());
    return 1;
  }
  std::vector<Camera> cameras = views_around(*cloud, guess_up(*cloud).up, 4, 640, 480);
  if (!cameras_path.empty()) {
    auto read = io::load_cameras(cameras_path);
    if (!read) {
      std::fprintf(stderr, "bench_storage: %s\n", read.message().c_str());
      return 1;
    }
    cameras = std::move(*read);
  }
  const Storages storages(std::move(*cloud));
  std::printf("%zu Gaussians of SH degree %d; packed, means too: means in %d bits, SH in %d\n\n",
              storages.full.size(), storages.full.sh_degree, storages.errors.mean_bits,
              storages.errors.sh_bits);
  print_storages(storages, cameras, threads, repeats);
  print_pack_errors(storages.errors);
  print_planes(storages, cameras);
  return 0;
}
