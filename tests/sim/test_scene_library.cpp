// SPDX-License-Identifier: Apache-2.0
// Scenes that are loaded when they are needed, and leave.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <future>
#include <thread>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "sim_scene.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Three scenes of one size that count how often they are loaded.
struct Counted {
  std::array<std::atomic<int>, 3> loads{};
  std::vector<SceneEntry> entries() {
    std::vector<SceneEntry> out;
    for (std::size_t i = 0; i < 3; ++i) {
      out.push_back({"scene" + std::to_string(i), [this, i]() -> Result<SimulatorScene> {
                       ++loads[i];
                       // A cloud of its own; the first has people.
                       SimulatorScene s = i == 0 ? peopled_scene(2000) : flat_scene();
                       s.assets[0].cloud = std::make_shared<const GaussianCloud>(*s.assets[0].cloud);
                       s.assets[0].world_from_asset.translation = {0, 0.001 * static_cast<double>(i), 0};
                       return s;
                     }});
    }
    return out;
  }
};

bool holds_within_a_second(const SceneLibrary& library, std::size_t index) {
  for (int i = 0; i < 100 && !library.holds(index); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return library.holds(index);
}

}  // namespace

TEST_CASE("what does not fit leaves, the least recently used first, but never what is in use") {
  Counted counted;
  const std::size_t one = scene_bytes(flat_scene());
  CHECK(one > 14 * sizeof(float) *
                  flat_scene().assets[0].cloud->size());  // mean, turn, sizes, opacity, colour
  const auto library = SceneLibrary::create(counted.entries(), 3 * one).value();  // two, and the people
  library->get(1).value();
  library->get(2).value();
  CHECK(library->bytes() == 2 * one);
  library->get(1).value();
  library->get(0).value();
  CHECK(library->loads() == 3);
  CHECK_FALSE(library->holds(2));
  CHECK(library->holds(1));
  CHECK(library->bytes() <= 3 * one);
  {
    const auto held = library->get(0).value();
    const auto also = library->get(1).value();
    library->get(2).value();  // nothing may leave but itself
    CHECK(library->holds(0));
    CHECK(library->holds(1));
    CHECK(library->bytes() > 3 * one - 1);
  }
  library->get(1).value();
  CHECK(library->bytes() <= 3 * one);
  CHECK(counted.loads[1] == 1);
}

TEST_CASE("scenes are loaded in the background") {
  std::promise<void> go;
  std::shared_future<void> gone = go.get_future().share();
  std::vector<SceneEntry> entries{{"slow", [gone]() -> Result<SimulatorScene> {
                                     gone.wait();
                                     return flat_scene();
                                   }}};
  const auto library = SceneLibrary::create(std::move(entries), std::size_t{1} << 40).value();
  library->prefetch(0);
  library->prefetch(0);
  CHECK_FALSE(library->holds(0));  // and nobody waited
  auto waiting = std::async(std::launch::async, [&] { return library->get(0); });
  go.set_value();
  CHECK(waiting.get().ok());
  CHECK(library->loads() == 1);
  CHECK(library->get(0).value() == library->get(0).value());
}

TEST_CASE("what fails is named, and tried again") {
  int tries = 0;
  std::vector<SceneEntry> entries{{"flat.ply", [&]() -> Result<SimulatorScene> {
                                     if (++tries == 1) return {Errc::file_not_found, "cannot be opened"};
                                     if (tries == 2) throw std::bad_alloc();
                                     if (tries == 3) return SimulatorScene{};
                                     return flat_scene();
                                   }}};
  const auto library = SceneLibrary::create(std::move(entries), 0).value();
  for (const Errc code : {Errc::file_not_found, Errc::out_of_memory, Errc::invalid_argument}) {
    const auto r = library->get(0);
    CHECK(r.code() == code);
    CHECK(r.message().starts_with("flat.ply: "));
  }
  CHECK(library->get(0).ok());
  CHECK(library->get(1).code() == Errc::invalid_argument);
  CHECK(SceneLibrary::create({}, 0).code() == Errc::invalid_argument);
  CHECK(SceneLibrary::create({{"nothing", {}}}, 0).message().find("nothing") != std::string::npos);
}

TEST_CASE("a batch over a library that has room for one scene has the bits of one that holds all") {
  Counted counted;
  const auto library = SceneLibrary::create(counted.entries(), scene_bytes(flat_scene())).value();
  std::vector<std::shared_ptr<const SimulatorScene>> all;
  Counted own;
  for (const SceneEntry& e : own.entries())
    all.push_back(std::make_shared<const SimulatorScene>(e.load().value()));
  BatchConfig config;
  config.sensors = rgbd_sensors(8, 12);
  config.task.max_steps = 5;
  config.auto_reset = AutoReset::same_step;
  const EpisodeSource source = [](std::size_t e, std::size_t count) -> Result<BatchEpisode> {
    BatchEpisode b;
    b.scene = (count + e / 2) % 3;
    b.episode = to_kitchen();
    b.episode.start_rotation = yaw_rotation(static_cast<double>(e + count));
    return b;
  };
  OpenMPBackend backend(2);
  auto a = make_batch_simulator(backend, all, config, 3, source).value();
  auto b = BasicBatchSimulator<OpenMPBackend>::create_from_library(backend, library, config, 3, source)
               .value();
  const auto same = [](const BatchStep& x, const BatchStep& y) {
    for (std::size_t i = 0; i < x.images.size(); ++i) {
      if (std::memcmp(x.images[i].data.data(), y.images[i].data.data(), x.images[i].data.size_bytes()) !=
          0)
        return false;
    }
    return std::equal(x.rewards.begin(), x.rewards.end(), y.rewards.begin()) &&
           std::equal(x.times.begin(), x.times.end(), y.times.begin());
  };
  CHECK(same(a.reset().value(), b.reset().value()));
  for (int i = 0; i < 40; ++i) {
    const std::vector<Action> actions(3, i % 2 == 0 ? Action::move_forward : Action::turn_left);
    REQUIRE(same(a.step(actions).value(), b.step(actions).value()));
    // Environments are in two scenes at once; a third may be on its way.
    CHECK(library->bytes() < 4 * scene_bytes(flat_scene()));
  }
  CHECK(a.pose_count() == b.pose_count());
  CHECK(counted.loads[1] > 1);  // it left, and came again
  CHECK(holds_within_a_second(*library, b.scene_of(0)));
}
