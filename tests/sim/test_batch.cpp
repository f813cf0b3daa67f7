// SPDX-License-Identifier: Apache-2.0
// A batch of environments is its single simulators: the same bits.
#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <list>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "same_bits.hpp"
#include "sim_scene.hpp"
#include "support/random_cases.hpp"
#include "support/sanitized.hpp"
#include "wandering.hpp"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace gsnav {

/// The cache of bodies in a BatchWorld.
struct BatchWorldCache {
  BatchWorld& worlds;
  /// Number of intervals whose bodies are cached.
  std::size_t held() const noexcept { return worlds.bodies_.size(); }
  /// Sets the largest number of intervals that stay cached after a step.
  void keep(std::size_t most) const noexcept { worlds.most_bodies_ = most; }
};

}  // namespace gsnav

using namespace gsnav;
using namespace gsnav_test;

namespace {

BatchConfig small_batch(int height = 16, int width = 24) {
  BatchConfig c;
  c.sensors = rgbd_sensors(height, width);
  c.task.max_steps = 40;
  return c;
}

std::vector<std::shared_ptr<const SimulatorScene>> scene_pair() {
  return {std::make_shared<const SimulatorScene>(peopled_scene(2000)),
          std::make_shared<const SimulatorScene>(flat_scene())};
}

bool same_info(const StepInfo& a, const StepInfo& b) {
  return a.collided == b.collided && a.wall_collision == b.wall_collision &&
         a.capsule_blocked == b.capsule_blocked && a.avatar_contact == b.avatar_contact &&
         a.pushed_into == b.pushed_into && a.moved == b.moved &&
         a.avatar_clearance == b.avatar_clearance && a.reward == b.reward;
}

}  // namespace

TEST_CASE("a batch has the bits of single simulators over 1,000 random steps among people") {
  const auto scenes = scene_pair();
  constexpr std::size_t kEnvironments = 4;
  BatchConfig config = small_batch();
  config.sensors[0].noise.kind = NoiseKind::gaussian;
  config.seed = 7;
  config.pose_slots = 2;  // fewer than there are times
  OpenMPBackend backend(2), single_backend(1);
  auto batch = make_batch_simulator(backend, scenes, config, kEnvironments, wandering).value();

  // Each environment by hand: a simulator for each scene.
  std::vector<std::vector<BasicSimulator<OpenMPBackend>>> single(kEnvironments);
  std::vector<std::size_t> count(kEnvironments), scene(kEnvironments);
  for (std::size_t e = 0; e < kEnvironments; ++e) {
    SimulatorConfig own = config;
    own.seed = config.seed + e;
    for (const auto& s : scenes) {
      single[e].push_back(BasicSimulator<OpenMPBackend>::create(single_backend, s, own).value());
    }
  }
  const auto begin = [&](std::size_t e) {
    const BatchEpisode next = wandering(e, count[e]++).value();
    scene[e] = next.scene;
    return single[e][scene[e]].reset(next.episode).value();
  };
  std::size_t wrong = 0, ended = 0, contacts = 0;
  const auto compare = [&](std::size_t e, const Observations& obs, const BatchStep& out) {
    wrong += same_bits(obs["rgb"], out["rgb"].of(e)) ? 0 : 1;
    wrong += same_bits(obs["depth"], out.find("depth")->of(e)) ? 0 : 1;
    wrong += same_info(obs, out.infos[e]) ? 0 : 1;
    wrong += obs.time == out.times[e] && obs.point_goal.angle == out.point_goals[e].angle &&
                     obs.point_goal.distance == out.point_goals[e].distance
                 ? 0
                 : 1;
    contacts += obs.avatar_contact ? 1 : 0;
  };
  BatchStep out = batch.reset().value();
  for (std::size_t e = 0; e < kEnvironments; ++e) compare(e, begin(e), out);
  Rng rng(5);
  const int steps = cases(1000);
  for (int i = 0; i < steps; ++i) {
    std::vector<Action> actions;
    for (std::size_t e = 0; e < kEnvironments; ++e) {
      actions.push_back(rng.below(50) == 0 ? Action::stop : wandering_action(rng));
    }
    out = batch.step(actions).value();
    for (std::size_t e = 0; e < kEnvironments; ++e) {
      BasicSimulator<OpenMPBackend>& sim = single[e][scene[e]];
      compare(e, sim.done() ? begin(e) : sim.step(actions[e]).value(), out);
      const bool done = single[e][scene[e]].done();
      wrong += done == (out.terminated[e] != 0 || out.truncated[e] != 0) ? 0 : 1;
    }
    ended += out.finished.size();
    REQUIRE(wrong == 0);
  }
  CHECK(static_cast<double>(ended) > 0.06 * steps);
  CHECK(contacts > 0);
}

TEST_CASE("a batch that is steered by velocities has the bits of single simulators") {
  const auto scene = std::make_shared<const SimulatorScene>(peopled_scene(2000));
  constexpr std::size_t kEnvironments = 3;
  BatchConfig config = small_batch(8, 12);
  config.task.substeps = 2;
  config.auto_reset = AutoReset::disabled;
  OpenMPBackend backend(2), single_backend(1);
  const auto first = [](std::size_t e, std::size_t) -> Result<BatchEpisode> {
    BatchEpisode b = wandering(e, 0).value();
    b.scene = 0;
    return b;
  };
  auto batch = make_batch_simulator(backend, {scene}, config, kEnvironments, first).value();
  std::vector<BasicSimulator<OpenMPBackend>> single;
  batch.reset().value();
  for (std::size_t e = 0; e < kEnvironments; ++e) {
    single.push_back(BasicSimulator<OpenMPBackend>::create(single_backend, scene, config).value());
    single[e].reset(first(e, 0).value().episode).value();
  }
  Rng rng(12);
  std::size_t wrong = 0;
  double moved = 0.0;
  for (int i = 0; i < 20; ++i) {
    std::vector<VelocityCommand> commands(kEnvironments);
    for (VelocityCommand& c : commands)
      c = {rng.uniform(-0.5, 1.5), rng.uniform(-1, 1), i == 19, rng.uniform(-0.3, 0.3)};
    const BatchStep out = batch.step(commands).value();
    for (std::size_t e = 0; e < kEnvironments; ++e) {
      const Observations obs = single[e].step(commands[e]).value();
      wrong += same_bits(obs["rgb"], out.images[0].of(e)) && same_info(obs, out.infos[e]) ? 0 : 1;
      wrong += (out.terminated[e] != 0) == (i == 19) ? 0 : 1;
      moved += obs.moved;
    }
  }
  CHECK(wrong == 0);
  CHECK(moved > 1.0);
  CHECK(batch.reset().ok());
  std::vector<VelocityCommand> bad(kEnvironments);
  bad[1].linear = std::numeric_limits<double>::quiet_NaN();
  CHECK(batch.step(bad).message().find("environment 1: VelocityCommand") != std::string::npos);
}

namespace {

/// Runs three environments whose episodes are cut off after 2, 3 and 3 actions (the first one stops).
struct Modes {
  explicit Modes(AutoReset mode) : config(small_batch(8, 12)) {
    config.auto_reset = mode;
    config.task.max_steps = 3;
    sim.emplace(make_batch_simulator(backend, scene_pair(), config, 3, wandering).value());
    sim->reset().value();
  }
  Result<BatchStep> step(Action first = Action::turn_left) {
    return sim->step(std::vector<Action>{first, Action::turn_left, Action::turn_left});
  }
  OpenMPBackend backend{1};
  BatchConfig config;
  std::optional<BasicBatchSimulator<OpenMPBackend>> sim;
};

}  // namespace

TEST_CASE("next_step: the step after the end ignores its action and begins an episode") {
  Modes m(AutoReset::next_step);
  m.step().value();
  const BatchStep end = m.step(Action::stop).value();
  CHECK(end.terminated[0] == 1);
  CHECK(end.truncated[0] == 0);
  CHECK(end.terminated[1] == 0);
  REQUIRE(end.finished.size() == 1);
  CHECK(end.finished[0] == 0);
  CHECK(end.final_metrics[0].steps == 1);
  CHECK(end.final_metrics[0].stop_called);
  CHECK(m.sim->world(0).episode().id == "0/0");
  const BatchStep next = m.step(Action::move_forward).value();
  CHECK(m.sim->world(0).episode().id == "0/1");
  CHECK(next.rewards[0] == 0.0);
  CHECK(next.terminated[0] == 0);
  CHECK(next.infos[0].moved == 0.0);
  CHECK(next.times[0] == m.sim->world(0).episode().start_time);
  CHECK(next.truncated[1] == 1);
  CHECK(next.terminated[1] == 0);
  CHECK(next.finished.size() == 2);
  CHECK(next.final_images.empty());
}

TEST_CASE("same_step: an episode begins in the step that ended one, whose last images are kept") {
  Modes m(AutoReset::same_step);
  BatchStep last = m.step().value();
  const std::vector<float> before(last.images[0].of(0).begin(), last.images[0].of(0).end());
  const double goal_before = last.point_goals[0].distance;
  const BatchStep end = m.step(Action::stop).value();
  CHECK(end.terminated[0] == 1);
  CHECK(m.sim->world(0).episode().id == "0/1");
  REQUIRE(end.final_images.size() == 2);
  CHECK(end.final_images[0].environments == 1);
  CHECK(same_bits(end.final_images[0].of(0), before));  // stop takes no time
  CHECK_FALSE(same_bits(end.images[0].of(0), before));
  CHECK(end.point_goals[0].distance != goal_before);
  CHECK(end.final_metrics[0].euclidean_distance_to_goal >= goal_before);
  REQUIRE(end.final_point_goals.size() == 1);
  CHECK(end.final_point_goals[0].distance == goal_before);  // stop moves nothing
  const BatchStep next = m.step().value();
  CHECK(next.terminated[0] == 0);
  CHECK(next.finished.size() == 2);
  CHECK(next.final_images[1].environments == 2);
  CHECK(m.step().value().final_images.empty());
}

TEST_CASE("disabled: an environment that is done waits for its reset") {
  Modes m(AutoReset::disabled);
  m.step().value();
  const BatchStep end = m.step(Action::stop).value();
  CHECK(end.terminated[0] == 1);
  const auto refused = m.step();
  CHECK(refused.code() == Errc::invalid_argument);
  CHECK(refused.message().find("environment 0 is done") != std::string::npos);
  const std::vector<float> other(end.images[0].of(1).begin(), end.images[0].of(1).end());
  const BatchStep begun = m.sim->reset(std::vector<std::uint8_t>{1, 0, 0}).value();
  CHECK(m.sim->world(0).episode().id == "0/1");
  CHECK(m.sim->world(1).episode().id == "1/0");
  CHECK(same_bits(begun.images[0].of(1), other));
  CHECK(begun.terminated[0] == 0);
  CHECK(m.step().ok());
}

TEST_CASE("people are skinned once for each time that is looked at, and once for all in a batch") {
  OpenMPBackend backend(2);
  const auto together = [](std::size_t e, std::size_t) -> Result<BatchEpisode> {
    BatchEpisode b;
    b.episode = to_kitchen();
    b.episode.start_rotation = yaw_rotation(0.7 * static_cast<double>(e));
    return b;
  };
  const auto apart = [&](std::size_t e, std::size_t count) -> Result<BatchEpisode> {
    BatchEpisode b = together(e, count).value();
    b.episode.start_time = 0.25 * static_cast<double>(e / 2);
    return b;
  };
  const auto poses = [&](const EpisodeSource& source) {
    auto sim =
        make_batch_simulator(backend, {std::make_shared<const SimulatorScene>(peopled_scene(2000))},
                             small_batch(), 10, source)
            .value();
    sim.reset().value();
    CHECK(sim.render_count() == 10);  // colour and depth share theirs
    return sim.pose_count();
  };
  CHECK(poses(together) == 2);  // two people, one time
  CHECK(poses(apart) == 10);    // five times
}

TEST_CASE("bodies of a moment are made once, also for who comes by there later, and so many are kept") {
  const auto scene = std::make_shared<const SimulatorScene>(peopled_scene(2000));
  const auto apart = [](std::size_t e, std::size_t) -> Result<BatchEpisode> {
    BatchEpisode b;
    b.episode = to_kitchen();
    b.episode.start_time = static_cast<double>(e);  // four actions
    return b;
  };
  const BatchWorld::ParallelFor in_turn = [](std::size_t n, const std::function<void(std::size_t)>& f) {
    for (std::size_t i = 0; i < n; ++i) f(i);
  };
  const auto clearances = [&](std::size_t kept, std::size_t& made, bool ahead = false) {
    std::vector<double> seen;
    const auto bodies = [&](double t0, double t1, std::vector<DynamicCapsule>& out) {
      made += t1 > t0 ? 1 : 0;
      append_bodies(*scene, t0, t1, out);
    };
    auto worlds =
        BatchWorld::create({{scene->navmesh, bodies}}, {}, AutoReset::disabled, 2, apart).value();
    const BatchWorldCache cache{worlds};
    cache.keep(kept);
    REQUIRE(worlds.reset(in_turn).ok());
    for (int i = 0; i < 8; ++i) {
      if (ahead) worlds.prepare_step(in_turn);
      const std::size_t before = made;
      REQUIRE(worlds.step(in_turn, std::vector<Action>(2, Action::turn_left)).ok());
      if (ahead) CHECK(made == before);
      for (const StepInfo& info : worlds.info().infos) seen.push_back(info.avatar_clearance);
      CHECK(cache.held() <= kept + 2);
    }
    return seen;
  };
  std::size_t many = 0, few = 0, early = 0, none_kept = 0;
  CHECK(clearances(100, many) == clearances(2, few));
  CHECK(many == 12);  // 0 to 3 s, four intervals a second
  CHECK(few == 16);
  // Those of the next step stay even if fewer are kept.
  CHECK(clearances(100, early, true) == clearances(0, none_kept, true));
  CHECK(clearances(2, few) == clearances(100, early, true));
  CHECK(none_kept == 16);
}

namespace {

/// A function that gives new memory for each image of each call, and keeps all of it.
struct Memory {
  ImageSource source() {
    return [this](std::size_t sensor, std::size_t floats) -> Result<std::span<float>> {
      sensors.push_back(sensor);
      return std::span(blocks.emplace_back(floats, std::numeric_limits<float>::quiet_NaN()));
    };
  }
  void scribble() {
    for (auto& block : blocks) std::fill(block.begin(), block.end(), -7.0f);
  }
  std::list<std::vector<float>> blocks;
  std::vector<std::size_t> sensors;
};

}  // namespace

TEST_CASE("a batch draws its own bits into memory of the caller, in each mode of reset") {
  for (const AutoReset mode : {AutoReset::next_step, AutoReset::same_step, AutoReset::disabled}) {
    BatchConfig config = small_batch(8, 12);
    config.sensors[1].noise.kind = NoiseKind::redwood_depth;
    config.sensors.push_back(config.sensors[0]);  // shares the memory of the first one
    config.sensors.back().uuid = "again";
    config.task.max_steps = 3;
    config.auto_reset = mode;
    OpenMPBackend backend(2);
    auto own = make_batch_simulator(backend, scene_pair(), config, 3, wandering).value();
    Memory memory;
    config.image_source = memory.source();
    auto given = make_batch_simulator(backend, scene_pair(), config, 3, wandering).value();
    std::size_t wrong = 0, ended = 0;
    const auto compare = [&](const Result<BatchStep>& a, const Result<BatchStep>& b) {
      const BatchStep x = a.value(), y = b.value();
      REQUIRE(x.images.size() == 3);
      for (std::size_t i = 0; i < 3; ++i) wrong += same_bits(x.images[i].data, y.images[i].data) ? 0 : 1;
      REQUIRE(x.final_images.size() == y.final_images.size());
      for (std::size_t i = 0; i < x.final_images.size(); ++i)
        wrong += same_bits(x.final_images[i].data, y.final_images[i].data) ? 0 : 1;
      CHECK(y.images[0].data.data() == std::prev(memory.blocks.end(), 2)->data());
      CHECK(y.images[1].data.data() == memory.blocks.back().data());
      CHECK(y.images[2].data.data() == y.images[0].data.data());
      ended += x.finished.size();
      memory.scribble();  // The batch may not need what it has drawn.
    };
    compare(own.reset(), given.reset());
    Rng rng(8);
    for (int i = 0; i < 8; ++i) {
      std::vector<Action> actions;
      for (int e = 0; e < 3; ++e) actions.push_back(wandering_action(rng));
      compare(own.step(actions), given.step(actions));
      const std::vector<std::uint8_t> some{0, 1, 0}, all{1, 1, 1};
      if (mode == AutoReset::disabled && i % 3 == 2) compare(own.reset(all), given.reset(all));
      if (i == 4) compare(own.reset(some), given.reset(some));
    }
    CHECK(wrong == 0);
    CHECK(ended >= 3);
    CHECK(memory.sensors[0] == 0);
    CHECK(memory.sensors[1] == 1);
    CHECK(memory.sensors.size() == memory.blocks.size());
  }
}

TEST_CASE("memory of the caller: what is wrong with it is named before any environment moves") {
  BatchConfig config = small_batch(8, 12);
  OpenMPBackend backend(1);
  std::vector<float> block(2 * 8 * 12 * 3);
  Result<std::span<float>> next = std::span<float>(block);
  std::size_t calls = 0;
  config.image_source = [&](std::size_t, std::size_t) { return ++calls, next; };
  auto sim = make_batch_simulator(backend, scene_pair(), config, 2, wandering).value();
  sim.reset().value();
  CHECK(calls == 2);
  const std::vector<Action> turn(2, Action::turn_left);
  const double yaw = sim.world(0).agent().yaw;
  next = std::span<float>(block).first(575);
  CHECK(sim.step(turn).message().find("575 floats for the sensor \"rgb\", which needs 576") !=
        std::string::npos);
  std::vector<char> bytes((block.size() + 1) * sizeof(float));
  next = std::span(reinterpret_cast<float*>(bytes.data() + 1), block.size());
  CHECK(sim.step(turn).message().find("sensor \"rgb\" is not aligned to 4 bytes") != std::string::npos);
  next = Status(Errc::out_of_memory, "none left");
  CHECK(sim.step(turn).code() == Errc::out_of_memory);
  CHECK(sim.reset().message().find("none left") != std::string::npos);
  CHECK(sim.world(0).agent().yaw == yaw);
  sim.set_rendering(false);  // needs no memory
  CHECK(sim.step(turn).value().images.empty());
  sim.set_rendering(true);
  next = std::span<float>(block);
  CHECK(sim.step(turn).ok());
}

TEST_CASE("what is wrong with a batch is named") {
  OpenMPBackend backend(1);
  const auto message = [&](const auto& made) {
    CHECK(made.code() == Errc::invalid_argument);
    return made.message();
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  CHECK(has(message(make_batch_simulator(backend, {}, small_batch(), 2, wandering)), "no scene"));
  CHECK(has(message(make_batch_simulator(backend, {nullptr}, small_batch(), 2, wandering)), "null"));
  CHECK(has(message(make_batch_simulator(backend, scene_pair(), small_batch(), 0, wandering)),
            "environments = 0"));
  CHECK(has(message(make_batch_simulator(backend, scene_pair(), small_batch(), 2, {})), "source"));
  BatchConfig config = small_batch();
  config.pose_slots = 0;
  CHECK(has(message(make_batch_simulator(backend, scene_pair(), config, 2, wandering)), "pose_slots"));

  auto sim = make_batch_simulator(backend, scene_pair(), small_batch(), 2, wandering).value();
  CHECK(has(message(sim.step(std::vector<Action>(2, Action::turn_left))), "before reset"));
  sim.reset().value();
  CHECK(has(message(sim.step(std::vector<Action>(3, Action::turn_left))), "3 actions for 2"));
  const std::vector<Action> unknown{Action::turn_left, static_cast<Action>(9)};
  CHECK(has(message(sim.step(unknown)), "environment 1: action 9"));
  CHECK(has(message(sim.step(unknown)), "before reset"));
  CHECK(sim.reset().ok());

  const auto elsewhere = [](std::size_t, std::size_t) -> Result<BatchEpisode> {
    return BatchEpisode{5, to_kitchen()};
  };
  auto lost = make_batch_simulator(backend, scene_pair(), small_batch(), 1, elsewhere).value();
  CHECK(has(message(lost.reset()), "scene 5 of 2"));
}

#if defined(__GLIBC__) && !defined(GSNAV_TEST_SANITIZED)
TEST_CASE("memory grows with scenes, not with environments") {
  const auto in_use = [] {
    const struct mallinfo2 m = mallinfo2();
    return m.uordblks + m.hblkhd;
  };
  OpenMPBackend backend(1);
  BatchConfig config = small_batch();
  const auto scene = std::make_shared<const SimulatorScene>(peopled_scene(20000));
  const auto at_one_time = [](std::size_t, std::size_t) -> Result<BatchEpisode> {
    return BatchEpisode{0, to_kitchen()};
  };
  const auto bytes = [&](std::size_t environments) {
    const std::size_t before = in_use();
    auto sim = make_batch_simulator(backend, {scene}, config, environments, at_one_time).value();
    sim.reset().value();
    sim.step(std::vector<Action>(environments, Action::turn_left)).value();
    return in_use() - before;
  };
  bytes(2);
  const std::size_t few = bytes(8), many = bytes(136);
  const std::size_t images = 16 * 24 * 4 * sizeof(float);
  // What 128 more take beyond their images: less than 8 KiB each, where a scene of one's own takes
  // megabytes.
  CHECK(many - few < 128 * (images + 8192));
  CHECK(few > 1000000);
}
#endif

TEST_CASE("rendering switched on again: a reset of some environments has the images of all") {
  OpenMPBackend backend(2);
  const auto make = [&](bool rendering) {
    BatchConfig c = small_batch();
    c.rendering = rendering;
    return make_batch_simulator(backend, scene_pair(), c, 3, wandering).value();
  };
  auto batch = make(true), always = make(true), never = make(false);
  for (auto* b : {&batch, &always, &never}) b->reset().value();
  batch.set_rendering(false);
  Rng rng(4);
  for (int k = 0; k < 4; ++k) {
    std::vector<Action> actions;
    for (int e = 0; e < 3; ++e) actions.push_back(wandering_action(rng));
    for (auto* b : {&batch, &always, &never}) b->step(actions).value();
  }
  batch.set_rendering(true);
  never.set_rendering(true);
  const std::uint8_t mask[3] = {1, 0, 0};
  const auto want = always.reset(mask).value();
  for (auto* b : {&batch, &never}) {
    const auto got = b->reset(mask).value();
    for (std::size_t e = 0; e < 3; ++e) CHECK(same_bits(got.images[0].of(e), want.images[0].of(e)));
  }
}
