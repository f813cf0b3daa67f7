// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "gsnav/backends/serial.hpp"
#include "gsnav/sim/basic_simulator.hpp"
#include "sim_scene.hpp"
#include "support/compiled_frames.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("Gaussian noise has the mean and the deviation asked for and stays within colours") {
  NoiseModel m;
  m.kind = NoiseKind::gaussian;
  m.intensity = 0.05;
  m.mean = 0.4;
  m.sigma = 1.5;
  std::vector<float> c(200000, 0.5f);
  add_color_noise(m, 3, c);
  double sum = 0.0, squares = 0.0;
  for (const float v : c) {
    sum += static_cast<double>(v) - 0.5;
    squares += (static_cast<double>(v) - 0.5) * (static_cast<double>(v) - 0.5);
  }
  const double n = static_cast<double>(c.size()), mean = sum / n,
               deviation = std::sqrt(squares / n - mean * mean);
  CHECK(mean == doctest::Approx(0.02).epsilon(0.02));  // 0.05 * 0.4; five standard errors are 0.0008
  CHECK(deviation == doctest::Approx(0.075).epsilon(0.01));  // 0.05 * 1.5
  std::vector<float> white(1000, 1.0f), again(1000, 1.0f);
  add_color_noise(m, 4, white);
  add_color_noise(m, 4, again);
  CHECK(*std::max_element(white.begin(), white.end()) == 1.0f);
  CHECK(white == again);
  add_color_noise(m, 5, again);
  CHECK(white != again);
}

TEST_CASE("speckle is Gaussian noise in proportion to the colour") {
  NoiseModel m;
  m.kind = NoiseKind::speckle;
  m.intensity = 0.05;
  m.mean = 0.4;
  m.sigma = 1.5;
  NoiseModel flat = m;
  flat.kind = NoiseKind::gaussian;
  std::vector<float> speckled(1000), added(1000, 0.0f);
  for (std::size_t i = 0; i < added.size(); ++i) {
    speckled[i] = 0.0005f * static_cast<float>(i) + 0.2f;
    added[i] = 0.5f;
  }
  const std::vector<float> clean = speckled;
  add_color_noise(m, 7, speckled);
  add_color_noise(flat, 7, added);  // The same draws.
  for (std::size_t i = 0; i < added.size(); ++i) {
    const double noise = static_cast<double>(added[i]) - 0.5, c = static_cast<double>(clean[i]);
    CHECK(static_cast<double>(speckled[i]) == doctest::Approx(c + c * noise).epsilon(1e-5));
  }
}

TEST_CASE("Poisson noise has the probabilities of its formula, for small and large means") {
  NoiseModel m;
  m.kind = NoiseKind::poisson;
  // Sixteen different bytes: v is 16 there. 256: v is 256. Means of the values under test: v c.
  for (const double v : {2.0, 16.0, 256.0}) {
    for (const double c : {0.25, 0.5, 0.75}) {
      const std::size_t n = 200000;
      std::vector<float> image(n, static_cast<float>(c));
      // Values of other bytes are added, so that the image has enough different bytes for this v.
      for (int k = 0; k < static_cast<int>(v) - 1; ++k) image.push_back(static_cast<float>(k) / 255.0f);
      add_color_noise(m, 11, image);
      std::vector<double> count(1024);
      for (std::size_t i = 0; i < n; ++i) {
        const double k = static_cast<double>(image[i]) * v;
        REQUIRE(std::abs(k - std::round(k)) < 1e-4);
        count[static_cast<std::size_t>(std::lround(k))] += 1;
      }
      // Each probability by the recurrence p(k) = p(k - 1) mean / k. All above v are clamped to v.
      const double mean = v * c;
      double p = std::exp(-mean), rest = 1.0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(v); ++k) {
        if (k > 0) p *= mean / static_cast<double>(k);
        rest -= p;
        const double expected = p * static_cast<double>(n);
        CHECK(std::abs(count[k] - expected) < 5 * std::sqrt(expected) + 3);
      }
      const double clamped = std::max(rest, 0.0) * static_cast<double>(n);
      CHECK(std::abs(count[static_cast<std::size_t>(v)] - clamped) < 5 * std::sqrt(clamped) + 3);
    }
  }
  std::vector<float> black(100, 0.0f);
  add_color_noise(m, 1, black);
  CHECK(black == std::vector<float>(100, 0.0f));
}

TEST_CASE("salt and pepper draws as many white and black values as asked for, and no others") {
  NoiseModel m;
  m.kind = NoiseKind::salt_and_pepper;
  m.amount = 0.1;
  m.salt = 0.25;
  const double n = 300000;
  std::vector<float> image(static_cast<std::size_t>(n), 0.5f);
  add_color_noise(m, 2, image);
  const auto white = static_cast<double>(std::count(image.begin(), image.end(), 1.0f));
  const auto black = static_cast<double>(std::count(image.begin(), image.end(), 0.0f));
  CHECK(static_cast<double>(std::count(image.begin(), image.end(), 0.5f)) + white + black == n);
  // A place that is drawn twice counts once; black comes last.
  const double hit = 1 - std::exp(-0.075);
  CHECK(black / n == doctest::Approx(hit).epsilon(0.02));
  CHECK(white / n == doctest::Approx((1 - std::exp(-0.025)) * (1 - hit)).epsilon(0.03));
  m.salt = 1.0;
  m.amount = 1e-9;
  std::vector<float> three(3, 0.5f);
  add_color_noise(m, 2, three);
  CHECK(std::count(three.begin(), three.end(), 1.0f) == 1);  // The number of draws is rounded up.
  add_color_noise(m, 2, std::span<float>());
}

TEST_CASE(
    "Redwood depth is quantised in disparity, on every second pixel, with the deviation published") {
  const int height = 60, width = 80;
  const std::vector<float> wall(static_cast<std::size_t>(height * width), 4.0f);
  std::vector<float> out(wall.size());
  NoiseModel m;
  m.kind = NoiseKind::redwood_depth;
  redwood_depth(m, 9, height, width, wall, out);
  double sum = 0.0, squares = 0.0;
  for (const float z : out) {
    const double steps = 281.04 / static_cast<double>(z);
    CHECK(steps == doctest::Approx(std::round(steps)).epsilon(1e-5));
    sum += steps;
    squares += steps * steps;
  }
  const double n = static_cast<double>(out.size()), mean = sum / n;
  // A normal of mean 281.04 / 4 and deviation 8 / 36, rounded: its moments by the error function.
  double true_mean = 0.0, true_square = 0.0;
  const auto below = [](double x) {
    return 0.5 * std::erfc(-(x - 281.04 / 4.0) / (8.0 / 36.0) / std::sqrt(2.0));
  };
  for (int k = 65; k < 76; ++k) {
    const double p = below(k + 0.5) - below(k - 0.5);
    true_mean += p * k;
    true_square += p * k * k;
  }
  const double true_deviation = std::sqrt(true_square - true_mean * true_mean);
  CHECK(std::abs(mean - true_mean) < 5 * true_deviation / std::sqrt(n));
  CHECK(std::sqrt(squares / n - mean * mean) == doctest::Approx(true_deviation).epsilon(0.06));

  // Without noise: the value of the even pixel, rounded to a step; no return stays none.
  std::vector<float> ramp(wall.size());
  for (std::size_t i = 0; i < ramp.size(); ++i)
    ramp[i] = i % 80 < 40 ? 1.0f + 0.01f * static_cast<float>(i % 80) : 0.0f;
  m.multiplier = 0.0;
  redwood_depth(m, 9, height, width, ramp, out);
  for (std::size_t i = 0; i < ramp.size(); ++i) {
    const std::size_t x = i % 80 - i % 2, y = i / 80 - i / 80 % 2;
    const float z = ramp[y * 80 + x];
    const double truth = z > 0 ? 281.04 / std::round(281.04 / static_cast<double>(z)) : 0.0;
    CHECK(static_cast<double>(out[i]) == doctest::Approx(truth).epsilon(1e-6));
  }
}

TEST_CASE("noise follows the seed, the episode and the action, not who looked before") {
  SerialBackend backend;
  SimulatorConfig clean;
  clean.sensors = rgbd_sensors(24, 32);
  SimulatorConfig noisy = clean;
  noisy.sensors[0].noise.kind = NoiseKind::gaussian;
  noisy.sensors.push_back(clean.sensors[0]);
  noisy.sensors[2].uuid = "clean";
  noisy.seed = 3;
  auto plain = make_simulator(backend, flat_scene(), clean).value();
  auto sim = make_simulator(backend, flat_scene(), noisy).value();
  const auto copy = [](std::span<const float> s) { return std::vector<float>(s.begin(), s.end()); };
  const auto truth = copy(plain.reset(to_kitchen()).value()["rgb"]);
  const auto first = sim.reset(to_kitchen()).value();
  CHECK(sim.render_count() == 1);
  CHECK(copy(first["clean"]) == truth);
  const auto a = copy(first["rgb"]);
  CHECK(a != truth);
  CHECK(copy(sim.observe().value()["rgb"]) == a);
  sim.step(Action::turn_left).value();
  const auto turned = copy(sim.step(Action::turn_right).value()["rgb"]);
  CHECK(turned != a);  // the same view, another draw
  CHECK(copy(sim.reset(to_kitchen()).value()["rgb"]) == a);
  sim.set_seed(4);
  CHECK(copy(sim.observe().value()["rgb"]) != a);
}

TEST_CASE("sensors of a rig have noise of their own: none is another's, moved on") {
  SerialBackend backend;
  SimulatorConfig c;
  c.sensors.clear();
  SensorSpec s;
  s.resolution = {48, 64};
  s.position = {0, 1.5, 0};
  s.uuid = "clean";
  c.sensors.push_back(s);
  s.noise.kind = NoiseKind::gaussian;
  s.noise.intensity = 0.02;
  for (const char* name : {"a", "b", "c"}) {
    s.uuid = name;
    c.sensors.push_back(s);
  }
  auto sim = make_simulator(backend, flat_scene(), c).value();
  const auto seen = sim.reset(to_kitchen()).value();
  const auto noise = [&](const char* name) {
    std::vector<double> out;
    for (std::size_t i = 0; i < seen["clean"].size(); ++i) {
      const double clean = static_cast<double>(seen["clean"][i]);
      // What may have been cut at black or white says nothing.
      out.push_back(clean > 0.15 && clean < 0.85 ? static_cast<double>(seen[name][i]) - clean : 0.0);
    }
    return out;
  };
  const std::vector<double> of[3] = {noise("a"), noise("b"), noise("c")};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      for (std::size_t shift = 0; i != k && shift < 8; ++shift) {
        double xy = 0, xx = 0, yy = 0;
        for (std::size_t n = 0; n + shift < of[i].size(); ++n) {
          xy += of[i][n + shift] * of[k][n];
          xx += of[i][n + shift] * of[i][n + shift];
          yy += of[k][n] * of[k][n];
        }
        REQUIRE(xx > 0);
        CHECK(std::abs(xy / std::sqrt(xx * yy)) <
              0.08);  // of some thousand values; 1 where they are the same
      }
    }
  }
}
