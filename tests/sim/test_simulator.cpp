// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "gsnav/backends/serial.hpp"
#include "gsnav/device/simulator.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "gsnav/sim/basic_simulator.hpp"
#include "sim_scene.hpp"
#include "support/compiled_frames.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

// Images lie in the simulator: calls that return them do not compile on a temporary.
template <class T>
concept ReturnsImages = requires(T&& t) {
  std::forward<T>(t).reset(PointNavEpisode{});
}
|| requires(T&& t) { std::forward<T>(t).step(Action::stop); }
|| requires(T&& t) { std::forward<T>(t).step(VelocityCommand{}); }
|| requires(T&& t) { std::forward<T>(t).observe(); }
|| requires(T&& t) { std::forward<T>(t).render(Camera{}); }
|| requires(T&& t) { std::forward<T>(t).goal_images(); };
template <class T>
concept ReturnsBatches = requires(T&& t) {
  std::forward<T>(t).reset();
}
|| requires(T&& t) { std::forward<T>(t).step(std::span<const Action>()); }
|| requires(T&& t) { std::forward<T>(t).step(std::span<const VelocityCommand>()); };
static_assert(ReturnsImages<Simulator&> && !ReturnsImages<Simulator>);
static_assert(ReturnsImages<BasicSimulator<SerialBackend>&> &&
              !ReturnsImages<BasicSimulator<SerialBackend>>);
static_assert(ReturnsBatches<BatchSimulator&> && !ReturnsBatches<BatchSimulator>);
static_assert(ReturnsBatches<BasicBatchSimulator<SerialBackend>&> &&
              !ReturnsBatches<BasicBatchSimulator<SerialBackend>>);

SimulatorConfig small_config() {
  SimulatorConfig c;
  c.sensors = rgbd_sensors(48, 64);
  return c;
}

}  // namespace

TEST_CASE("RGB and depth at one place share one render") {
  SerialBackend backend;
  auto sim = make_simulator(backend, flat_scene(), small_config()).value();
  auto obs = sim.reset(to_kitchen()).value();
  CHECK(sim.render_count() == 1);
  CHECK(obs.images.size() == 2);
  CHECK(obs["rgb"].size() == 48 * 64 * 3);
  CHECK(obs["depth"].size() == 48 * 64);
  CHECK(obs.find("depth")->data.data() == obs["depth"].data());
  CHECK(obs.find("rbg") == nullptr);
  CHECK_THROWS_WITH_AS(obs["rbg"], "no image of a sensor \"rbg\": the sensors are rgb, depth", Error);
  CHECK(obs.images[0].height == 48);
  CHECK(obs.images[0].width == 64);
  CHECK(obs.images[0].channels == 3);
  sim.step(Action::turn_left).value();
  CHECK(sim.render_count() == 2);

  SimulatorConfig three = small_config();
  three.sensors.push_back(three.sensors[0]);
  three.sensors[2].uuid = "low";
  three.sensors[2].position.y = 0.4;
  three.sensors[2].kind = SensorKind::alpha;
  auto other = make_simulator(backend, flat_scene(), three).value();
  obs = other.reset(to_kitchen()).value();
  CHECK(other.render_count() == 2);
  CHECK(obs["low"].size() == 48 * 64);
  // Closed walls all around: every pixel is covered.
  CHECK(*std::min_element(obs["low"].begin(), obs["low"].end()) > 0.9f);
}

TEST_CASE("a simulator has an RGB and a depth sensor unless told otherwise") {
  SerialBackend backend;
  auto sim = make_simulator(backend, flat_scene(), {}).value();
  const auto obs = sim.reset(to_kitchen()).value();
  CHECK(obs["rgb"].size() == 256 * 256 * 3);
  CHECK(obs["depth"].size() == 256 * 256);

  SimulatorConfig blind;
  blind.sensors.clear();
  auto dark = make_simulator(backend, flat_scene(), blind).value();
  const auto nothing = dark.reset(to_kitchen()).value();
  CHECK(nothing.images.empty());
  CHECK(nothing.find("rgb") == nullptr);
  CHECK_THROWS_WITH_AS(nothing["rgb"],
                       "no image of a sensor \"rgb\": nothing was rendered (SimulatorConfig.sensors is "
                       "empty, or rendering is off)",
                       Error);
  CHECK(dark.render_count() == 0);
}

TEST_CASE("images are used again: a steady episode keeps its buffers") {
  SerialBackend backend;
  auto sim = make_simulator(backend, flat_scene(), small_config()).value();
  const float* rgb = sim.reset(to_kitchen())->images[0].data.data();
  for (int i = 0; i < 3; ++i) CHECK(sim.step(Action::move_forward)->images[0].data.data() == rgb);
}

TEST_CASE("without rendering there are no images and everything else") {
  SerialBackend backend;
  SimulatorConfig c = small_config();
  c.rendering = false;
  auto sim = make_simulator(backend, flat_scene(), c).value();
  auto obs = sim.reset(to_kitchen()).value();
  CHECK(obs.images.empty());
  CHECK(sim.render_count() == 0);
  obs = sim.step(Action::move_forward).value();
  CHECK(obs.moved == doctest::Approx(0.25));
  CHECK(obs.time == 0.25);
  sim.set_rendering(true);
  CHECK(sim.observe()->images.size() == 2);
}

TEST_CASE("the camera looks where the agent goes") {
  SensorSpec spec;
  spec.resolution = {48, 64};
  const Vec3d base{1, 0, 2};
  for (const double yaw : {0.0, 0.7, -2.0}) {
    const Camera c = sensor_camera(spec, base, yaw_rotation(yaw));
    CHECK(norm(c.position() - (base + Vec3d{0, 1.5, 0})) < 1e-12);
    // A point ahead of the agent at eye level is on the axis; up in the world is up in the image.
    const Vec3d ahead = base + Vec3d{-std::sin(yaw), 1.5, -std::cos(yaw)} * 1.0;
    const Vec3d p = c.viewmat * ahead;
    CHECK(std::abs(p.x) < 1e-12);
    CHECK(std::abs(p.y) < 1e-12);
    CHECK(p.z == doctest::Approx(1.0));
    CHECK((c.viewmat * (ahead + Vec3d{0, 0.1, 0})).y == doctest::Approx(-0.1));
    const Vec3d left = ahead + Vec3d{-std::cos(yaw), 0, std::sin(yaw)} * 0.1;
    CHECK((c.viewmat * left).x == doctest::Approx(-0.1));
  }
  // Square pixels: at 90 degrees the focal length is half the width.
  CHECK(sensor_camera(spec, base, {}).fx == doctest::Approx(32.0));
  CHECK(sensor_camera(spec, base, {}).fy == doctest::Approx(32.0));
  spec.orientation = {-0.5, 0, 0};  // looks down
  CHECK((sensor_camera(spec, base, {}).viewmat * (base + Vec3d{0, 1.5, -1})).y < 0);
}

TEST_CASE("depth is planar z in metres, and nothing beyond the far plane") {
  SerialBackend backend;
  SimulatorConfig c = small_config();
  auto sim = make_simulator(backend, flat_scene(), c).value();
  PointNavEpisode e = to_kitchen();
  e.start_position = {4.2, 0, 3.6};
  e.start_rotation = yaw_rotation(3.14159265358979323846);  // towards +Z, the wall at z = 4.54
  auto obs = sim.reset(e).value();
  const double truth = 4.54 - sim.agent().position.z;
  for (const std::size_t row : {20u, 24u, 30u}) {
    CHECK(obs["depth"][row * 64 + 32] == doctest::Approx(truth).epsilon(0.03));
  }
  for (SensorSpec& s : c.sensors) s.far_plane = 0.5;
  auto near = make_simulator(backend, flat_scene(), c).value();
  obs = near.reset(e).value();
  CHECK(obs["depth"][24 * 64 + 32] == 0.0f);
}

TEST_CASE("impossible configurations name what is wrong") {
  SerialBackend backend;
  const auto message = [&](auto change) {
    SimulatorScene s = flat_scene();
    SimulatorConfig c = small_config();
    change(s, c);
    const auto sim = make_simulator(backend, std::move(s), std::move(c));
    CHECK(sim.code() == Errc::invalid_argument);
    return sim.message();
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  CHECK(has(message([](auto& s, auto&) { s.navmesh = nullptr; }), "navmesh"));
  CHECK(has(message([](auto& s, auto&) { s.assets[0].cloud = nullptr; }), "assets[0]"));
  CHECK(has(message([](auto&, auto& c) { c.sensors[1].uuid = "rgb"; }), "twice"));
  CHECK(has(message([](auto&, auto& c) { c.sensors[1].uuid = ""; }), "uuid"));
  CHECK(has(message([](auto&, auto& c) { c.sensors[0].resolution = {0, 64}; }), "resolution"));
  CHECK(has(message([](auto&, auto& c) { c.sensors[0].hfov = 180; }), "hfov"));
  CHECK(has(message([](auto&, auto& c) { c.sensors[0].near_plane = 0; }), "near_plane"));
  CHECK(has(message([](auto&, auto& c) { c.sensors[0].far_plane = 0.001; }), "far_plane"));
  CHECK(has(message([](auto&, auto& c) { c.sensors[0].near_sigma = -1; }), "near_sigma"));
  CHECK(has(message([](auto&, auto& c) { c.sensors[0].position.x = std::nan(""); }), "position"));
  CHECK(has(message([](auto&, auto& c) { c.task.forward_step = 0; }), "forward_step"));
  CHECK(has(message([](auto&, auto& c) { c.render.tuning.tile_size = 7; }), "tile_size"));
  CHECK(has(message([](auto&, auto& c) { c.render.outputs = kRgb; }), "render.outputs = 1"));
  CHECK(has(message([](auto&, auto& c) { c.render.sort_order = SortOrder::camera_distance; }),
            "render.sort_order"));
}

TEST_CASE("people are seen, and move while the agent acts") {
  SerialBackend backend;
  auto empty = make_simulator(backend, flat_scene(), small_config()).value();
  auto peopled = make_simulator(backend, peopled_scene(), small_config()).value();
  PointNavEpisode e = to_kitchen();
  e.start_position = {4.6, 0, 1.6};
  e.start_rotation = yaw_rotation(3.14159265358979323846);
  const auto differing = [](std::span<const float> a, std::span<const float> b) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < a.size(); ++i) n += std::abs(a[i] - b[i]) > 0.02f ? 1 : 0;
    return n;
  };
  const auto a = empty.reset(e).value(), b = peopled.reset(e).value();
  CHECK(differing(a["depth"], b["depth"]) > 50);
  CHECK(a.avatar_clearance == std::numeric_limits<double>::infinity());
  CHECK(b.avatar_clearance < 2.0);
  const std::vector<float> before(b["depth"].begin(), b["depth"].end());
  const auto later = peopled.step(Action::turn_left).value();
  CHECK(differing(later["depth"], before) > 50);
}

TEST_CASE("the same episode gives the same pictures, bit for bit") {
  SerialBackend backend;
  const auto run = [&](auto& sim) {
    std::vector<float> trace;
    Rng rng(3);
    auto obs = sim.reset(to_kitchen()).value();
    for (int i = 0; i < 12; ++i) {
      obs = sim.step(static_cast<Action>(1 + rng.below(3))).value();
      trace.insert(trace.end(), obs["rgb"].begin(), obs["rgb"].end());
      trace.insert(trace.end(), obs["depth"].begin(), obs["depth"].end());
      trace.push_back(static_cast<float>(sim.agent().position.x));
    }
    return trace;
  };
  auto a = make_simulator(backend, peopled_scene(), small_config()).value();
  auto b = make_simulator(backend, peopled_scene(), small_config()).value();
  const std::vector<float> first = run(a);
  CHECK(run(b) == first);
  CHECK(run(a) == first);
}

TEST_CASE("among walking people the agent never penetrates by its own doing") {
  SerialBackend backend;
  SimulatorConfig c = small_config();
  c.rendering = false;
  auto sim = make_simulator(backend, peopled_scene(), c).value();
  Rng rng(21);
  int contacts = 0;
  for (int episode = 0; episode < 6; ++episode) {
    PointNavEpisode e = to_kitchen();
    e.start_time = 3.7 * episode;
    double before = sim.reset(e)->avatar_clearance;
    for (int i = 0; i < 100; ++i) {
      const Observations obs =
          sim.step(rng.below(4) == 0 ? Action::turn_left : Action::move_forward).value();
      contacts += obs.avatar_contact ? 1 : 0;
      if (!obs.pushed_into && before >= 0) CHECK(obs.avatar_clearance >= -1e-5);
      const World& w = sim.world();
      before = clearance(w.agent_state(), w.bodies(w.time(), w.time()).value(), w.time()).distance;
    }
  }
  CHECK(contacts > 0);
}

TEST_CASE("bytes round and clamp") {
  const float in[6] = {-1.0f, 0.0f, 0.5f, 1.0f, 7.0f, std::nanf("")};
  std::uint8_t out[6];
  to_bytes(in, out);
  CHECK(out[0] == 0);
  CHECK(out[2] == 128);
  CHECK(out[3] == 255);
  CHECK(out[4] == 255);
  CHECK(out[5] == 0);
}

TEST_CASE("a simulator that was moved from answers with an error") {
  SerialBackend backend;
  SimulatorConfig config;
  config.sensors = rgbd_sensors(8, 8);
  auto sim = make_simulator(backend, flat_scene(), config).value();
  REQUIRE(sim.reset(to_kitchen()).ok());
  const WorldState here = sim.state();
  auto other = std::move(sim);
  CHECK(other.observe().ok());
  for (const Status& s :
       {sim.reset(to_kitchen()).status(), sim.step(Action::turn_left).status(), sim.observe().status(),
        sim.set_state(here), sim.render(Camera{}).status(), sim.goal_images().status()}) {
    CHECK(s.code() == Errc::invalid_argument);
    CHECK(s.message().find("moved from") != std::string::npos);
  }
}
