// SPDX-License-Identifier: Apache-2.0
// Device, and what runs on a device that is chosen at run time: the same bits as the templates.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "doctest/doctest.h"
#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/demo/people.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/device/simulator.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "gsnav/sim/basic_simulator.hpp"
#include "gsnav/sim/follower.hpp"
#include "sim/mesh_box.hpp"
#include "support/compiled_frames.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// The flat with one person, coarse.
const std::shared_ptr<const SimulatorScene>& flat() {
  static const auto scene =
      std::make_shared<const SimulatorScene>(default_simulator_scene(1, 1, 0.05).value());
  return scene;
}

Camera camera_in_flat(std::size_t view) {
  const DefaultView v = default_scene_views()[view];
  return Camera::look_at(v.eye, v.target, {0, 1, 0}, 48, 32, 90);
}

/// Devices of this machine; CPUs with one thread and two.
std::vector<Device> devices() {
  std::vector<Device> out;
  for (const std::string& name : Device::available()) {
    out.push_back(Device::parse(name).value());
    if (name == "cpu") out.push_back(Device::parse("cpu:2").value());
  }
  return out;
}

bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

SimulatorConfig small_rgbd() {
  SimulatorConfig config;
  config.sensors = rgbd_sensors(24, 32);
  config.seed = 7;
  return config;
}

void check_same(const Observations& a, const Observations& b) {
  CHECK(a.reward == b.reward);
  CHECK(a.point_goal.distance == b.point_goal.distance);
  CHECK(a.time == b.time);
  REQUIRE(a.images.size() == b.images.size());
  for (std::size_t i = 0; i < a.images.size(); ++i) {
    CHECK(a.images[i].uuid == b.images[i].uuid);
    CHECK(std::ranges::equal(a.images[i].data, b.images[i].data));
  }
}

}  // namespace

TEST_CASE("a device is found by its name, and says it") {
  CHECK(Device::parse("serial").value() == Device());
  CHECK(Device().name() == "serial");
  for (const std::string& name : Device::available()) {
    const Device device = Device::parse(name).value();
    CHECK(device.name() == name);
    CHECK_FALSE(device.description().empty());
  }
  const Device best = Device::parse("best").value();
  CHECK(best.name() == Device::available().back());
#if defined(_OPENMP)
  const Device four = Device::parse("cpu:4").value();
  CHECK(four.kind() == DeviceKind::cpu);
  CHECK(four.threads() == 4);
  CHECK(four.name() == "cpu:4");
  CHECK(has(four.description(), "CPU, 4 threads, "));
  const std::string set = four.description().substr(std::string("CPU, 4 threads, ").size());
  const bool known = set == "AVX-512" || set == "AVX2" || set == "NEON" || set == "portable code" ||
                     has(set, "SSE2 (no FMA: a frame takes ");
  CHECK(known);
#endif
}

TEST_CASE("a device that is not there is refused, and those that are there are named") {
  for (const char* text :
       {"", "gpu", "CPU", "cpu:", "cpu:0", "cpu:-1", "cpu:4x", "cpu: 4", "cpu:99999999999", "serial:1",
        "best:1", "cuda:", "cuda:-1", "cuda:x", "cpu:4:4", "\xff\x01"}) {
    CAPTURE(text);
    const auto device = Device::parse(text);
    REQUIRE_FALSE(device.ok());
    CHECK(device.code() == Errc::invalid_argument);
  }
  CHECK(has(Device::parse("gpu").message(), "there are: serial"));
  const auto gpu = Device::parse("cuda:4000");
  CHECK(gpu.code() == Errc::unsupported);
  CHECK(has(gpu.message(), "there are: serial"));
}

TEST_CASE("an unknown instruction set is refused where a device would use it") {
  const char* const given = std::getenv("GSNAV_ISA");
  const std::string before = given == nullptr ? "" : given;
  setenv("GSNAV_ISA", "avx1024", 1);
  for (const char* text : {"cpu", "cpu:2", "best"}) {
    const auto device = Device::parse(text);
    CHECK(device.code() == Errc::invalid_argument);
    CHECK(has(device.message(), "GSNAV_ISA=avx1024: must be baseline, avx2 or avx512"));
  }
  CHECK(Device::parse("serial").ok());
  setenv("GSNAV_ISA", "avx2", 1);
  CHECK(Device::parse("cpu").ok());
  if (given == nullptr) {
    unsetenv("GSNAV_ISA");
  } else {
    setenv("GSNAV_ISA", before.c_str(), 1);
  }
}

TEST_CASE("renderer: the bits of the template, on every device, with people at a time") {
  const Vec3d person = flat()->avatars[0].placement(1.5).translation + Vec3d{0, 1, 0};
  const std::vector<Camera> cameras{
      Camera::look_at(person + Vec3d{0.6, 0.3, 0.6}, person, {0, 1, 0}, 48, 32, 90), camera_in_flat(2)};
  RenderOptions options;
  options.render.outputs = kRgb | kAlpha | kAnyDepth;
  SerialBackend backend;
  SceneOnBackend<SerialBackend> scene(backend, flat());
  REQUIRE(scene.pose(0, 1.5).ok());
  BasicRenderer<float, SerialBackend> renderer(backend, scene.render_config(options.render));
  const auto want = renderer.render(scene.sets(0), cameras).value();
  for (const Device& device : devices()) {
    CAPTURE(device.name());
    auto made = Renderer::create(device, flat(), options);
    REQUIRE(made.ok());
    Renderer moved = std::move(*made);
    const auto got = moved.render(cameras, 1.5).value();
    CHECK(got.rgb == want.rgb);
    CHECK(got.alpha == want.alpha);
    CHECK(got.median_depth == want.median_depth);
    CHECK(got.expected_depth == want.expected_depth);
    CHECK(got.first_hit_depth == want.first_hit_depth);
    CHECK(moved.render(cameras, 2.5).value().rgb != want.rgb);  // the person has gone on
    CHECK(made->render(cameras, 1.5).code() == Errc::invalid_argument);
    CHECK(has(made->render(cameras, 1.5).message(), "moved from"));
  }
}

TEST_CASE("renderer: a cloud alone, rules that change, errors that name what is wrong") {
  const GaussianCloud cloud = make_default_scene(0.05).value().cloud;
  auto renderer = Renderer::create(Device(), cloud).value();
  const Camera camera = camera_in_flat(0);
  const auto frames = renderer.render(camera).value();
  CHECK(frames.rgb.size() == 48 * 32 * 3);
  CHECK(*std::ranges::max_element(frames.median_depth) > 1);
  RenderConfig depth_only;
  depth_only.outputs = kMedianDepth;
  REQUIRE(renderer.set_config(depth_only).ok());
  const auto depth = renderer.render(camera).value();
  CHECK(depth.rgb.empty());
  CHECK(depth.median_depth == frames.median_depth);

  RenderConfig wrong;
  wrong.quality.alpha_min = 2;
  CHECK(has(renderer.set_config(wrong).message(), "alpha_min"));
  Camera bad = camera;
  bad.fx = std::nan("");
  CHECK(has(renderer.render(bad).message(), "Camera.fx"));
  const std::vector<Camera> sizes{camera, Camera::look_at({0, 1, 0}, {1, 1, 0}, {0, 1, 0}, 8, 8, 90)};
  CHECK(renderer.render(sizes).code() == Errc::invalid_argument);
  CHECK(renderer.render(std::span<const Camera>()).code() == Errc::invalid_argument);
  CHECK(Renderer::create(Device(), std::shared_ptr<const SimulatorScene>()).code() ==
        Errc::invalid_argument);
  RenderOptions lod;
  lod.detail.lod = LodChoice{};
  CHECK(has(Renderer::create(Device(), flat(), lod).message(), "lod is null"));
}

TEST_CASE("renderer: packed clouds, bands that it needs and a light on meshes, on every device") {
  GaussianCloud cloud = random_cloud(12, {.count = 2500});
  sort_spatially(cloud);
  SceneBands bands;  // chunk c has the SH bands up to c % 4
  for (std::size_t c = 0; c < cloud.view().chunk_count(); ++c)
    bands.chunk_sh_degrees.push_back(static_cast<std::uint8_t>(c % 4));
  SimulatorScene as_floats, as_packed;
  as_floats.assets.push_back({std::make_shared<const GaussianCloud>(cloud)});
  as_floats.assets[0].bands = std::make_shared<const SceneBands>(bands);
  as_packed.assets.push_back({});
  as_packed.assets[0].packed = std::make_shared<const PackedCloud>(pack_cloud(cloud));
  SceneMesh mesh = turned_box(0.6);
  mesh.world_from_surface.translation = {0.3, -0.4, 3};
  as_packed.meshes.push_back(mesh);
  MeshLight light;
  light.unlit = false;
  light.direction = {0.2, -0.3, -1};

  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 48, 32, 70);
  SerialBackend backend;
  BasicRenderer<float, SerialBackend> renderer(backend);
  const auto all_bands = renderer.render(cloud.set(), camera).value().rgb;
  const auto some_bands = renderer.render(bands.applied_to(cloud.set()), camera).value().rgb;
  REQUIRE(some_bands != all_bands);
  const GaussianSet packed = as_packed.assets[0].packed->set();
  const auto instances = mesh.surface->in_world(mesh.world_from_surface);
  renderer.set_meshes(instances);
  const auto unlit = renderer.render(packed, camera).value().rgb;
  renderer.set_meshes(instances, light);
  const auto lit = renderer.render(packed, camera).value().rgb;
  REQUIRE(unlit != lit);
  for (const Device& device : devices()) {
    CAPTURE(device.name());
    const auto draw = [&](const SimulatorScene& scene) {
      return Renderer::create(device, std::make_shared<const SimulatorScene>(scene)).value();
    };
    CHECK(draw(as_floats).render(camera).value().rgb == some_bands);
    Renderer of_packed = draw(as_packed);
    CHECK(of_packed.render(camera).value().rgb == unlit);
    REQUIRE(of_packed.set_light(light).ok());
    CHECK(of_packed.render(camera).value().rgb == lit);
    const Renderer moved = std::move(of_packed);
    CHECK(of_packed.set_light(light).code() == Errc::invalid_argument);
  }
}

TEST_CASE("renderer: assets that cannot be drawn so are named") {
  const auto cloud = std::make_shared<const GaussianCloud>(random_cloud(12, {.count = 300}));
  const auto message = [](SceneAsset asset, const RenderOptions& how = {}) {
    SimulatorScene scene;
    scene.assets.push_back(std::move(asset));
    return Renderer::create(Device(), std::make_shared<const SimulatorScene>(std::move(scene)), how)
        .message();
  };
  CHECK(has(message({}), "assets[0].cloud is null"));
  SceneAsset asset{cloud};
  asset.bands = std::make_shared<const SceneBands>();
  CHECK(has(message(asset), "assets[0].bands have another number of chunks than the cloud"));
  asset = {cloud};
  asset.packed = std::make_shared<const PackedCloud>(pack_cloud(*cloud));
  CHECK(has(message(asset), "assets[0].packed"));
  asset.cloud = nullptr;
  RenderOptions how;
  how.detail.visible_sets = true;
  CHECK(has(message(asset, how), "visible_sets"));
  how.detail.lod = LodChoice{};
  CHECK(has(message(asset, how), "lod: SimulatorScene.assets[0].packed"));
}

TEST_CASE("simulator: the bits of the template, on every device") {
  const auto episodes = generate_episodes(*flat()->navmesh, 2, 1).value();
  for (const Device& device : devices()) {
    CAPTURE(device.name());
    SerialBackend backend;
    auto want = BasicSimulator<SerialBackend>::create(backend, flat(), small_rgbd()).value();
    auto made = Simulator::create(device, flat(), small_rgbd());
    REQUIRE(made.ok());
    Simulator sim = std::move(*made);
    CHECK(sim.device() == device);
    CHECK(&sim.scene() == flat().get());
    const GeodesicFollower policy;
    for (const PointNavEpisode& episode : episodes) {
      check_same(sim.reset(episode).value(), want.reset(episode).value());
      for (int i = 0; i < 12 && !want.done(); ++i) {
        const Action action = policy.next(want.world());
        check_same(sim.step(action).value(), want.step(action).value());
        CHECK(sim.done() == want.done());
      }
      const WorldState state = sim.state();
      const Observations seen = sim.observe().value();
      const std::vector<float> rgb(seen["rgb"].begin(), seen["rgb"].end());
      REQUIRE(sim.step(Action::move_forward).ok());
      REQUIRE(sim.set_state(state).ok());
      CHECK(std::ranges::equal(sim.observe().value()["rgb"], rgb));
      const auto above = sim.render(camera_in_flat(1)), above_want = want.render(camera_in_flat(1));
      CHECK((*above)->rgb == (*above_want)->rgb);
      CHECK(std::ranges::equal(sim.goal_images().value()[0].data, want.goal_images().value()[0].data));
      CHECK(sim.metrics().spl == want.metrics().spl);
    }
    CHECK(sim.render_count() == want.render_count() + 6);
    CHECK(made->reset(episodes[0]).code() == Errc::invalid_argument);
    CHECK(made->step(Action::stop).code() == Errc::invalid_argument);
    CHECK(made->done());
  }
}

TEST_CASE("simulator: what is wrong is an error, never an exception") {
  SimulatorConfig config = small_rgbd();
  config.sensors[0].hfov = 500;
  CHECK(has(Simulator::create(Device(), flat(), config).message(), "hfov"));
  CHECK(Simulator::create(Device(), std::shared_ptr<const SimulatorScene>(), small_rgbd()).code() ==
        Errc::invalid_argument);
  auto sim = Simulator::create(Device(), flat(), small_rgbd()).value();
  CHECK(sim.step(Action::move_forward).code() == Errc::invalid_argument);  // before reset
  CHECK(sim.set_agent({std::nan(""), 0, 0}, 0).code() == Errc::invalid_argument);
}

TEST_CASE("batch simulator: the bits of the template, on every device") {
  const auto episodes = generate_episodes(*flat()->navmesh, 6, 1).value();
  const auto episode_of = [&episodes](std::size_t e, std::size_t k) -> Result<BatchEpisode> {
    return BatchEpisode{0, episodes[(2 * k + e) % episodes.size()]};
  };
  const BatchConfig config{small_rgbd()};
  for (const Device& device : devices()) {
    CAPTURE(device.name());
    SerialBackend backend;
    auto want = make_batch_simulator(backend, {flat()}, config, 3, episode_of).value();
    auto made = BatchSimulator::create(device, {flat()}, config, 3, episode_of);
    REQUIRE(made.ok());
    BatchSimulator sim = std::move(*made);
    REQUIRE(sim.environments() == 3);
    const auto check_steps = [](const BatchStep& a, const BatchStep& b) {
      CHECK(std::ranges::equal(a.rewards, b.rewards));
      CHECK(std::ranges::equal(a.terminated, b.terminated));
      for (std::size_t i = 0; i < a.images.size(); ++i)
        CHECK(std::ranges::equal(a.images[i].data, b.images[i].data));
    };
    check_steps(sim.reset().value(), want.reset().value());
    const GeodesicFollower policy;
    for (int i = 0; i < 10; ++i) {
      std::vector<Action> actions;
      for (std::size_t e = 0; e < 3; ++e) actions.push_back(policy.next(want.world(e)));
      check_steps(sim.step(actions).value(), want.step(actions).value());
    }
    CHECK(made->environments() == 0);
    CHECK(made->reset().code() == Errc::invalid_argument);
    CHECK(sim.step(std::vector<Action>(2)).code() == Errc::invalid_argument);
  }
  CHECK(BatchSimulator::create_from_library(Device(), nullptr, config, 1, episode_of).code() ==
        Errc::invalid_argument);
}

TEST_CASE("batch simulator: scenes from a library have the bits of scenes that are held") {
  const auto episodes = generate_episodes(*flat()->navmesh, 4, 1).value();
  const auto episode_of = [&episodes](std::size_t e, std::size_t k) -> Result<BatchEpisode> {
    return BatchEpisode{(e + k) % 2, episodes[(2 * k + e) % episodes.size()]};
  };
  const BatchConfig config{small_rgbd()};
  const Device device;
  const auto load = []() -> Result<SimulatorScene> { return *flat(); };
  // [snippet: library]
  std::vector<gsnav::SceneEntry> entries{{"flat A", load}, {"flat B", load}};
  auto library = gsnav::SceneLibrary::create(entries, std::size_t{8} << 30).value();  // 8 GiB
  auto sim = gsnav::BatchSimulator::create_from_library(device, library, config, 2, episode_of).value();
  // [/snippet]
  auto want = BatchSimulator::create(device, {flat(), flat()}, config, 2, episode_of).value();
  auto got = sim.reset().value(), expected = want.reset().value();
  CHECK(sim.scene_of(0) == 0);
  CHECK(sim.scene_of(1) == 1);
  for (std::size_t i = 0; i < got.images.size(); ++i)
    CHECK(std::ranges::equal(got.images[i].data, expected.images[i].data));
}
