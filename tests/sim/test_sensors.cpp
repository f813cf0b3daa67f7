// SPDX-License-Identifier: Apache-2.0
// Sensors that are not pinholes, goal images and semantic sensors.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gsnav/backends/serial.hpp"
#include "gsnav/sim/basic_simulator.hpp"
#include "sim_scene.hpp"
#include "support/compiled_frames.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

SensorSpec sensor(SensorModel model, int height, int width, double hfov = 90.0) {
  SensorSpec s;
  s.uuid = "around";
  s.model = model;
  s.resolution = {height, width};
  s.hfov = hfov;
  return s;
}

/// The double sphere as its paper projects (Usenko, Demmel and Cremers 2018, eq. 40), for half the width
/// as focal length.
std::array<double, 2> projected(const SensorSpec& s, const Vec3d& p) {
  const double d1 = norm(p);
  const double shifted = s.fisheye.xi * d1 + p.z;
  const double d2 = std::sqrt(p.x * p.x + p.y * p.y + shifted * shifted);
  const double scale = s.fisheye.alpha * d2 + (1 - s.fisheye.alpha) * shifted;
  return {s.fisheye.focal_length[0] * p.x / scale + 0.5 * s.resolution[1] +
              s.fisheye.principal_point_offset[0],
          s.fisheye.focal_length[1] * p.y / scale + 0.5 * s.resolution[0] +
              s.fisheye.principal_point_offset[1]};
}

/// Distance from inside a box to its walls.
double to_wall(const Vec3d& low, const Vec3d& high, const Vec3d& d) {
  double t = 1e30;
  for (int k = 0; k < 3; ++k) {
    if (d[k] > 0) t = std::min(t, high[k] / d[k]);
    if (d[k] < 0) t = std::min(t, low[k] / d[k]);
  }
  return t;
}

/// Direction of a face's pixel in the sensor's frame.
Vec3d face_ray(const Camera& c, int row, int column) {
  const Vec3d p{(column + 0.5 - c.cx) / c.fx, (row + 0.5 - c.cy) / c.fy, 1.0};
  return transpose(c.viewmat.linear) * p;
}

/// Faces of a cube filled by value(direction with planar z of 1).
template <class F>
std::array<std::vector<float>, CubeMap::kFaces> filled(const CubeMap& cube, const F& value) {
  std::array<std::vector<float>, CubeMap::kFaces> out;
  for (std::size_t f = 0; f < CubeMap::kFaces; ++f) {
    const Camera c = cube.face_camera(Camera{}, f);
    for (int row = 0; row < cube.side(); ++row) {
      for (int column = 0; column < cube.side(); ++column)
        out[f].push_back(static_cast<float>(value(face_ray(c, row, column))));
    }
  }
  return out;
}

std::array<const float*, CubeMap::kFaces> pointers(
    const std::array<std::vector<float>, CubeMap::kFaces>& faces) {
  std::array<const float*, CubeMap::kFaces> out{};
  for (std::size_t f = 0; f < CubeMap::kFaces; ++f) out[f] = faces[f].data();
  return out;
}

}  // namespace

TEST_CASE("an equirectangular image has ahead in its middle, left on the left and up above") {
  const SensorSpec s = sensor(SensorModel::equirectangular, 100, 200);
  const auto near = [](const Vec3d& a, const Vec3d& b) { return norm(a - b) < 1e-12; };
  CHECK(near(*sensor_ray(s, 100, 50), {0, 0, 1}));
  CHECK(near(*sensor_ray(s, 50, 50), {-1, 0, 0}));
  CHECK(near(*sensor_ray(s, 150, 50), {1, 0, 0}));
  CHECK(near(*sensor_ray(s, 0, 50), {0, 0, -1}));
  CHECK(near(*sensor_ray(s, 37, 0), {0, -1, 0}));
  CHECK(near(*sensor_ray(s, 100, 75), {0, std::sqrt(0.5), std::sqrt(0.5)}));
}

TEST_CASE("a fisheye's rays are the inverse of its projection") {
  SensorSpec s = sensor(SensorModel::fisheye, 120, 160);
  Rng rng(3);
  for (const auto& [alpha, xi] : {std::pair{0.59, -0.18}, {0.3, 0.2}, {0.0, 0.0}, {0.7, 0.4}}) {
    s.fisheye = {alpha, xi, {60, 70}, {3, -5}};
    for (int i = 0; i < 500; ++i) {
      const double u = rng.uniform(0, 160), v = rng.uniform(0, 120);
      const auto ray = sensor_ray(s, u, v);
      if (!ray) continue;
      CHECK(norm(*ray) == doctest::Approx(1.0).epsilon(1e-12));
      const auto back = projected(s, *ray);
      CHECK(back[0] == doctest::Approx(u).epsilon(1e-9));
      CHECK(back[1] == doctest::Approx(v).epsilon(1e-9));
    }
  }
  // With alpha above a half the image is a disc.
  s.fisheye = {0.8, 0.0, {40, 40}, {0, 0}};
  CHECK_FALSE(sensor_ray(s, 80 + 40 / std::sqrt(0.6) + 0.01, 60).has_value());
  CHECK(sensor_ray(s, 80 + 40 / std::sqrt(0.6) - 0.01, 60).has_value());
}

TEST_CASE("a fisheye without a focal length spans its field of view") {
  for (const double hfov : {90.0, 170.0, 200.0}) {
    const SensorSpec s = sensor(SensorModel::fisheye, 100, 100, hfov);
    for (const double u : {0.0, 100.0}) {
      const Vec3d d = *sensor_ray(s, u, 50);
      CHECK(std::atan2(std::abs(d.x), d.z) == doctest::Approx(0.5 * hfov * std::numbers::pi / 180));
      CHECK(std::abs(d.y) < 1e-12);
    }
  }
}

TEST_CASE("what is sampled from a cube is what its directions show") {
  // Colour: a smooth function of direction. Depth: the walls of a box, exact on planes.
  const auto colour = [](Vec3d d) {
    d = normalized(d);
    return 0.5 + 0.3 * d.x * d.y + 0.2 * d.z;
  };
  const Vec3d low{-2.0, -1.2, -3.0}, high{1.5, 1.5, 2.5};
  const auto planar = [&](const Vec3d& d) { return to_wall(low, high, d); };  // planar z is 1 along d
  for (const SensorSpec& s :
       {sensor(SensorModel::equirectangular, 64, 128), sensor(SensorModel::fisheye, 96, 96, 190)}) {
    const CubeMap cube(s);
    const auto colours = filled(cube, colour), depths = filled(cube, planar);
    const auto size = static_cast<std::size_t>(s.resolution[0] * s.resolution[1]);
    std::vector<float> c(size), z(size);
    cube.sample_color(pointers(colours), 1, c);
    cube.sample_depth(pointers(depths), z);
    double worst = 0.0;
    std::size_t exact = 0, seen = 0;
    for (int row = 0; row < s.resolution[0]; ++row) {
      for (int column = 0; column < s.resolution[1]; ++column) {
        const auto i = static_cast<std::size_t>(row * s.resolution[1] + column);
        const auto ray = sensor_ray(s, column + 0.5, row + 0.5);
        if (!ray) {
          CHECK(c[i] == 0.0f);
          CHECK(z[i] == 0.0f);
          continue;
        }
        ++seen;
        worst = std::max(worst, std::abs(static_cast<double>(c[i]) - colour(*ray)));
        const double truth = to_wall(low, high, *ray);
        exact += std::abs(static_cast<double>(z[i]) - truth) < 1e-5 * truth ? 1 : 0;
        CHECK(std::abs(static_cast<double>(z[i]) - truth) < 0.05 * truth);
      }
    }
    CHECK(worst < 1e-3);
    // Exact but for the box's edges and for walls seen at so flat an angle that neighbours differ by
    // over 2 %.
    CHECK(static_cast<double>(exact) > 0.75 * static_cast<double>(seen));
  }
}

TEST_CASE("an equirectangular render is, pixel for pixel, what pinholes that look there see") {
  SerialBackend backend;
  SimulatorConfig config;
  config.sensors = {sensor(SensorModel::equirectangular, 48, 96),
                    sensor(SensorModel::equirectangular, 48, 96)};
  config.sensors[1].uuid = "distance";
  config.sensors[1].kind = SensorKind::depth;
  auto sim = make_simulator(backend, flat_scene(), config).value();
  PointNavEpisode e = to_kitchen();
  e.start_position = {3.4, 0, 3.0};
  e.start_rotation = yaw_rotation(0.3);
  const auto obs = sim.reset(e).value();
  CHECK(sim.render_count() == 1);
  const DefaultScene flat = make_default_scene(0.05).value();
  const Camera middle = sensor_camera(config.sensors[0], sim.agent().position, sim.agent().rotation());
  const Vec3d eye = middle.position();

  double squares = 0.0;
  std::vector<double> depth_errors, mesh_errors;
  std::size_t n = 0;
  for (int row = 2; row < 48; row += 5) {
    for (int column = 1; column < 96; column += 5) {
      const Vec3d d =
          transpose(middle.viewmat.linear) * *sensor_ray(config.sensors[0], column + 0.5, row + 0.5);
      // A pinhole of as many pixels to the radian as the faces have in their middle.
      Camera look = Camera::look_at(eye, eye + d, std::abs(d.y) > 0.99 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0},
                                    9, 9, 2 * std::atan(4.5 / 24.0) * 180 / std::numbers::pi);
      look.near_plane = middle.near_plane;
      look.near_sigma = middle.near_sigma;
      const Frames<float>* truth = sim.render(look, kRgb | kMedianDepth).value();
      const auto i = static_cast<std::size_t>(row * 96 + column);
      for (std::size_t c = 0; c < 3; ++c) {
        const double error =
            static_cast<double>(obs["around"][3 * i + c] - truth->rgb[3 * (4 * 9 + 4) + c]);
        squares += error * error;
        ++n;
      }
      const double z = static_cast<double>(truth->median_depth[4 * 9 + 4]),
                   seen = static_cast<double>(obs["distance"][i]);
      depth_errors.push_back(std::abs(seen - z) / z);
      // And the flat's own triangles.
      double t = 1e30;
      for (const auto& triangle : flat.triangles) {
        const Vec3d a = flat.vertices[triangle[0]], ab = flat.vertices[triangle[1]] - a,
                    ac = flat.vertices[triangle[2]] - a;
        const Vec3d p = cross(d, ac);
        const double det = dot(ab, p);
        if (std::abs(det) < 1e-12) continue;
        const Vec3d s = eye - a, q = cross(s, ab);
        const double u = dot(s, p) / det, v = dot(d, q) / det, hit = dot(ac, q) / det;
        if (u >= 0 && v >= 0 && u + v <= 1 && hit > 0) t = std::min(t, hit);
      }
      if (t < 1e29) mesh_errors.push_back(std::abs(seen - t) / t);
    }
  }
  const double psnr = -10 * std::log10(squares / static_cast<double>(n));
  const auto quantile = [](std::vector<double>& v, double q) {
    std::sort(v.begin(), v.end());
    return v[static_cast<std::size_t>(q * static_cast<double>(v.size() - 1))];
  };
  MESSAGE("against pinholes: PSNR " << psnr << " dB, depth p75 " << quantile(depth_errors, 0.75)
                                    << "; against the mesh: depth median "
                                    << quantile(mesh_errors, 0.5));
  CHECK(psnr > 26.0);
  CHECK(quantile(depth_errors, 0.5) < 1e-3);
  CHECK(quantile(depth_errors, 0.75) < 0.02);  // medians jump at silhouettes
  CHECK(mesh_errors.size() > 150);
  CHECK(quantile(mesh_errors, 0.5) < 0.01);
}

TEST_CASE("a fisheye that looks ahead draws no face behind it") {
  CHECK(CubeMap(sensor(SensorModel::fisheye, 64, 64, 60)).faces().size() == 1);
  CHECK(CubeMap(sensor(SensorModel::fisheye, 64, 64, 170)).faces().size() == 5);
  CHECK(CubeMap(sensor(SensorModel::equirectangular, 64, 128)).faces().size() == 6);
}

TEST_CASE("an episode has one goal image, seen from the goal, with nobody in it") {
  SerialBackend backend;
  SimulatorConfig config;
  config.sensors = rgbd_sensors(24, 32);
  auto sim = make_simulator(backend, peopled_scene(2000), config).value();
  CHECK(sim.goal_images().code() == Errc::invalid_argument);
  PointNavEpisode e = to_kitchen();
  e.id = "42";
  sim.reset(e).value();
  const auto copy = [](std::span<const float> s) { return std::vector<float>(s.begin(), s.end()); };
  const auto goal = copy(sim.goal_images().value()[0].data);
  for (int i = 0; i < 3; ++i) sim.step(Action::move_forward).value();
  CHECK(copy(sim.goal_images().value()[0].data) == goal);
  // What an agent there, turned so, sees in the empty flat.
  auto there = make_simulator(backend, flat_scene(), config).value();
  PointNavEpisode at = e;
  at.start_position = e.goal_position;
  at.start_rotation = goal_rotation(e);
  CHECK(copy(there.reset(at).value()["rgb"]) == goal);
  e.id = "43";
  CHECK(goal_rotation(e).w != goal_rotation(at).w);
}

TEST_CASE("impossible sensors name their field") {
  const auto message = [](auto set) {
    SensorSpec s = sensor(SensorModel::fisheye, 8, 8);
    set(s);
    const Status status = validate(s);
    CHECK(status.code() == Errc::invalid_argument);
    return status.message();
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  CHECK(has(message([](auto& s) { s.hfov = 360; }), "hfov"));
  for (const double wide : {260.0, 300.0, 340.0}) {  // the default lens sees 253 degrees
    CHECK(has(message([wide](auto& s) { s.hfov = wide; }), "hfov"));
  }
  CHECK(has(message([](auto& s) {
              s.fisheye.alpha = s.fisheye.xi = 0;
              s.hfov = 200;
            }),
            "hfov"));
  CHECK(has(message([](auto& s) { s.kind = static_cast<SensorKind>(9); }), "kind"));
  CHECK(has(message([](auto& s) { s.model = static_cast<SensorModel>(9); }), "model"));
  CHECK(has(message([](auto& s) { s.noise.kind = static_cast<NoiseKind>(9); }), "noise.kind"));
  CHECK(has(message([](auto& s) { s.fisheye.alpha = 1.5; }), "alpha"));
  CHECK(has(message([](auto& s) { s.fisheye.xi = -1; }), "xi"));
  CHECK(has(message([](auto& s) { s.fisheye.focal_length = {-1, 0}; }), "focal_length"));
  CHECK(has(message([](auto& s) { s.cube_size = -1; }), "cube_size"));
  CHECK(has(message([](auto& s) { s.noise.kind = NoiseKind::redwood_depth; }), "noise.kind"));
  CHECK(has(message([](auto& s) {
              s.noise.kind = NoiseKind::speckle;
              s.kind = SensorKind::depth;
            }),
            "noise.kind"));
  CHECK(has(message([](auto& s) { s.noise.sigma = -1; }), "noise.sigma"));
  CHECK(has(message([](auto& s) { s.noise.amount = 1.5; }), "noise.amount"));
  CHECK(has(message([](auto& s) { s.noise.salt = -0.1; }), "noise.salt"));
}

TEST_CASE("a semantic sensor says whose each pixel is") {
  SerialBackend backend;
  SimulatorConfig config;
  config.sensors = rgbd_sensors(48, 64);
  config.render.background = {1, 1, 1};  // counts for nobody
  config.sensors.push_back(config.sensors[0]);
  config.sensors[2].uuid = "who";
  config.sensors[2].kind = SensorKind::semantic;
  SimulatorScene scene = peopled_scene(4000);
  auto sim = make_simulator(backend, scene, config).value();
  PointNavEpisode e = to_kitchen();
  e.start_position = {4.6, 0, 1.6};
  e.start_rotation = yaw_rotation(std::numbers::pi);
  const auto obs = sim.reset(e).value();
  // Each person by itself in the empty scene: where it changes the picture's depth, it is what is seen.
  SimulatorConfig plain = config;
  plain.sensors.resize(2);
  auto empty = make_simulator(backend, flat_scene(), plain).value();
  const auto nobody = empty.reset(e).value();
  std::size_t people = 0, right = 0, room = 0;
  for (std::size_t person = 0; person < 2; ++person) {
    SimulatorScene one = flat_scene();
    one.avatars.push_back(scene.avatars[person]);
    auto alone = make_simulator(backend, one, plain).value();
    const auto seen = alone.reset(e).value();
    for (std::size_t i = 0; i < 48 * 64; ++i) {
      const bool here =
          seen["depth"][i] < nobody["depth"][i] - 0.05f && obs["depth"][i] == seen["depth"][i];
      people += here ? 1 : 0;
      right += here && obs["who"][i] == static_cast<float>(2 + person) ? 1 : 0;
    }
  }
  for (std::size_t i = 0; i < 48 * 64; ++i) {
    room += obs["depth"][i] == nobody["depth"][i] && obs["rgb"][3 * i] == nobody["rgb"][3 * i]
                ? (obs["who"][i] == 1.0f ? 0 : 1)
                : 0;
  }
  CHECK(people > 60);
  // At a person's edge it may be in front by depth and yet less than the room behind it.
  CHECK(static_cast<double>(right) > 0.9 * static_cast<double>(people));
  CHECK(room == 0);
  SensorSpec bad = config.sensors[2];
  bad.model = SensorModel::equirectangular;
  CHECK(validate(bad).message().find("pinholes") != std::string::npos);
}

TEST_CASE("labels by hand") {
  // Four sets in two passes; three pixels: nobody's, the second's, the fourth's over the first.
  const std::vector<std::vector<float>> shares{{0.2f, 0.1f, 0, 0.1f, 0.6f, 0.2f, 0.4f, 0, 0},
                                               {0.1f, 0, 0, 0, 0, 0, 0.5f, 0, 0}};
  std::vector<float> labels(3);
  label_pixels(shares, 4, labels);
  CHECK(labels == std::vector<float>{0, 2, 4});
}

TEST_CASE("the cameras of the PointNav v2 challenge look 20 degrees down") {
  for (const SensorSpec& s : pointnav_v2_sensors()) {
    const Camera c = sensor_camera(s, {}, {});
    const Vec3d forward = transpose(c.viewmat.linear) * Vec3d{0, 0, 1};
    CHECK(forward.y == doctest::Approx(-std::sin(20 * 3.14159265358979 / 180)).epsilon(1e-6));
    CHECK(forward.z < -0.9);
    CHECK(c.position().y == doctest::Approx(0.88));
  }
}
