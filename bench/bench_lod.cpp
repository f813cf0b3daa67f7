// SPDX-License-Identifier: Apache-2.0
// Levels of detail against direct rendering: error and time in one row. Errors are against O_photo(4).
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_lod [--size 256x256]
//       [--cameras N] [--gpu] [views [first [each]]]
//
// Without the variables, the scene is the embedded flat from its four viewpoints. The default is 8
// views. N is the number of cameras in one call on a GPU, at least the views. More than the views repeat
// them from places some centimetres away. --gpu leaves out the rows of a processor.
//
// Times are processor times of RGB frames on one thread, the least of five runs per view. RGB-D (with
// alpha) and depth alone are timed for many cameras in one call, and else nan. `least +dB` is the
// smallest gain of a view over direct rendering, `below` the number of views below direct rendering.
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
#include <string>
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

/// The rows of a processor.
void rows_on_cpu(LodViews& shown, const GaussianCloud& cloud, const LodTree& tree,
                 const VisibleSets& visible, const std::vector<double>& pixels) {
  LodRow::print_head();
  row(shown, cloud, tree, "direct fast", LodDraw::direct, 0);
  row(shown, cloud, tree, "photo filter", LodDraw::photo, 0);
  for (const double p : pixels) row(shown, cloud, tree, "lod", LodDraw::lod, p);
  row(shown, cloud, tree, "fast, seen", LodDraw::seen, 0, &visible);
  for (const double p : pixels) row(shown, cloud, tree, "lod, seen", LodDraw::lod, p, &visible);
  if (const char* scene = std::getenv("GSNAV_BENCH_SCENE"); scene != nullptr) {
    if (const auto set = io::load_shipped_levels(scene).value(); set) {
      for (const double p : pixels) row(shown, set->cloud, set->tree, "shipped", LodDraw::lod, p);
    }
  }
}

struct Arguments {
  int width = 256, height = 256;
  std::size_t cameras = 1, views = 8, first = 0;
  bool each = false, gpu_alone = false;
};

/// Ends the program if an argument is wrong.
Arguments arguments(int argc, char** argv) {
  Arguments a;
  int place = 0;  // of the next argument without a name
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    char* end = nullptr;
    if (name == "--gpu") {
      a.gpu_alone = true;
      continue;
    } else if (name == "--size" && i + 1 < argc) {
      if (std::sscanf(argv[++i], "%dx%d", &a.width, &a.height) == 2 && a.width > 0 && a.height > 0)
        continue;
    } else if (name == "--cameras" && i + 1 < argc) {
      a.cameras = std::strtoull(argv[++i], &end, 10);
      if (*end == '\0') continue;
    } else if (place == 2 && name == "each") {
      a.each = true;
      continue;
    } else if (const auto value = std::strtoull(argv[i], &end, 10);
               place < 2 && *end == '\0' && end != argv[i]) {
      (place++ == 0 ? a.views : a.first) = value;
      continue;
    }
    std::fprintf(
        stderr,
        "bench_lod: '%s' is not --size 256x256, --cameras N, --gpu, a number of views, the first view "
        "or, after both, 'each'\n",
        argv[i]);
    std::exit(2);
  }
  return a;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments asked = arguments(argc, argv);
  const GaussianCloud& cloud = workload().cloud;
  std::vector<Camera> cameras = sized(asked.width, asked.height);
  const std::size_t first = std::min(asked.first, cameras.size() - 1);
  cameras.erase(cameras.begin(), cameras.begin() + static_cast<std::ptrdiff_t>(first));
  if (cameras.size() > asked.views) cameras.resize(std::max<std::size_t>(asked.views, 1));
  OpenMPBackend all;
  const double start = cpu_ms();
  const LodTree tree = build_lod(all, cloud).value();
  std::printf("%zu Gaussians; tree of %zu levels built in %.1f s of processor, %.0f MB; %zu views\n",
              cloud.size(), tree.levels(), (cpu_ms() - start) * 1e-3,
              static_cast<double>(tree.bytes()) * 1e-6, cameras.size());
  LodViews shown = lod_views(cloud, cameras);
  shown.first = first;
  shown.each = asked.each;
  const std::vector<double> pixels{0.5, LodChoice{}.pixels, 1.5, 2.0, 3.0, 4.0, 6.0};
  const VisibleSets visible = workload_visible_sets();
  if (!asked.gpu_alone) rows_on_cpu(shown, cloud, tree, visible, pixels);
#if defined(GSNAV_HAS_CUDA)
  lod_rows_on_gpu(shown, asked.cameras, cloud, tree, visible, pixels);
#endif
  return 0;
}
