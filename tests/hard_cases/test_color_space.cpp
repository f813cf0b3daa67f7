// SPDX-License-Identifier: Apache-2.0
// Colours of two spaces in one frame.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "backends.hpp"
#include "cases.hpp"
#include "eval/oracle_support.hpp"
#include "ops/mesh_images.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

// The standard's own formulas (IEC 61966-2-1).
long double encoded(long double v) {
  return v <= 0.0031308L ? 12.92L * v : 1.055L * std::pow(v, 1 / 2.4L) - 0.055L;
}
long double decoded(long double v) {
  return v <= 0.04045L ? v / 12.92L : std::pow((v + 0.055L) / 1.055L, 2.4L);
}

float coefficient(double color) { return static_cast<float>((color - 0.5) / 0.28209479177387814); }

GaussianCloud disk(double color, double opacity, ColorSpace space) {
  GaussianCloud cloud = cloud_of({gaussian(
      {0, 0, 2}, {4, 4, 1e-4}, opacity, {coefficient(color), coefficient(color), coefficient(color)})});
  cloud.color_space = space;
  return cloud;
}

constexpr std::array<ColorSpace, 2> kSpaces{ColorSpace::display, ColorSpace::linear};

}  // namespace

TEST_CASE("N52_srgb_vs_linear_flag") {
  const std::size_t p = 3 * kAxisPixel;
  // White of alpha 1/2 over black: half of the display's value, or half of the light.
  for (const ColorSpace space : kSpaces) {
    RenderConfig config;
    config.blend_space = space;
    for (const ColorSpace of : kSpaces) {
      const GaussianCloud white = disk(1, 0.5, of);
      render_everywhere({&white}, axis_camera(), config, [&](const auto& f, const auto& r) {
        CHECK(std::abs(static_cast<double>(f.rgb[p]) - 0.5) < 1e-6);
        const double seen = static_cast<double>(encoded(static_cast<long double>(f.rgb[p])));
        if (space == ColorSpace::linear)
          CHECK(std::abs(seen - 0.7353569830524495) < r.bound(1e-6, 1e-6));
      });
    }
  }
  // Greys of either space in a frame of either, over a background of the frame's.
  for (const double grey : {0.0, 0.002, 0.03, 0.2, 0.5, 0.9, 1.0, 1.7}) {
    for (const ColorSpace space : kSpaces) {
      for (const ColorSpace of : kSpaces) {
        CAPTURE(grey);
        RenderConfig config;
        config.blend_space = space;
        config.background = {0.3, 0.3, 0.3};
        const GaussianCloud cloud = disk(grey, 0.6, of);
        const long double value = of == space ? static_cast<long double>(grey)
                                  : space == ColorSpace::linear
                                      ? decoded(static_cast<long double>(grey))
                                      : encoded(static_cast<long double>(grey));
        const double truth = static_cast<double>(0.6L * value + 0.4L * 0.3L);
        render_everywhere({&cloud}, axis_camera(), config, [&](const auto& f, const auto&) {
          CHECK(std::abs(static_cast<double>(f.rgb[p]) - truth) < 1e-6);
        });
      }
    }
  }
  // A mesh, which is given in linear light, closes the pixel in the frame's space.
  SurfaceMesh wall = quad({-5, -5, 3}, {5, -5, 3}, {5, 5, 3}, {-5, 5, 3});
  wall.base_color = {0.25f, 0.25f, 0.25f};
  const OneMesh mesh(wall);
  for (const ColorSpace space : kSpaces) {
    RenderConfig config;
    config.blend_space = space;
    const GaussianCloud front = disk(0.5, 0.5, ColorSpace::linear);
    const long double g = space == ColorSpace::linear ? 0.5L : encoded(0.5L),
                      k = space == ColorSpace::linear ? 0.25L : encoded(0.25L);
    render_everywhere(
        {&front}, axis_camera(), config,
        [&](const auto& f, const auto&) {
          CHECK(std::abs(static_cast<double>(f.rgb[p]) - static_cast<double>(0.5L * g + 0.5L * k)) <
                1e-6);
        },
        mesh.instances);
  }
}

TEST_CASE(
    "N52_srgb_vs_linear_flag: two clouds through one another, each of its space, against float64") {
  GaussianCloud a =
      sorted(random_cloud(52, {.count = 1500, .sh_degree = 3, .center = {0, 0, 4}, .extent = 1}));
  GaussianCloud b =
      sorted(random_cloud(53, {.count = 1500, .sh_degree = 1, .center = {0, 0, 4}, .extent = 1}));
  b.color_space = ColorSpace::linear;
  for (const ColorSpace space : kSpaces) {
    RenderConfig config = all_outputs();
    config.blend_space = space;
    eval::OracleConfig rules;
    rules.rules = config;
    const std::vector<GaussianSet> sets{a.set(), b.set()};
    const eval::OracleFrames truth = oracle(sets, axis_camera(), rules);
    const auto check = [&](const auto& f, const auto& r) {
      double largest = 0;
      for (std::size_t i = 0; i < truth.rgb.size(); ++i) {
        if (truth.undecided[i / 3] == 0)
          largest = std::max(largest, std::abs(static_cast<double>(f.rgb[i]) - truth.rgb[i]));
      }
      CHECK(largest < r.bound(1.0 / 510, 1e-9));
    };
    render_everywhere({&a, &b}, axis_camera(), config, check);
    // In slices of depth, where a backend has them: the same bits.
    config.tuning.depth_slices = 4;
    render_everywhere({&a, &b}, axis_camera(), config, check);
  }
  // Clouds of two spaces cannot become one.
  CHECK(append(a, b).message().find("colour spaces") != std::string::npos);
}
