// SPDX-License-Identifier: Apache-2.0
// Levels of detail at 256x256: time and error against O_photo(4) in one row, beside direct rendering.
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_lod [views [first [each]]]
//
// `views` cameras from number `first` on (8 from 0). Behind each row: the view that gains least; with a
// third argument all views.
// O_photo is drawn in float32 by the exact profile (118 dB from float64, far above what is measured).
// Times are of the processor on one thread, the least of five, so that they mean something beside other
// work.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <span>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/eval/oracle_photo.hpp"
#include "gsnav/scene/lod_build.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/renderer.hpp"
#include "workload.hpp"

using namespace gsnav;

namespace {

constexpr int kSide = 256, kPhoto = 4;

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double psnr(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = static_cast<double>(std::clamp(a[i], 0.0f, 1.0f) - std::clamp(b[i], 0.0f, 1.0f));
    sum += d * d;
  }
  return -10 * std::log10(std::max(sum / static_cast<double>(a.size()), 1e-30));
}

std::vector<float> photo(Renderer<float, OpenMPBackend>& renderer, const GaussianSet& set, const Camera& c) {
  const Frames<float> fine = renderer.render(set, eval::detail::magnified(c, kPhoto)).value();
  std::vector<float> out(3 * kSide * kSide);
  for (std::size_t p = 0; p < out.size(); ++p) {
    const std::size_t channel = p % 3, x = p / 3 % kSide, y = p / 3 / kSide;
    double sum = 0;
    for (std::size_t i = 0; i < kPhoto * kPhoto; ++i) {
      const std::size_t row = y * kPhoto + i / kPhoto, column = x * kPhoto + i % kPhoto;
      sum += static_cast<double>(fine.rgb[3 * (row * kSide * kPhoto + column) + channel]);
    }
    out[p] = static_cast<float>(sum / (kPhoto * kPhoto));
  }
  return out;
}

struct Bench {
  OpenMPBackend one{1};
  const GaussianCloud& cloud;
  const LodTree& tree;
  std::vector<Camera> cameras;
  std::vector<std::vector<float>> truth;
  std::vector<double> direct;
  double direct_ms = 0;
  std::size_t first = 0;  ///< number of the first camera
  bool each = false;      ///< print every view

  /// `pixels` = 0: every Gaussian, through the photo's filter; below: by the asset's own.
  void row(const char* name, double pixels) {
    RenderConfig config;
    config.outputs = kRgb;
    config.profile = Profile::fast;
    Renderer<float, OpenMPBackend> renderer(one, config);
    LodCut cut(tree, cloud);
    LodChoice choice;
    choice.pixels = pixels;
    Frames<float> frames;
    double mean = 0, worst = 1e9, gain = 1e9, ms = 0, visible = 0, pairs = 0;
    std::size_t least_view = 0;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      double least = 1e9;
      for (int repeat = 0; repeat < 5; ++repeat) {
        const double start = cpu_ms();
        const GaussianSet whole = pixels < 0 ? cloud.set() : LodCut::photo_set(cloud, choice);
        const std::span<const GaussianSet> sets =
            pixels > 0 ? cut.select(cameras[c], choice) : std::span(&whole, 1);
        if (pixels > 0) renderer.set_config(lod_config(config, cut.stats()));
        renderer.render(sets, std::span(&cameras[c], 1), frames).throw_if_error();
        least = std::min(least, cpu_ms() - start);
      }
      const double quality = psnr(truth[c], frames.rgb);
      if (pixels < 0) direct.push_back(quality);
      if (each) std::printf("view %zu: %.2f dB, %+.2f, %.2f ms\n", first + c, quality, quality - direct[c], least);
      mean += quality;
      worst = std::min(worst, quality);
      if (quality - direct[c] < gain) least_view = c;
      gain = std::min(gain, quality - direct[c]);
      ms += least;
      visible += static_cast<double>(frames.stats[0].visible);
      pairs += static_cast<double>(frames.stats[0].tile_intersections);
    }
    const double n = static_cast<double>(cameras.size());
    if (pixels < 0) direct_ms = ms / n;
    std::printf("%-12s %6.2f %8.2f %8.2f %9.2f %8.2f %7.2f %9.0f %9.0f %5zu\n", name, std::max(pixels, 0.0),
                mean / n, worst, gain, ms / n, direct_ms / (ms / n), visible / n, pairs / n, first + least_view);
  }
};

}  // namespace

int main(int argc, char** argv) {
  const GaussianCloud& cloud = gsnav_bench::workload().cloud;
  std::vector<Camera> cameras = gsnav_bench::sized(kSide, kSide);
  const std::size_t views = argc > 1 ? static_cast<std::size_t>(std::max(std::atoi(argv[1]), 1)) : 8;
  const std::size_t first = std::min(argc > 2 ? static_cast<std::size_t>(std::max(std::atoi(argv[2]), 0)) : 0,
                                     cameras.size() - 1);
  cameras.erase(cameras.begin(), cameras.begin() + static_cast<std::ptrdiff_t>(first));
  if (cameras.size() > views) cameras.resize(views);
  OpenMPBackend all;
  const double start = cpu_ms();
  const LodTree tree = build_lod(all, cloud).value();
  std::printf("%zu Gaussians; tree of %zu levels built in %.1f s of processor, %.0f MB; %zu views\n",
              cloud.size(), tree.levels(), (cpu_ms() - start) * 1e-3,
              static_cast<double>(tree.bytes()) * 1e-6, cameras.size());
  RenderConfig exact;
  exact.outputs = kRgb;
  Renderer<float, OpenMPBackend> renderer(all, exact);
  Bench bench{OpenMPBackend(1), cloud, tree, cameras, {}, {}, 0, first, argc > 3};
  for (const Camera& c : cameras) bench.truth.push_back(photo(renderer, cloud.set(), c));
  std::printf("%-12s %6s %8s %8s %9s %8s %7s %9s %9s %5s\n", "", "pixels", "mean dB", "worst", "least +dB",
              "ms", "faster", "visible", "pairs", "view");
  bench.row("direct fast", -1);
  bench.row("photo filter", 0);
  for (const double pixels : {0.35, 0.5, 0.7, 0.8, 1.0, 1.4, 2.0}) bench.row("lod", pixels);
  return 0;
}
