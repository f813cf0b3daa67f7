// SPDX-License-Identifier: Apache-2.0
// Simulators that draw levels of detail.
#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/avatar/skinned_crowd.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "lod/level_support.hpp"
#include "same_bits.hpp"
#include "sim_scene.hpp"
#include "wandering.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// The flat with its levels of detail, and two people.
SimulatorScene detailed_scene() {
  static const auto tree = [] {
    OpenMPBackend backend(2);
    return std::make_shared<const LodTree>(build_lod(backend, *flat_scene().assets[0].cloud).value());
  }();
  SimulatorScene s = peopled_scene(2000);
  s.assets[0].lod = tree;
  return s;
}

/// The same with levels as a set ships them, in place of a tree.
SimulatorScene shipped_scene() {
  static const auto set = [] {
    OpenMPBackend backend(2);
    return join_levels(backend, shipped_levels(*flat_scene().assets[0].cloud, 2), 16).value();
  }();
  SimulatorScene s = peopled_scene(2000);
  s.assets[0].cloud = std::make_shared<const GaussianCloud>(set.cloud);
  s.assets[0].lod = std::make_shared<const LodTree>(set.tree);
  return s;
}

LodChoice coarse() {
  LodChoice c;
  c.pixels = 2;
  c.grain = 1e9;  // merged though the Gaussians of this flat are large
  return c;
}

/// The cell of 0.5 m that a camera is in.
Aabb<double> cell_of(const Camera& camera) {
  Aabb<double> box;
  for (int k = 0; k < 3; ++k) {
    box.low[k] = 0.5 * std::floor(camera.position()[k] / 0.5);
    box.high[k] = box.low[k] + 0.5;
  }
  return box;
}

}  // namespace

TEST_CASE("a simulator with levels of detail sees what the cut of its cell draws, people as they are") {
  OpenMPBackend backend(2);
  bool shipped = false;
  SUBCASE("built") {}
  SUBCASE("shipped by a set") { shipped = true; }
  const SimulatorScene scene = shipped ? shipped_scene() : detailed_scene();
  SimulatorConfig config;
  config.sensors = rgbd_sensors(40, 56);
  const PointNavEpisode episode = to_kitchen();
  auto whole = make_simulator(backend, scene, config).value();
  const auto plain = whole.reset(episode).value();
  const std::vector<float> plain_rgb(plain["rgb"].begin(), plain["rgb"].end());
  config.lod = coarse();
  auto sim = make_simulator(backend, scene, config).value();
  const auto obs = sim.reset(episode).value();
  CHECK_FALSE(same_bits(obs["rgb"], plain_rgb));

  SceneOnBackend<OpenMPBackend> by_hand(backend, std::make_shared<const SimulatorScene>(scene));
  REQUIRE(by_hand.pose(0, sim.clock()).ok());
  const Camera camera = sensor_camera(config.sensors[0], sim.agent().position, sim.agent().rotation());
  LodCut cut(*scene.assets[0].lod, *scene.assets[0].cloud);
  const auto chosen = cut.select_from(cell_of(camera), camera, coarse());
  CHECK(cut.stats().merged > 0);
  std::vector<GaussianSet> sets(chosen.begin(), chosen.end());
  for (std::size_t i = 1; i < by_hand.sets(0).size(); ++i) sets.push_back(by_hand.sets(0)[i]);
  RenderConfig rules = lod_config({});
  rules.outputs = kRgb | kMedianDepth;
  BasicRenderer<float, OpenMPBackend> renderer(backend, rules);
  const auto frames = renderer.render(sets, std::span(&camera, 1)).value();
  CHECK(same_bits(obs["rgb"], frames.rgb));
  // A spectator at the same place too.
  CHECK(same_bits((*sim.render(camera))->rgb, frames.rgb));
}

TEST_CASE("LodChoice::bodies_only: assets without levels are drawn whole, bodies by their levels") {
  OpenMPBackend backend(2);
  SimulatorScene scene = peopled_scene(6000);
  give_body_levels(scene);
  SimulatorConfig config;
  config.sensors = rgbd_sensors(40, 56);
  config.lod = LodChoice{};
  CHECK(!make_simulator(backend, scene, config).ok());
  config.lod->bodies_only = true;
  auto sim = make_simulator(backend, scene, config).value();
  const auto obs = sim.reset(to_kitchen()).value();

  SceneOnBackend<OpenMPBackend> by_hand(backend, std::make_shared<const SimulatorScene>(scene));
  REQUIRE(by_hand.pose(0, sim.clock()).ok());
  const Camera camera = sensor_camera(config.sensors[0], sim.agent().position, sim.agent().rotation());
  std::vector<GaussianSet> sets(by_hand.sets(0).begin(), by_hand.sets(0).end());
  SkinnedCrowd<OpenMPBackend> crowd(backend);
  std::size_t coarse_bodies = 0;
  for (const AvatarActor& a : scene.avatars)
    crowd.add(std::make_shared<const AvatarArrays<OpenMPBackend>>(backend, a.asset(), true));
  REQUIRE(crowd.pose(scene.avatars, sim.clock()).ok());
  for (std::size_t i = 0; i < scene.avatars.size(); ++i) {
    const std::size_t level = level_of_body(*scene.avatars[i].asset(), crowd.set(i).world_from_asset,
                                            crowd.bounds(i), camera, *config.lod);
    sets[1 + i] = filtered_for_photo(crowd.set(i, level), *config.lod);
    coarse_bodies += level > 0 ? 1 : 0;
  }
  CHECK(coarse_bodies > 0);
  RenderConfig rules = lod_config({});
  rules.outputs = kRgb | kMedianDepth;
  BasicRenderer<float, OpenMPBackend> renderer(backend, rules);
  const auto frames = renderer.render(sets, std::span(&camera, 1)).value();
  CHECK(same_bits(obs["rgb"], frames.rgb));
  CHECK(same_bits(obs["depth"], frames.median_depth));
}

TEST_CASE(
    "levels of detail: a batch has the bits of single simulators, and a state those it was saved with") {
  constexpr std::size_t kEnvironments = 3;
  SimulatorScene peopled = detailed_scene(), empty = peopled;
  give_body_levels(peopled);
  empty.avatars.clear();
  const std::vector<std::shared_ptr<const SimulatorScene>> scenes{
      std::make_shared<const SimulatorScene>(peopled), std::make_shared<const SimulatorScene>(empty)};
  BatchConfig config;
  config.sensors = rgbd_sensors(16, 24);
  config.sensors.push_back(config.sensors[0]);
  config.sensors[2].uuid = "who";
  config.sensors[2].kind = SensorKind::semantic;
  config.task.max_steps = 30;
  config.lod = coarse();
  OpenMPBackend backend(2), single_backend(1);
  auto batch = make_batch_simulator(backend, scenes, config, kEnvironments, wandering).value();
  std::vector<BasicSimulator<OpenMPBackend>> single;
  for (const auto& scene : scenes) {
    single.push_back(BasicSimulator<OpenMPBackend>::create(single_backend, scene, config).value());
  }
  auto out = batch.reset().value();
  Rng rng(31);
  for (int step = 0; step < 40; ++step) {
    for (std::size_t e = 0; e < kEnvironments; ++e) {
      // One simulator, brought from state to state.
      BasicSimulator<OpenMPBackend>& alone = single[batch.scene_of(e)];
      REQUIRE(alone.set_state(batch.world(e).state()).ok());
      const auto seen = alone.observe().value();
      for (std::size_t i = 0; i < config.sensors.size(); ++i) {
        REQUIRE(same_bits(out.images[i].of(e), seen.images[i].data));
      }
    }
    std::vector<Action> actions;
    for (std::size_t e = 0; e < kEnvironments; ++e) actions.push_back(wandering_action(rng));
    out = batch.step(actions).value();
  }
}

TEST_CASE("levels of detail that a scene does not have are refused, by name") {
  OpenMPBackend backend(1);
  SimulatorConfig config;
  config.sensors = rgbd_sensors(16, 24);
  config.lod = LodChoice{};
  const auto refused = [&](const SimulatorScene& scene) {
    return make_simulator(backend, scene, config).status();
  };
  CHECK(refused(flat_scene()).code() == Errc::invalid_argument);
  CHECK(refused(flat_scene()).message().find("assets[0].lod is null") != std::string::npos);
  SimulatorScene other = detailed_scene();
  auto more = std::make_shared<LodTree>();
  other.assets[0].lod = more;
  CHECK(refused(other).message().find("of another cloud") != std::string::npos);
  other.assets[0].lod = shipped_scene().assets[0].lod;
  CHECK(refused(other).message().find("of another cloud") != std::string::npos);
  config.lod->pixels = 0;
  CHECK(refused(detailed_scene()).message().find("LodChoice.pixels = 0") != std::string::npos);
  config.lod->pixels = 1;
  CHECK(refused(detailed_scene()).ok());
  const auto batch = make_batch_simulator(
      backend,
      std::vector<std::shared_ptr<const SimulatorScene>>(
          2, std::make_shared<const SimulatorScene>(flat_scene())),
      [&] {
        BatchConfig c;
        c.sensors = config.sensors;
        c.lod = config.lod;
        return c;
      }(),
      2, wandering);
  CHECK(batch.status().message().find("assets[0].lod is null") != std::string::npos);
}

TEST_CASE(
    "a simulator with visible sets draws what is seen from its cell; alone and in a batch the same "
    "bits") {
  OpenMPBackend backend(2);
  SimulatorScene scene = detailed_scene();
  SimulatorConfig config;
  config.sensors = rgbd_sensors(40, 56);
  const PointNavEpisode episode = to_kitchen();
  VisibleSettings settings;
  settings.face = 56;
  settings.near_plane = config.sensors[0].near_plane;
  settings.near_sigma = config.sensors[0].near_sigma;
  // Where the episode begins, and a metre on: beyond nothing is known, and all is drawn.
  const std::vector<Vec3d> eyes{
      {4.6, 1.5, 3.6}, {4.4, 1.5, 3.4}, {4.9, 1.5, 3.6}, {5.3, 1.5, 3.6}, {4.6, 1.501, 3.3}};
  const auto visible = std::make_shared<const VisibleSets>(
      build_visible_sets(backend, *scene.assets[0].cloud, eyes, settings).value());
  scene.assets[0].visible = visible;
  config.visible_sets = true;
  bool levels = false;
  SUBCASE("of the scene whole") {}
  SUBCASE("of its levels of detail") { levels = true; }
  if (levels) config.lod = coarse();
  auto sim = make_simulator(backend, scene, config).value();
  const auto obs = sim.reset(episode).value();

  const Camera camera = sensor_camera(config.sensors[0], sim.agent().position, sim.agent().rotation());
  const auto cell = visible->cell_of(camera);
  REQUIRE(cell);
  CHECK(visible->count_seen(*cell) < visible->cloud_chunks);
  SceneOnBackend<OpenMPBackend> by_hand(backend, std::make_shared<const SimulatorScene>(scene));
  REQUIRE(by_hand.pose(0, sim.clock()).ok());
  LodCut cut(*scene.assets[0].lod, *scene.assets[0].cloud);
  std::vector<GaussianSet> sets;
  if (levels) {
    const auto chosen =
        cut.select_from(cell_of(camera), camera, coarse(), {}, visible->seen_from(*cell));
    sets.assign(chosen.begin(), chosen.end());
  } else {
    sets.push_back(by_hand.sets(0)[0]);
    sets[0].selection.seen = visible->seen_from(*cell);
  }
  for (std::size_t i = 1; i < by_hand.sets(0).size(); ++i) sets.push_back(by_hand.sets(0)[i]);
  RenderConfig rules = lod_config({});
  rules.outputs = kRgb | kMedianDepth;
  BasicRenderer<float, OpenMPBackend> renderer(backend, rules);
  const auto frames = renderer.render(sets, std::span(&camera, 1)).value();
  CHECK(same_bits(obs["rgb"], frames.rgb));

  BatchConfig batched;
  static_cast<SimulatorConfig&>(batched) = config;
  batched.task.max_steps = 20;
  const auto shared = std::make_shared<const SimulatorScene>(scene);
  auto batch = make_batch_simulator(backend, {shared}, batched, 2, wandering).value();
  auto alone = BasicSimulator<OpenMPBackend>::create(backend, shared, batched).value();
  auto out = batch.reset().value();
  Rng rng(5);
  for (int step = 0; step < 5; ++step) {
    for (std::size_t e = 0; e < 2; ++e) {
      REQUIRE(alone.set_state(batch.world(e).state()).ok());
      const auto seen = alone.observe().value();
      for (std::size_t i = 0; i < config.sensors.size(); ++i)
        REQUIRE(same_bits(out.images[i].of(e), seen.images[i].data));
    }
    const std::vector<Action> actions{wandering_action(rng), wandering_action(rng)};
    out = batch.step(actions).value();
  }
}

TEST_CASE("visible sets that a scene does not have are refused, by name") {
  OpenMPBackend backend(1);
  SimulatorConfig config;
  config.sensors = rgbd_sensors(16, 16);
  config.visible_sets = true;
  const auto refused = [&](const SimulatorScene& scene) {
    return make_simulator(backend, scene, config).status();
  };
  CHECK(refused(flat_scene()).message().find("assets[0].visible is null") != std::string::npos);
  SimulatorScene other = flat_scene();
  VisibleSets foreign;
  foreign.cloud_chunks = 3;
  other.assets[0].visible = std::make_shared<const VisibleSets>(foreign);
  CHECK(refused(other).message().find("assets[0].visible is of another cloud") != std::string::npos);
  CHECK(refused(other).code() == Errc::invalid_argument);
}

TEST_CASE("levels of detail: cameras of one cell share a cut, other cameras and assets do not") {
  const SimulatorScene scene = detailed_scene();
  const LodTree& tree = *scene.assets[0].lod;
  const GaussianCloud& cloud = *scene.assets[0].cloud;
  LodCells cells;
  const auto at = [&](const Vec3d& eye, int side = 32, std::size_t asset = 0, double pixels = 2,
                      const Similarity& placed = {}) {
    LodChoice choice = coarse();
    choice.pixels = pixels;
    const Camera camera = Camera::look_at(eye, eye + Vec3d{1, 0, 0.5}, {0, 1, 0}, side, side, 90);
    return cells.at(asset, tree, cloud, camera, choice, placed, {}, {});
  };
  const auto first = at({1.1, 1.5, 1.1});
  CHECK(at({1.4, 1.6, 1.3}) == first);
  CHECK(at({1.6, 1.6, 1.3}) != first);
  CHECK(at({1.1, 1.5, 1.1}, 64) != first);
  CHECK(at({1.1, 1.5, 1.1}, 32, 1) != first);
  CHECK(at({1.1, 1.5, 1.1}, 32, 0, 1) != first);
  CHECK(at({1e12, 0, 0}) != nullptr);
  // Another placement: cells are those of the asset, half a metre in the world.
  const Similarity twice{{1, 0, 0, 0}, {0, 0, 0}, 2};
  const auto large = at({1.1, 1.5, 1.1}, 32, 2, 2, twice);
  CHECK(at({1.4, 1.6, 1.3}, 32, 2, 2, twice) == large);
  CHECK(at({1.6, 1.6, 1.3}, 32, 2, 2, twice) != large);
}
