// SPDX-License-Identifier: Apache-2.0
//
// Draws frames on request, for bench/paired.py, which times versions of gsnav next to each other.
// It compiles with this version and with that of commit 99a09ed. docs/notes/speed.md says how.
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_engine WIDTH HEIGHT THREADS
//
// Prints `views N`. For each line `OUTPUT/PROFILE VIEW` on its standard input it draws a view, or all
// views in one call if VIEW is -1. Then it prints `ms TIME HASH`: the time by frame, and a hash of the
// images. OUTPUT is rgb, depth or rgbd. PROFILE is exact, fast, seen (fast with visible sets), compact
// or packed (fast with such storage), or lod.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "visible_workload.hpp"
#include "workload.hpp"
#if __has_include("gsnav/scene/basic_renderer.hpp")
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/scene/basic_renderer.hpp"
namespace {
using Drawer = gsnav::BasicRenderer<float, gsnav::OpenMPBackend>;
void set_profile(gsnav::RenderConfig& c, bool exact) {
  c.quality = exact ? gsnav::Quality::exact() : gsnav::Quality::fast();
}
void set_seen(gsnav::GaussianSet& set, gsnav::View<const std::uint32_t> seen) {
  set.selection.seen = seen;
}
}  // namespace
#else
#include "gsnav/scene/lod_build.hpp"
#include "gsnav/scene/renderer.hpp"
namespace {
using Drawer = gsnav::Renderer<float, gsnav::OpenMPBackend>;
void set_profile(gsnav::RenderConfig& c, bool exact) {
  c.profile = exact ? gsnav::Profile::exact : gsnav::Profile::fast;
}
void set_seen(gsnav::GaussianSet& set, gsnav::View<const std::uint32_t> seen) {
  set.gaussians.seen = seen;
}
}  // namespace
#endif

using namespace gsnav;
using gsnav_bench::workload;

namespace {

/// Draws the workload's views at one size.
struct Engine {
  OpenMPBackend backend;
  Drawer renderer;
  std::vector<Camera> cameras;
  Frames<float> frames;
  std::optional<LodTree> tree;
  std::optional<LodCut> cut;
  std::optional<VisibleSets> visible;
  std::optional<GaussianCloud> compact;
  std::optional<PackedCloud> packed;

  Engine(int width, int height, int threads)
      : backend(threads), renderer(backend), cameras(gsnav_bench::sized(width, height)) {}

  void draw(const std::string& output, const std::string& profile, std::span<const Camera> views) {
    RenderConfig config;
    config.outputs = output == "depth"  ? kMedianDepth
                     : output == "rgbd" ? kRgb | kAlpha | kMedianDepth
                                        : kRgb;
    set_profile(config, profile == "exact");
    GaussianSet whole = profile == "compact"  ? compact->set()
                        : profile == "packed" ? packed->set()
                                              : workload().cloud.set();
    std::span<const GaussianSet> sets(&whole, 1);
    if (profile == "seen") {
      if (const auto cell = visible->cell_of(views[0])) set_seen(whole, visible->seen_from(*cell));
    } else if (profile == "lod") {
      LodChoice choice;
      choice.hysteresis = 0;  // the views are unrelated
      sets = cut->select(views[0], choice, {}, {});
      config = lod_config(config);
    }
    renderer.set_config(config);
    renderer.render(sets, views, frames).throw_if_error();
  }

  void prepare(const std::string& profile) {
    if (profile == "seen" && !visible) visible = gsnav_bench::workload_visible_sets();
    if (profile == "compact" && !compact) compact_sh(compact.emplace(workload().cloud));
    if (profile == "packed" && !packed) packed = pack_cloud(workload().cloud);
    if (profile == "lod" && !cut) {
      tree = build_lod(backend, workload().cloud).value();
      cut.emplace(*tree, workload().cloud);
    }
  }
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "bench_engine WIDTH HEIGHT THREADS\n");
    return 2;
  }
  Engine engine(std::atoi(argv[1]), std::atoi(argv[2]), std::atoi(argv[3]));
  std::printf("views %zu\n", engine.cameras.size());
  std::fflush(stdout);
  char output[16] = {}, profile[16] = {};
  int view = 0;
  while (std::scanf(" %15[a-z]/%15[a-z] %d", output, profile, &view) == 3) {
    engine.prepare(profile);
    const std::span<const Camera> all(engine.cameras);
    const std::span<const Camera> views =
        view < 0 ? all : all.subspan(static_cast<std::size_t>(view), 1);
    const auto begin = std::chrono::steady_clock::now();
    engine.draw(output, profile, views);
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - begin;
    const std::vector<float>& image =
        engine.frames.rgb.empty() ? engine.frames.median_depth : engine.frames.rgb;
    const std::string_view bytes(reinterpret_cast<const char*>(image.data()),
                                 image.size() * sizeof(float));
    std::printf("ms %.6f %zx\n", ms.count() / static_cast<double>(views.size()),
                std::hash<std::string_view>{}(bytes));
    std::fflush(stdout);
  }
}
