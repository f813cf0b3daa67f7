// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "jobs.hpp"
#include "runner_timing.hpp"
#include "scenes.hpp"
#include "support/files.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_report;

namespace {

PlanOptions small_plan() {
  PlanOptions o;
  o.views = 2;
  o.sizes = {{64, 64}, {128, 96}};
  o.sensors = {"rgbd", "rgb", "depth"};
  o.backends = {"openmp", "serial"};
  o.profiles = {"exact", "fast"};
  o.knobs = knob_names();
  o.oracles = {Oracle::contract, Oracle::photo4, Oracle::ray, Oracle::untruncated};
  o.knob_size = {64, 64};
  return o;
}

}  // namespace

TEST_CASE("plan: every combination once, knobs one at a time") {
  const std::vector<Setting> settings = plan(small_plan());
  std::set<std::string> seen;
  for (const Setting& s : settings) {
    CHECK(validate(render_config(s, SortOrder::z_depth)).ok());
    CHECK_FALSE(s.oracles.empty());
    CHECK(seen.insert(std::to_string(s.view) + to_string(s.size) + s.sensor + s.backend + s.profile +
                      s.knob + s.knob_value)
              .second);
    if (s.knob != "none") {
      CHECK(s.size == ImageSize{64, 64});
      CHECK(s.profile == "exact");
    }
  }
  const auto plain =
      std::count_if(settings.begin(), settings.end(), [](const Setting& s) { return s.knob == "none"; });
  CHECK(plain == 2 * 2 * (3 * 2 + 2));  // views x sizes x (openmp by sensor and profile, serial as rgbd)
}

TEST_CASE("plan: a knob's config differs from exact in that knob") {
  Setting s;
  s.knob = "alpha_min";
  s.knob_value = "0.015625";
  CHECK(render_config(s, SortOrder::z_depth).quality.alpha_min == 1.0 / 64);
  s = {};
  s.knob = "exponential";
  s.knob_value = "fast";
  CHECK(render_config(s, SortOrder::z_depth).quality.exponential == Exponential::fast);
  CHECK(render_config(s, SortOrder::z_depth).quality.transmittance_min == Quality{}.transmittance_min);
  s = {};
  s.knob = "response";
  s.knob_value = "ray";
  CHECK(render_config(s, SortOrder::z_depth).response == Response::ray);
  CHECK(render_config(s, SortOrder::z_depth).quality.alpha_min == RenderConfig{}.quality.alpha_min);
  s = {};
  s.sensor = "depth";
  CHECK(render_config(s, SortOrder::camera_distance).outputs == (kAlpha | kMedianDepth));
  CHECK(render_config(s, SortOrder::camera_distance).sort_order == SortOrder::camera_distance);
  PlanOptions o = small_plan();
  o.sh_degree = 0;
  for (const Setting& t : plan(o)) CHECK((t.knob != "max_sh_degree" || t.knob_value == "0"));
  o = small_plan();
  o.profiles = {"none"};
  o.knobs = {"storage", "key_bits"};
  o.knob_values = {"packed", "24"};
  CHECK(plan(o).size() == 2 * o.views);
  for (const Setting& t : plan(o)) CHECK((t.knob_value == "packed" || t.knob_value == "24"));
  CHECK(parse_oracle("photo4").value() == Oracle::photo4);
  CHECK(parse_oracle("truth").message().find("contract_f64") != std::string::npos);
}

TEST_CASE("scenes: what --scene says") {
  const gsnav_test::TempFolder folder("report_scenes");
  const std::string cameras = (folder / "cameras.json").string();
  gsnav_test::write_file(cameras, "[]");
  const SceneSpec plain = parse_scene("flat=/data/2_0,2_1").value();
  CHECK(plain.name == "flat");
  CHECK(plain.path == "/data/2_0,2_1");
  CHECK(plain.cameras.empty());
  const SceneSpec with = parse_scene("a=b.ply:" + cameras).value();
  CHECK(with.path == "b.ply");
  CHECK(with.cameras == cameras);
  CHECK(load({"a", {}, cameras}, 4).message().find("camera") != std::string::npos);
  for (const char* bad : {"", "=path", "name="}) CHECK_FALSE(parse_scene(bad).ok());
  const char* const named[][2] = {{"/data/flat.compressed.ply", "flat"},
                                  {"/data/room/", "room"},
                                  {"set.scene_dataset_config.json#kitchen", "kitchen"},
                                  {"/a=1/flat.ply", "flat"}};
  for (const auto& [scene, name] : named) {
    CHECK(parse_scene(scene).value().name == name);
    CHECK(parse_scene(scene).value().path == scene);
  }
  const SceneSpec flat = parse_scene("default").value(),
                  own = parse_scene("x=default:" + cameras).value();
  CHECK(flat.name == "embedded_flat");
  CHECK(flat.views.size() == default_scene_views().size());
  CHECK(own.name == "x");
  CHECK(own.cameras == cameras);
  CHECK(parse_scene("a=b.ply:/none.json").code() == Errc::file_not_found);
  CHECK(benchmark_flat("/none/flat.ply").message().find("--flat") != std::string::npos);
}

TEST_CASE("scenes: without cameras a scan is seen upright, by its ground or by the axis that is said") {
  const gsnav_test::TempFolder folder("report_upright");
  // A room of 10 x 10 m with more at its floor than under its ceiling: z of the file is up.
  GaussianCloudBuilder builder(0);
  Rng rng(2);
  for (int i = 0; i < 4000; ++i) {
    RawGaussian g;
    g.mean = {rng.uniform(-5, 5), rng.uniform(-5, 5), std::max(rng.uniform(-1.5, 2.5), 0.0)};
    g.quat = {1, 0, 0, 0};
    builder.add(g);
  }
  io::save_ply(folder / "floor.ply", builder.cloud()).throw_if_error();
  const auto up_of = [&](const std::string& up) {
    SceneFrame frame;
    frame.up = up;
    const Scene scene = load({"a", (folder / "floor.ply").string(), {}}, 4, frame).value();
    REQUIRE(scene.views.size() == 4);
    const Vec3d down = scene.views[1].viewmat.linear.row[1];  // of the image, in the file's axes
    return -down;
  };
  CHECK(up_of("auto").z > 0.9);
  CHECK(up_of("x").x > 0.9);
  CHECK(up_of("-y").y < -0.9);
}

TEST_CASE("scenes: Gaussians are needed, and a Habitat stage names its file") {
  const gsnav_test::TempFolder folder("report_habitat");
  gsnav_test::write_file(folder / "floor.obj", "v 0 0 0\nv 0 0 4\nv 4 0 4\nf 1 2 3\n");
  const Status none = load({"a", (folder / "floor.obj").string(), {}}, 4).status();
  CHECK(none.message().find("no Gaussians") != std::string::npos);
  const GaussianCloud room = gsnav_test::random_cloud(5, {.count = 60});
  io::save_ply(folder / "room.ply", room).throw_if_error();
  gsnav_test::write_file(folder / "a.stage_config.json", R"({"render_asset":"room.ply"})");
  const std::string stage = (folder / "a.stage_config.json").string();
  const Scene scene = load(parse_scene(stage).value(), 2).value();
  CHECK(scene.name == "a");
  CHECK(std::filesystem::equivalent(scene.path, folder / "room.ply"));
  CHECK(scene.cloud.size() == room.size());
}

TEST_CASE("timing: percentiles are of values that were seen") {
  std::vector<double> values{5, 1, 4, 2, 3};
  CHECK(percentile(values, 0.5) == 3);
  CHECK(percentile(values, 0.99) == 5);
  CHECK(percentile(values, 0.2) == 1);
  values.clear();
  CHECK(percentile(values, 0.5) == 0);
  int calls = 0;
  CHECK(measure([&] { ++calls; }, 7, 10.0).runs == 7);
  CHECK(calls == 9);
}

TEST_CASE("levels of detail are judged by the photo, beside fast, and drawn by its rules") {
  PlanOptions o = small_plan();
  o.profiles = {"exact", "fast", "lod"};
  std::size_t lod = 0, fast = 0;
  for (const Setting& s : plan(o)) {
    if (s.knob != "none") continue;
    if (s.profile == "lod") {
      ++lod;
      CHECK(s.oracles == std::vector<Oracle>{Oracle::photo4});
      const RenderConfig c = render_config(s, SortOrder::z_depth), own = lod_config(c);
      CHECK(c == own);
      CHECK(c.quality.exponential == Exponential::fast);
    }
    const bool judged = std::find(s.oracles.begin(), s.oracles.end(), Oracle::photo4) != s.oracles.end();
    fast += s.profile == "fast" && judged ? 1 : 0;
  }
  CHECK(lod == 2 * 2 * (3 + 1));
  CHECK(fast == 2 * 2);
  o.backends = {"cuda"};
  for (const Setting& s : plan(o)) CHECK(s.profile != "lod");
}

TEST_CASE("timing: two functions are called by turns, and their least times are divided") {
  std::string calls;
  double seconds = 0;
  const auto now = [&] { return seconds; };
  const auto f = [&] {
    calls += 'f';
    seconds += calls.size() < 8 ? 0.5 : 0.003;  // Something else ran during the first calls.
  };
  const auto g = [&] {
    calls += 'g';
    seconds += calls.size() == 10 ? 0.25 : 0.001;
  };
  const PairedTiming t = measure_beside(f, g, 4, /*budget_s=*/60, now);
  CHECK(calls == "fgfgfggffggf");
  CHECK(t.timing.runs == 4);
  CHECK(t.ratio == doctest::Approx(3));
  CHECK(t.timing.p50_ms == doctest::Approx(3));
  CHECK(t.timing.p99_ms == doctest::Approx(500));
  calls.clear();
  CHECK(measure_beside(f, g, 9, /*budget_s=*/0, now).timing.runs == 3);
  CHECK(measure_beside([] {}, [] {}, 2, 1).timing.runs == 2);
}
