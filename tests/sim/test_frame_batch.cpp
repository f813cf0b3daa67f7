// SPDX-License-Identifier: Apache-2.0
// Simulators on a backend with a memory of its own and a renderer of batches, as a GPU's is: the bits of
// the serial one.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <list>

#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/core/host_array.hpp"
#include "gsnav/detail/frame/cut_depth.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "mesh_box.hpp"
#include "ops/backends.hpp"
#include "ops/batch_of_toys.hpp"
#include "sim_scene.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

int redrawn = 0;
std::ptrdiff_t host_arrays = 0, host_bytes = 0;

/// One whose scratch is too small every second time: images are whole only after finish(), which says
/// so.
class BatchOfRedrawingToys : public BatchOfToys {
 public:
  using BatchOfToys::BatchOfToys;
  struct Stats {
    int reruns = 0;
  };
  Status render(std::span<const GaussianSet> sets, std::span<const camera_type> cameras,
                const images_type& images) {
    sets_ = sets;
    cameras_ = cameras;
    images_ = images;
    stats_.reruns = ++calls_ % 2;
    if (stats_.reruns == 0) return BatchOfToys::render(sets, cameras, images);
    const auto pixels =
        static_cast<std::size_t>(cameras[0].camera.width * cameras[0].camera.height) * cameras.size();
    if (images.floats.rgb != nullptr) std::fill_n(images.floats.rgb, 3 * pixels, -7.0f);
    if (images.floats.median_depth != nullptr) std::fill_n(images.floats.median_depth, pixels, -7.0f);
    return {};
  }
  Status finish() {
    redrawn += stats_.reruns;
    return stats_.reruns == 0 ? Status() : BatchOfToys::render(sets_, cameras_, images_);
  }
  const Stats& stats() const noexcept { return stats_; }

 private:
  std::span<const GaussianSet> sets_;
  std::span<const camera_type> cameras_;
  images_type images_;
  Stats stats_;
  int calls_ = 0;
};

/// With host memory of its own, of which there are 20 kB.
class RedrawingBackend : public ToyBackend {
 public:
  using batch_renderer = BatchOfRedrawingToys;
  static void* allocate_host(std::size_t bytes) {
    if (host_bytes + static_cast<std::ptrdiff_t>(bytes) > 20000) return nullptr;
    host_bytes += static_cast<std::ptrdiff_t>(bytes);
    ++host_arrays;
    return std::malloc(bytes);
  }
  static void deallocate_host(void* p) {
    --host_arrays;
    std::free(p);
  }
};
static_assert(BatchBackend<RedrawingBackend> && HasHostMemory<RedrawingBackend> &&
              !HasHostMemory<ToyBackend>);

/// One whose images are complete only after finish(), as those of a GPU, unless they are drawn at once.
class BatchOfLateToys : public BatchOfToys {
 public:
  using BatchOfToys::BatchOfToys;
  Status render(std::span<const GaussianSet> sets, std::span<const camera_type> cameras,
                const images_type& images) {
    if (at_once) return BatchOfToys::render(sets, cameras, images);
    sets_ = sets;
    cameras_ = cameras;
    images_ = images;
    return {};
  }
  Status finish() {
    if (at_once) return {};
    return fails ? broken() : BatchOfToys::render(sets_, cameras_, images_);
  }
  static Status broken() { return {Errc::backend_failure, "the device fell off"}; }
  static inline bool fails = false, at_once = false;

 private:
  std::span<const GaussianSet> sets_;
  std::span<const camera_type> cameras_;
  images_type images_;
};
/// One type for both, because simulators take long to compile.
class LateBackend : public ToyBackend {
 public:
  using batch_renderer = BatchOfLateToys;
  explicit LateBackend(bool at_once = false) { BatchOfLateToys::at_once = at_once; }
};
static_assert(BatchBackend<LateBackend>);

std::vector<std::shared_ptr<const SimulatorScene>> two_scenes() {
  SimulatorScene far = flat_scene();  // another sort order: frames of a call of its own
  auto cloud = std::make_shared<GaussianCloud>(*far.assets[0].cloud);
  cloud->sort_order = SortOrder::camera_distance;
  far.assets[0].cloud = cloud;
  return {std::make_shared<const SimulatorScene>(peopled_scene(2000)),
          std::make_shared<const SimulatorScene>(far)};
}

Result<BatchEpisode> spread(std::size_t environment, std::size_t count) {
  Rng rng(100 * environment + count);
  BatchEpisode e;
  e.scene = environment % 4 == 3 ? 1 : 0;
  e.episode = generate_episode(*flat_navmesh(), rng).value();
  e.episode.start_time = 0.5 * static_cast<double>(environment / 2);
  return e;
}

/// What a call left, by sensor; images that stayed in the backend's memory are looked at there.
std::vector<std::vector<float>> images_of(std::span<const BatchObservation> images) {
  std::vector<std::vector<float>> out;
  for (const BatchObservation& o : images) {
    const std::size_t n = o.environments * static_cast<std::size_t>(o.height * o.width * o.channels);
    const float* const data = o.on_backend != nullptr ? o.on_backend : o.data.data();
    CHECK((o.on_backend == nullptr) == (o.data.size() == n));
    out.emplace_back(data, data + n);
  }
  return out;
}

}  // namespace

TEST_CASE("batches of a backend that draws many cameras at once have the bits of the serial backend") {
  for (const ImageMemory memory : {ImageMemory::host, ImageMemory::backend}) {
    for (const std::size_t slots : {std::size_t{2}, std::size_t{4}, std::size_t{64}}) {
      CAPTURE(slots);
      BatchConfig config;
      config.sensors = rgbd_sensors(12, 18);
      config.sensors[1].far_plane = 4.0;
      config.sensors.push_back(config.sensors[0]);
      config.sensors[2].uuid = "low";
      config.sensors[2].position = {0, 0.4, 0};
      config.task.max_steps = 5;
      config.auto_reset = AutoReset::same_step;
      config.pose_slots = slots;
      SerialBackend serial;
      LateBackend batching(true);
      auto expected = make_batch_simulator(serial, two_scenes(), config, 7, spread).value();
      config.images = memory;
      auto sim = make_batch_simulator(batching, two_scenes(), config, 7, spread).value();
      const auto same = [&](const BatchStep& a, const BatchStep& b) {
        CHECK(images_of(a.images) == images_of(b.images));
        CHECK(images_of(a.final_images) == images_of(b.final_images));
      };
      batch_calls = 0;
      most_sets = 0;
      same(sim.reset().value(), expected.reset().value());
      // Two scenes of two orders, each with two cameras: one call each, where all times are held posed
      // at once.
      if (slots >= 4) {
        CHECK(batch_calls == 4);
        CHECK(most_sets <= 1 + 3 * 2);  // the flat once, two people at three times
      }
      Rng rng(3);
      bool ended = false;
      for (int i = 0; i < 7; ++i) {
        std::vector<Action> actions(7, Action::turn_left);
        for (Action& a : actions) a = rng.below(2) == 0 ? Action::move_forward : a;
        const BatchStep got = sim.step(actions).value(), want = expected.step(actions).value();
        same(got, want);
        ended = ended || !got.finished.empty();
      }
      CHECK(ended);
      // Rows that lie apart.
      const std::vector<std::uint8_t> mask{1, 0, 1, 1, 0, 0, 1};
      same(sim.reset(mask).value(), expected.reset(mask).value());
      CHECK(batching.empty_copies == 0);
    }
  }
}

TEST_CASE(
    "images are those of the last drawing where a batch is drawn again, in whatever host memory there "
    "is") {
  BatchConfig config;
  config.sensors = rgbd_sensors(12, 18);
  config.sensors.push_back(config.sensors[0]);
  config.sensors[2].uuid = "around";
  config.sensors[2].model = SensorModel::equirectangular;
  SerialBackend serial;
  {
    RedrawingBackend redrawing;
    auto expected = make_batch_simulator(serial, two_scenes(), config, 7, spread).value();
    auto sim = make_batch_simulator(redrawing, two_scenes(), config, 7, spread).value();
    CHECK(images_of(sim.reset().value().images) == images_of(expected.reset().value().images));
    const std::vector<Action> actions(7, Action::turn_left);
    for (int i = 0; i < 3; ++i) {
      CHECK(images_of(sim.step(actions).value().images) ==
            images_of(expected.step(actions).value().images));
    }
    CHECK(redrawn > 3);
    CHECK(host_arrays > 0);
    CHECK(host_bytes <= 20000);
  }
  CHECK(host_arrays == 0);
}

TEST_CASE("the caller works once per call while a batch is drawn, with everything but its pixels") {
  for (const ImageMemory memory : {ImageMemory::host, ImageMemory::backend}) {
    BatchConfig config;
    config.sensors = rgbd_sensors(12, 18);
    config.task.max_steps = 3;
    config.auto_reset = AutoReset::same_step;
    config.pose_slots = 2;  // several rounds of drawing
    SerialBackend serial;
    LateBackend late;
    auto expected = make_batch_simulator(serial, two_scenes(), config, 7, spread).value();
    config.images = memory;
    auto sim = make_batch_simulator(late, two_scenes(), config, 7, spread).value();
    int told = 0, drawn_before = 0;
    BatchStep seen;
    const WhileDrawing meanwhile = [&](const BatchStep& step) -> Status {
      seen = step;
      ++told;
      drawn_before = batch_calls;
      return {};
    };
    const auto same = [&](const BatchStep& got, const BatchStep& want) {
      CHECK(std::ranges::equal(seen.rewards, want.rewards));
      CHECK(std::ranges::equal(seen.truncated, want.truncated));
      CHECK(std::ranges::equal(seen.finished, want.finished));
      REQUIRE(seen.images.size() == 2);
      CHECK(seen.images.data() == got.images.data());
      CHECK(images_of(seen.images) == images_of(want.images));
      CHECK(images_of(seen.final_images) == images_of(want.final_images));
    };
    batch_calls = 0;
    const BatchStep first = sim.reset({}, meanwhile).value();
    same(first, expected.reset().value());
    CHECK(told == 1);
    CHECK(drawn_before == 0);
    CHECK(batch_calls > 1);
    const std::vector<Action> actions(7, Action::turn_left);
    const std::vector<VelocityCommand> commands(7, VelocityCommand{0.1, 0.2});
    bool ended = false;
    for (int i = 0; i < 6; ++i) {
      batch_calls = 0;
      const BatchStep got =
          (i % 2 == 0 ? sim.step(actions, meanwhile) : sim.step(commands, meanwhile)).value();
      same(got, (i % 2 == 0 ? expected.step(actions) : expected.step(commands)).value());
      CHECK(told == i + 2);
      // The last images of an episode are drawn before its next one begins.
      CHECK((drawn_before > 0) == !got.finished.empty());
      CHECK(batch_calls > drawn_before);
      ended = ended || !got.finished.empty();
    }
    CHECK(ended);
    sim.set_rendering(false);  // There is nothing to draw, and it is called nevertheless.
    CHECK(sim.step(actions, meanwhile).value().images.empty());
    CHECK(told == 8);
  }
}

TEST_CASE("errors of the caller's work and of drawing reach the caller, and the batch goes on") {
  BatchConfig config;
  config.sensors = rgbd_sensors(12, 18);
  SerialBackend serial;
  LateBackend late;
  auto expected = make_batch_simulator(serial, two_scenes(), config, 5, spread).value();
  auto sim = make_batch_simulator(late, two_scenes(), config, 5, spread).value();
  auto unthreaded = make_batch_simulator(serial, two_scenes(), config, 5, spread).value();
  const std::vector<Action> actions(5, Action::turn_left), few(4, Action::turn_left);
  int told = 0;
  const WhileDrawing refuses = [&](const BatchStep&) -> Status {
    ++told;
    return {Errc::write_failed, "no room for rewards"};
  };
  const WhileDrawing throws = [&](const BatchStep&) -> Status {
    ++told;
    throw Error(Errc::unsupported, "thrown");
  };
  const auto go_on = [&](auto& batch) {
    CHECK(batch.step(few, refuses).code() == Errc::invalid_argument);  // before any environment moves
    CHECK(std::exchange(told, 0) == 0);
    CHECK(batch.step(actions, refuses).message() == "no room for rewards");
    CHECK(batch.step(actions, throws).message() == "thrown");
    CHECK(std::exchange(told, 0) == 2);
  };
  sim.reset().value();
  unthreaded.reset().value();
  expected.reset().value();
  go_on(sim);
  go_on(unthreaded);
  for (int i = 0; i < 2; ++i) expected.step(actions).value();
  const auto want = images_of(expected.step(actions).value().images);
  CHECK(images_of(sim.step(actions).value().images) == want);
  CHECK(images_of(unthreaded.step(actions).value().images) == want);
  BatchOfLateToys::fails = true;
  CHECK(sim.step(actions, refuses).message() == "the device fell off");
  CHECK(told == 1);
  BatchOfLateToys::fails = false;
  CHECK(sim.reset({}, refuses).code() == Errc::write_failed);
  CHECK(sim.step(actions).ok());
}

TEST_CASE("depths are cut at the far plane as doubles compare, whether or not a float is there") {
  Rng rng(31);
  const float inf = std::numeric_limits<float>::infinity();
  for (double far_plane : {0.1, 5.0, 1000.0, 1e-42, 1e300, static_cast<double>(inf)}) {
    for (int i = 0; i < 50; ++i, far_plane *= i < 40 && far_plane < 1e30 ? rng.uniform(0.5, 2) : 1) {
      const float near = static_cast<float>(std::min(far_plane, 3e38));
      std::vector<float> depths{
          0.0f, near, std::nextafter(near, 0.0f), std::nextafter(near, inf), 2 * near, 1e-45f, inf};
      const std::vector<float> before = depths;
      const CutDepth cut(depths.data(), far_plane);
      for (std::size_t k = 0; k < depths.size(); ++k) {
        cut(k);
        CHECK(depths[k] == (static_cast<double>(before[k]) > far_plane ? 0.0f : before[k]));
      }
    }
  }
}

TEST_CASE("a batch is drawn by as many cameras as a call has room for, what it does not support alone") {
  BatchConfig config;
  config.sensors = rgbd_sensors(8, 8);
  SerialBackend serial;
  LateBackend batching(true);
  auto expected = make_batch_simulator(serial, two_scenes(), config, 7, spread).value();
  auto sim = make_batch_simulator(batching, two_scenes(), config, 7, spread).value();
  most_cameras = 2;
  most_drawn = 0;
  CHECK(images_of(sim.reset().value().images) == images_of(expected.reset().value().images));
  CHECK(most_drawn == 2);
  most_cameras = 0;
  const int calls = batch_calls;
  CHECK(images_of(sim.reset().value().images) == images_of(expected.reset().value().images));
  CHECK(batch_calls == calls);
  most_cameras = ~std::size_t{0};
}

TEST_CASE("meshes, which its batches do not know, are drawn there with the same bits") {
  SimulatorScene furnished = flat_scene();
  furnished.meshes.push_back(turned_box(0.3));
  const std::vector<std::shared_ptr<const SimulatorScene>> scenes{
      std::make_shared<const SimulatorScene>(furnished),
      std::make_shared<const SimulatorScene>(flat_scene())};
  const auto facing = [](std::size_t environment, std::size_t) -> Result<BatchEpisode> {
    return BatchEpisode{environment % 2, to_kitchen()};
  };
  BatchConfig config;
  config.sensors = rgbd_sensors(12, 18);
  SerialBackend serial;
  auto expected = make_batch_simulator(serial, scenes, config, 3, facing).value();
  const auto want = images_of(expected.reset().value().images);
  for (const ImageMemory memory : {ImageMemory::host, ImageMemory::backend}) {
    LateBackend batching(true);
    config.images = memory;
    auto sim = make_batch_simulator(batching, scenes, config, 3, facing).value();
    CHECK(images_of(sim.reset().value().images) == want);
  }
  const std::size_t row = want[1].size() / 3;  // the second scene lacks the box
  CHECK(!std::equal(want[1].data(), want[1].data() + row, want[1].data() + row));
}

TEST_CASE("levels of detail are chosen for a backend with a memory of its own as for the serial one") {
  SimulatorScene detailed = peopled_scene(2000);
  SerialBackend serial;
  detailed.assets[0].lod =
      std::make_shared<const LodTree>(build_lod(serial, *detailed.assets[0].cloud).value());
  const std::vector<std::shared_ptr<const SimulatorScene>> scenes{
      std::make_shared<const SimulatorScene>(detailed)};
  BatchConfig config;
  config.sensors = rgbd_sensors(24, 36);
  config.lod = LodChoice{};
  config.lod->pixels = 2;
  config.lod->grain = 1e9;
  auto expected = make_batch_simulator(serial, scenes, config, 3, spread).value();
  const auto want = images_of(expected.reset().value().images);
  BatchConfig whole = config;
  whole.lod = {};
  auto without = make_batch_simulator(serial, scenes, whole, 3, spread).value();
  CHECK(images_of(without.reset().value().images) != want);
  for (const ImageMemory memory : {ImageMemory::host, ImageMemory::backend}) {
    LateBackend batching(true);
    config.images = memory;
    auto sim = make_batch_simulator(batching, scenes, config, 3, spread).value();
    CHECK(images_of(sim.reset().value().images) == want);
  }
  // A spectator's camera too.
  LateBackend batching(true);
  auto there = make_simulator(batching, detailed, config).value();
  auto here = make_simulator(serial, detailed, config).value();
  there.reset(to_kitchen()).value();
  here.reset(to_kitchen()).value();
  const Camera camera = sensor_camera(config.sensors[0], here.agent().position, here.agent().rotation());
  CHECK((*there.render(camera))->rgb == (*here.render(camera))->rgb);
}

TEST_CASE("one simulator there has the serial one's bits too, with sensors that need scratch") {
  SimulatorConfig config;
  config.sensors = rgbd_sensors(16, 24);
  config.sensors[0].noise.kind = NoiseKind::gaussian;
  SensorSpec around = config.sensors[0];
  around.noise = {};
  around.uuid = "around";
  around.model = SensorModel::equirectangular;
  SensorSpec who = config.sensors[1];
  who.uuid = "who";
  who.kind = SensorKind::semantic;
  config.sensors.push_back(around);
  config.sensors.push_back(who);
  SerialBackend serial;
  LateBackend batching(true);
  auto expected = make_simulator(serial, peopled_scene(2000), config).value();
  auto sim = make_simulator(batching, peopled_scene(2000), config).value();
  sim.reset(to_kitchen()).value();
  expected.reset(to_kitchen()).value();
  const auto got = sim.step(Action::turn_left).value(), want = expected.step(Action::turn_left).value();
  for (std::size_t i = 0; i < got.images.size(); ++i) {
    CAPTURE(i);
    CHECK(std::equal(got.images[i].data.begin(), got.images[i].data.end(), want.images[i].data.begin()));
  }
}

TEST_CASE("a batch draws its own bits into memory of the caller on a backend") {
  for (const std::size_t cameras : {~std::size_t{0}, std::size_t{0}}) {  // in batches, one by one
    most_cameras = cameras;
    BatchConfig config;
    config.sensors = rgbd_sensors(12, 18);
    config.task.max_steps = 3;
    config.auto_reset = AutoReset::same_step;
    SerialBackend serial;
    LateBackend batching(true);
    auto expected = make_batch_simulator(serial, two_scenes(), config, 4, spread).value();
    config.images = ImageMemory::backend;
    std::list<Buffer<float, LateBackend>> blocks;
    config.image_source = [&](std::size_t, std::size_t floats) -> Result<std::span<float>> {
      auto& block = blocks.emplace_back(batching);
      block.resize_discard(floats + 1);
      std::fill_n(block.data(), floats + 1, std::numeric_limits<float>::quiet_NaN());
      return std::span(block.data() + 1, floats);  // aligned as a float is, and no better
    };
    auto sim = make_batch_simulator(batching, two_scenes(), config, 4, spread).value();
    std::vector<std::vector<float>> all;
    std::size_t ended = 0;
    const auto same = [&](const BatchStep& got, const BatchStep& want) {
      const auto images = images_of(want.images);
      CHECK(images_of(got.images) == images);
      CHECK(images_of(got.final_images) == images_of(want.final_images));
      CHECK(got.images[0].data.empty());
      CHECK(got.images[0].on_backend == std::prev(blocks.end(), 2)->data() + 1);
      CHECK(got.images[1].on_backend == blocks.back().data() + 1);
      all.insert(all.end(), images.begin(), images.end());
      ended += got.finished.size();
    };
    same(sim.reset().value(), expected.reset().value());
    for (const Action action : {Action::move_forward, Action::turn_left, Action::turn_right}) {
      const std::vector<Action> actions(4, action);
      same(sim.step(actions).value(), expected.step(actions).value());
    }
    const std::vector<std::uint8_t> some{0, 1, 0, 0};
    same(sim.reset(some).value(), expected.reset(some).value());
    CHECK(ended > 0);
    REQUIRE(all.size() == blocks.size());
    std::size_t i = 0;  // Later calls have left the memory of earlier ones alone.
    for (const auto& block : blocks) {
      CHECK(std::equal(all[i].begin(), all[i].end(), block.data() + 1));
      ++i;
    }
  }
  most_cameras = ~std::size_t{0};
}

TEST_CASE("images that cannot stay in a backend's memory are named") {
  LateBackend batching(true);
  BatchConfig config;
  config.images = ImageMemory::backend;
  const auto message = [&](auto change) {
    config.sensors = rgbd_sensors(8, 8);
    change(config.sensors);
    const auto made = make_batch_simulator(batching, two_scenes(), config, 2, spread);
    CHECK(made.code() == Errc::unsupported);
    return made.message();
  };
  CHECK(message([](auto& s) { s[1].noise.kind = NoiseKind::redwood_depth; }).find("\"depth\"") !=
        std::string::npos);
  CHECK(message([](auto& s) { s[0].model = SensorModel::fisheye; }).find("\"rgb\"") !=
        std::string::npos);
  CHECK(message([](auto& s) { s[1].kind = SensorKind::semantic; }).find("ImageMemory::host") !=
        std::string::npos);
}
