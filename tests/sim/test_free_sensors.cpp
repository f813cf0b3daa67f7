// SPDX-License-Identifier: Apache-2.0
// Sensors at poses of their own, against a simulator whose agent carries them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/sim/free_sensors.hpp"
#include "gsnav/sim/basic_simulator.hpp"
#include "sim_scene.hpp"
#include "support/compiled_frames.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

SensorSpec sensor(const char* uuid, SensorKind kind, SensorModel model, int height, int width) {
  SensorSpec s;
  s.uuid = uuid;
  s.kind = kind;
  s.model = model;
  s.resolution = {height, width};
  s.far_plane = 2.5;
  return s;
}

std::vector<SensorSpec> all_kinds() {
  const auto pinhole = SensorModel::pinhole, sphere = SensorModel::equirectangular,
             fish = SensorModel::fisheye;
  return {
      sensor("a", SensorKind::rgb, pinhole, 24, 32),  sensor("b", SensorKind::depth, pinhole, 24, 32),
      sensor("c", SensorKind::alpha, sphere, 16, 32), sensor("d", SensorKind::depth, sphere, 16, 32),
      sensor("e", SensorKind::rgb, fish, 20, 20),     sensor("f", SensorKind::depth, fish, 20, 20)};
}

/// Renders cameras one by one with a simulator.
template <class Sim>
FreeSensors::Render by(Sim& sim) {
  return [&sim](std::span<const Camera> cameras, Frames<float>& out) -> Status {
    out = {};
    for (const Camera& camera : cameras) {
      const auto one = sim.render(camera, kRgb | kAlpha | kMedianDepth);
      if (!one) return one.status();
      out.rgb.insert(out.rgb.end(), (*one)->rgb.begin(), (*one)->rgb.end());
      out.alpha.insert(out.alpha.end(), (*one)->alpha.begin(), (*one)->alpha.end());
      out.median_depth.insert(out.median_depth.end(), (*one)->median_depth.begin(),
                              (*one)->median_depth.end());
    }
    return {};
  };
}

}  // namespace

TEST_CASE("free sensors: at the poses of an agent's sensors they have the simulator's bits") {
  SerialBackend backend;
  SimulatorConfig config;
  config.sensors = all_kinds();
  auto sim = make_simulator(backend, flat_scene(), config).value();
  sim.reset(to_kitchen()).value();
  auto free = FreeSensors::create(all_kinds()).value();
  for (const double yaw : {0.0, 2.1}) {
    sim.set_agent({4.6, 0, 3.6}, yaw).throw_if_error();
    const Observations seen = sim.observe().value();
    const AgentPose& agent = sim.agent();
    const SensorPose pose{agent.position + rotate(agent.rotation(), Vec3d{0, 1.5, 0}), agent.rotation()};
    const std::vector<SensorPose> poses(config.sensors.size(), pose);
    free.render(poses, by(sim)).throw_if_error();
    for (std::size_t i = 0; i < config.sensors.size(); ++i) {
      const auto want = seen.images[i].data;
      const std::vector<float> got = free.image(i);
      REQUIRE(got.size() == want.size());
      CHECK(std::equal(got.begin(), got.end(), want.begin()));
    }
  }
  CHECK(free.render_count() == 6);  // Two sensors share each render.
}

TEST_CASE("free sensors: sensors with other poses do not share a render") {
  SerialBackend backend;
  SimulatorConfig config;
  config.rendering = false;
  auto sim = make_simulator(backend, flat_scene(), config).value();
  sim.reset(to_kitchen()).value();
  auto free = FreeSensors::create({sensor("a", SensorKind::rgb, SensorModel::pinhole, 8, 8),
                                   sensor("b", SensorKind::rgb, SensorModel::pinhole, 8, 8)})
                  .value();
  const SensorPose ahead{{4.6, 1.5, 3.6}, {1, 0, 0, 0}}, back{{4.6, 1.5, 3.6}, {0, 0, 1, 0}};
  free.render(std::vector{ahead, back}, by(sim)).throw_if_error();
  CHECK(free.render_count() == 2);
  CHECK(free.image(0) != free.image(1));
  free.render(std::vector{back, back}, by(sim)).throw_if_error();
  CHECK(free.render_count() == 3);
  CHECK(free.image(0) == free.image(1));
}

TEST_CASE("free sensors: many places are drawn in one call per camera, with the bits of single ones") {
  SerialBackend backend;
  SimulatorConfig config;
  config.rendering = false;
  auto sim = make_simulator(backend, flat_scene(), config).value();
  sim.reset(to_kitchen()).value();
  auto together = FreeSensors::create(all_kinds()).value();
  auto alone = FreeSensors::create(all_kinds()).value();
  const std::size_t n = together.sensors().size();
  std::vector<SensorPose> poses;
  for (const double yaw : {0.0, 0.7, 2.1}) {
    const Quatd turned{std::cos(yaw / 2), 0, std::sin(yaw / 2), 0};
    for (std::size_t i = 0; i < n; ++i) poses.push_back({{4.6 - yaw / 10, 1.5, 3.6}, turned});
  }
  std::size_t most = 0;
  const FreeSensors::Render render = by(sim);
  const auto counted = [&](std::span<const Camera> cameras, Frames<float>& out) {
    most = std::max(most, cameras.size());
    return render(cameras, out);
  };
  together.render(poses, counted, 3).throw_if_error();
  CHECK(together.render_count() == 3);
  CHECK(most >= 3 * 5);  // Cubes of five or six faces.
  for (std::size_t place = 0; place < 3; ++place) {
    alone.render(std::span(poses).subspan(place * n, n), render).throw_if_error();
    for (std::size_t i = 0; i < n; ++i) CHECK(together.image(i, place) == alone.image(i));
  }
  CHECK(together.image(0, 0) != together.image(0, 2));

  // Two sensors that agree at one place only have renders of their own.
  auto pair = FreeSensors::create({sensor("a", SensorKind::rgb, SensorModel::pinhole, 8, 8),
                                   sensor("b", SensorKind::rgb, SensorModel::pinhole, 8, 8)})
                  .value();
  const SensorPose ahead = poses.front(), aside = poses.back();
  pair.render(std::vector{ahead, ahead, ahead, aside}, render, 2).throw_if_error();
  CHECK(pair.render_count() == 2);
  CHECK(pair.image(0, 0) == pair.image(1, 0));
  CHECK(pair.image(0, 1) != pair.image(1, 1));
}

TEST_CASE("free sensors: errors name the sensor") {
  CHECK(FreeSensors::create({sensor("s", SensorKind::semantic, SensorModel::pinhole, 8, 8)}).code() ==
        Errc::unsupported);
  SensorSpec noisy = sensor("n", SensorKind::rgb, SensorModel::pinhole, 8, 8);
  noisy.noise.kind = NoiseKind::gaussian;
  CHECK(FreeSensors::create({noisy}).code() == Errc::unsupported);
  CHECK(FreeSensors::create({sensor("z", SensorKind::rgb, SensorModel::pinhole, 0, 8)}).code() ==
        Errc::invalid_argument);
  auto free = FreeSensors::create({sensor("a", SensorKind::rgb, SensorModel::pinhole, 8, 8)}).value();
  const auto never = [](std::span<const Camera>, Frames<float>&) -> Status {
    return {Errc::backend_failure, "rendered"};
  };
  CHECK(free.render({}, never).code() == Errc::invalid_argument);
  CHECK(free.render({}, never, 0).code() == Errc::invalid_argument);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const SensorPose& bad : {SensorPose{{nan, 0, 0}, {1, 0, 0, 0}}, SensorPose{{}, {2, 0, 0, 0}},
                                SensorPose{{}, {nan, 0, 0, 0}}}) {
    const Status s = free.render(std::span(&bad, 1), never);
    CHECK(s.code() == Errc::invalid_argument);
    CHECK(std::string(s.message()).find("\"a\"") != std::string::npos);
  }
  const SensorPose good{{}, {1, 0, 0, 0}};
  CHECK(free.render(std::span(&good, 1), never).code() == Errc::backend_failure);
  CHECK(free.render(std::span(&good, 1), never, 2).code() == Errc::invalid_argument);
}
