// SPDX-License-Identifier: Apache-2.0
// Meshes in a simulator's scene, and the sensor of their normals.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "gsnav/backends/serial.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "mesh_box.hpp"
#include "ops/backends.hpp"
#include "sim_scene.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::vector<SensorSpec> sensors(int height = 40, int width = 56) {
  std::vector<SensorSpec> out = rgbd_sensors(height, width);
  out.push_back(out[0]);
  out[2].uuid = "normal";
  out[2].kind = SensorKind::normal;
  out.push_back(out[0]);
  out[3].uuid = "who";
  out[3].kind = SensorKind::semantic;
  return out;
}

SimulatorConfig config_of(std::vector<SensorSpec> sensors) {
  SimulatorConfig c;
  c.sensors = std::move(sensors);
  return c;
}

}  // namespace

TEST_CASE(
    "normals are those of the mesh where it is seen, in the sensor's axes, and nothing elsewhere") {
  SerialBackend backend;
  const double yaw = 0.6;
  SimulatorScene scene = flat_scene();
  scene.meshes.push_back(turned_box(yaw));
  auto sim = make_simulator(backend, scene, config_of(sensors())).value();
  auto empty = make_simulator(backend, flat_scene(), config_of(sensors())).value();
  PointNavEpisode e = to_kitchen();  // looks along -z
  e.start_rotation = yaw_rotation(0.1);
  const auto obs = sim.reset(e).value(), before = empty.reset(e).value();
  const Camera camera =
      sensor_camera(sim.config().sensors[0], sim.agent().position, sim.agent().rotation());
  const Vec3d eye = camera.position();
  const Mat3d to_world = transpose(camera.viewmat.linear);
  std::size_t box_pixels = 0, wrong = 0, labels = 0, ghosts = 0;
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 56; ++column) {
      const auto i = static_cast<std::size_t>(row * 56 + column);
      const Vec3d n{static_cast<double>(obs["normal"][3 * i]),
                    static_cast<double>(obs["normal"][3 * i + 1]),
                    static_cast<double>(obs["normal"][3 * i + 2])};
      const Vec3d d = to_world * Vec3d{(column + 0.5 - camera.cx) / camera.fx,
                                       (row + 0.5 - camera.cy) / camera.fy, 1.0};
      // The slab test in the box's own axes.
      const Quatd back = conjugate(yaw_rotation(yaw));
      const Vec3d o = rotate(back, eye - Vec3d{4.6, 0, 1.9}), v = rotate(back, d);
      const Vec3d low{-0.4, 0, -0.4}, high{0.4, 0.8, 0.4};
      double in = 0, out = 1e30;
      Vec3d face{};
      for (int k = 0; k < 3; ++k) {
        const double a = (low[k] - o[k]) / v[k], b = (high[k] - o[k]) / v[k];
        if (std::min(a, b) > in) {
          in = std::min(a, b);
          face = {};
          face[k] = v[k] > 0 ? -1.0 : 1.0;
        }
        out = std::min(out, std::max(a, b));
      }
      const double z = static_cast<double>(obs["depth"][i]);
      const bool here = in < out && std::abs(z - in) < 1e-4 * in;
      if (!here) {
        // Rays along an edge of the box may go either way.
        ghosts += norm(n) > 0 && !(std::abs(in - out) < 0.05) ? 1 : 0;
        continue;
      }
      ++box_pixels;
      const Vec3d world = rotate(yaw_rotation(yaw), face);
      const Vec3d c = camera.viewmat.linear * world;
      wrong += norm(n - Vec3d{c.x, -c.y, -c.z}) < 1e-5 ? 0 : 1;
      wrong += dot(to_world * Vec3d{n.x, -n.y, -n.z}, d) < 0 ? 0 : 1;  // on the camera's side
      labels += obs["who"][i] == 2.0f ? 1 : 0;                         // one asset, nobody, the mesh
    }
  }
  CHECK(box_pixels > 100);
  CHECK(wrong == 0);
  CHECK(ghosts == 0);
  CHECK(labels == box_pixels);
  for (const float v : before["normal"]) REQUIRE(v == 0.0f);
}

TEST_CASE("a mesh is seen before the Gaussians behind it and hidden by those before it") {
  SerialBackend backend;
  SimulatorScene scene = flat_scene();
  scene.meshes.push_back(turned_box(0.0));
  auto sim = make_simulator(backend, scene, config_of(sensors())).value();
  auto empty = make_simulator(backend, flat_scene(), config_of(sensors())).value();
  const auto with = sim.reset(to_kitchen()).value(), without = empty.reset(to_kitchen()).value();
  std::size_t nearer = 0;
  for (std::size_t i = 0; i < with["depth"].size(); ++i) {
    const bool mesh =
        with["normal"][3 * i] != 0 || with["normal"][3 * i + 1] != 0 || with["normal"][3 * i + 2] != 0;
    if (!mesh) {
      CHECK(with["who"][i] <= 1.0f);
      continue;
    }
    nearer += without["depth"][i] == 0.0f || with["depth"][i] < without["depth"][i] ? 1 : 0;
  }
  CHECK(nearer > 100);
  // From the other side of a wall nothing of it is seen.
  PointNavEpisode away = to_kitchen();
  away.start_rotation = yaw_rotation(3.14159265);
  const auto obs = sim.reset(away).value();
  for (const float v : obs["normal"]) REQUIRE(v == 0.0f);
}

TEST_CASE("normals alone, beyond the far plane, in a batch, and for a scene of meshes only") {
  SerialBackend backend;
  SimulatorScene scene = flat_scene();
  scene.meshes.push_back(turned_box(0.3));
  auto with_depth = make_simulator(backend, scene, config_of(sensors())).value();
  const auto reference = with_depth.reset(to_kitchen()).value();
  auto alone = make_simulator(backend, scene, config_of({sensors()[2]})).value();
  const auto obs = alone.reset(to_kitchen()).value();
  CHECK(std::equal(obs["normal"].begin(), obs["normal"].end(), reference["normal"].begin()));

  SensorSpec near_sighted = sensors()[2];
  near_sighted.far_plane = 0.5;
  auto blind = make_simulator(backend, scene, config_of({near_sighted})).value();
  const auto dark = blind.reset(to_kitchen()).value();
  for (const float v : dark["normal"]) REQUIRE(v == 0.0f);

  BatchConfig batch;
  batch.sensors = sensors();
  const auto everywhere = [](std::size_t, std::size_t) -> Result<BatchEpisode> {
    return BatchEpisode{0, to_kitchen()};
  };
  auto many = make_batch_simulator(backend, {std::make_shared<const SimulatorScene>(scene)}, batch, 3,
                                   everywhere)
                  .value();
  const auto out = many.reset().value();
  for (std::size_t s = 0; s < 4; ++s) {
    for (std::size_t e = 0; e < 3; ++e) {
      CHECK(std::equal(reference.images[s].data.begin(), reference.images[s].data.end(),
                       out.images[s].of(e).begin()));
    }
  }

  SimulatorScene meshes_only;
  meshes_only.navmesh = flat_navmesh();
  meshes_only.meshes = scene.meshes;
  auto plain = make_simulator(backend, meshes_only, config_of(sensors())).value();
  const auto seen = plain.reset(to_kitchen()).value();
  std::size_t green = 0;
  for (std::size_t i = 0; i < seen["depth"].size(); ++i) {
    green +=
        seen["rgb"][3 * i + 1] > seen["rgb"][3 * i] && seen["who"][i] == 1.0f && seen["depth"][i] > 0
            ? 1
            : 0;
  }
  CHECK(green > 100);
}

TEST_CASE("what is wrong with meshes and their sensors is named") {
  SimulatorScene scene = flat_scene();
  scene.meshes.push_back({});
  CHECK(validate(scene).message().find("meshes[0].surface") != std::string::npos);
  SensorSpec s = sensors()[2];
  s.model = SensorModel::fisheye;
  CHECK(validate(s).message().find("pinholes") != std::string::npos);
}

TEST_CASE("a backend with a memory of its own has the bits of the serial one, normals too") {
  SimulatorScene scene = flat_scene();
  scene.meshes.push_back(turned_box(0.3));
  SerialBackend serial;
  ToyBackend toy;
  auto expected = make_simulator(serial, scene, config_of(sensors())).value();
  auto sim = make_simulator(toy, scene, config_of(sensors())).value();
  const auto want = expected.reset(to_kitchen()).value(), got = sim.reset(to_kitchen()).value();
  for (std::size_t s = 0; s < 4; ++s) {
    CAPTURE(s);
    CHECK(
        std::equal(want.images[s].data.begin(), want.images[s].data.end(), got.images[s].data.begin()));
  }
}
