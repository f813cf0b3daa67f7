// SPDX-License-Identifier: Apache-2.0
// Levels of detail against direct rendering: error and time in one row, 256x256. Errors are against
// O_photo(4).
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_lod [views [first [each]]]
//
// Without the variables, the scene is the embedded flat from its four viewpoints. The default is 8
// views.
//
// Times are processor times of RGB frames on one thread, the least of five runs per view. `least +dB` is
// the smallest gain of a view over direct rendering, `below` the number of views below direct rendering.
//
// Depths come from separate frames that are not timed. Their columns are the share of pixels that differ
// by more than 2 % from the median depths of all of the photo's rays in the pixel, and the 99th
// percentile. If a streamed scene brings its own levels, they have rows next to those of the tree that
// is built. "seen": only the Gaussians visible from the camera's cell are drawn (VisibleSets). Where
// there is a GPU, it has rows too.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <span>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "lod_rows.hpp"
#include "visible_workload.hpp"
#include "workload.hpp"

using namespace gsnav;
using namespace gsnav_bench;

namespace {

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

void row(LodViews& views, const GaussianCloud& cloud, const LodTree& tree, const char* name,
         LodDraw draw, double pixels, const VisibleSets* visible = nullptr) {
  OpenMPBackend one(1);
  RenderConfig config;
  config.outputs = kRgb;
  config.quality = Quality::fast();
  BasicRenderer<float, OpenMPBackend> renderer(one, config);
  LodCut cut(tree, cloud);
  LodChoice choice;
  choice.pixels = std::max(pixels, 1e-3);
  choice.hysteresis = 0;  // the views are unrelated
  LodRow out(views, draw);
  Frames<float> frames, depths;
  for (const Camera& camera : views.cameras) {
    double least = 1e9;
    const auto render = [&](unsigned outputs, Frames<float>& into) {
      GaussianSet whole = draw == LodDraw::photo ? LodCut::photo_set(cloud, choice) : cloud.set();
      const auto cell = visible != nullptr ? visible->cell_of(camera) : std::nullopt;
      View<const std::uint32_t> seen;
      if (cell) seen = whole.selection.seen = visible->seen_from(*cell);
      const std::span<const GaussianSet> sets =
          draw == LodDraw::lod ? cut.select(camera, choice, {}, seen) : std::span(&whole, 1);
      RenderConfig rules = draw == LodDraw::lod ? lod_config(config) : config;
      rules.outputs = outputs;
      renderer.set_config(rules);
      renderer.render(sets, std::span(&camera, 1), into).throw_if_error();
    };
    for (int repeat = 0; repeat < 5; ++repeat) {
      const double start = cpu_ms();
      render(kRgb, frames);
      least = std::min(least, cpu_ms() - start);
    }
    render(kMedianDepth, depths);
    const RenderStats& stats = frames.stats[0];
    out.add(frames.rgb, depths.median_depth, least, static_cast<double>(stats.visible),
            static_cast<double>(stats.tile_intersections));
  }
  out.print(name, pixels);
}

std::size_t number(int argc, char** argv, int i, int least, std::size_t other) {
  return argc > i ? static_cast<std::size_t>(std::max(std::atoi(argv[i]), least)) : other;
}

}  // namespace

int main(int argc, char** argv) {
  const GaussianCloud& cloud = workload().cloud;
  std::vector<Camera> cameras = sized(kLodSide, kLodSide);
  const std::size_t views = number(argc, argv, 1, 1, 8);
  const std::size_t first = std::min(number(argc, argv, 2, 0, 0), cameras.size() - 1);
  cameras.erase(cameras.begin(), cameras.begin() + static_cast<std::ptrdiff_t>(first));
  if (cameras.size() > views) cameras.resize(views);
  OpenMPBackend all;
  const double start = cpu_ms();
  const LodTree tree = build_lod(all, cloud).value();
  std::printf("%zu Gaussians; tree of %zu levels built in %.1f s of processor, %.0f MB; %zu views\n",
              cloud.size(), tree.levels(), (cpu_ms() - start) * 1e-3,
              static_cast<double>(tree.bytes()) * 1e-6, cameras.size());
  LodViews shown = lod_views(cloud, cameras);
  shown.first = first;
  shown.each = argc > 3;
  const std::vector<double> pixels{0.5, LodChoice{}.pixels, 1.5, 2.0, 3.0, 4.0, 6.0};
  LodRow::print_head();
  row(shown, cloud, tree, "direct fast", LodDraw::direct, 0);
  row(shown, cloud, tree, "photo filter", LodDraw::photo, 0);
  for (const double p : pixels) row(shown, cloud, tree, "lod", LodDraw::lod, p);
  const VisibleSets visible = workload_visible_sets();
  row(shown, cloud, tree, "fast, seen", LodDraw::seen, 0, &visible);
  for (const double p : pixels) row(shown, cloud, tree, "lod, seen", LodDraw::lod, p, &visible);
  if (const char* scene = std::getenv("GSNAV_BENCH_SCENE"); scene != nullptr) {
    if (const auto set = io::load_shipped_levels(scene).value(); set) {
      for (const double p : pixels) row(shown, set->cloud, set->tree, "shipped", LodDraw::lod, p);
    }
  }
#if defined(GSNAV_HAS_CUDA)
  lod_rows_on_gpu(shown, cloud, tree, visible, pixels);
#endif
  return 0;
}
