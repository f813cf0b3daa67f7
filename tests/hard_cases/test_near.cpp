// SPDX-License-Identifier: Apache-2.0
// N16, N17: Gaussians at the near plane and around the camera.
#include <doctest/doctest.h>

#include <algorithm>
#include <optional>

#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "support/oracle.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

template <class S>
double peak(const Frames<S>& f) {
  return static_cast<double>(*std::max_element(f.alpha.begin(), f.alpha.end()));
}

}  // namespace

TEST_CASE("N16_near_plane_cross") {
  Camera camera = axis_camera();
  // Planes that float holds exactly, and one that it rounds: the plane is the float next to it.
  for (const double near_plane : {0.5, 0.2, 0.01}) {
    CAPTURE(near_plane);
    camera.near_plane = near_plane;
    const float plane = static_cast<float>(near_plane);
    const auto at = [&](float z, double expected) {
      const GaussianCloud cloud = cloud_of({gaussian({0, 0, z}, {1e-4, 1e-4, 1e-4}, 0.5)});
      for (const Response response : {Response::ewa, Response::ray}) {
        RenderConfig config = all_outputs();
        config.response = response;
        render_everywhere({&cloud}, camera, config, [&](const auto& f, const auto&) {
          CHECK(peak(f) == doctest::Approx(expected).epsilon(1e-5));
          if (!f.stats.empty()) CHECK(f.stats[0].visible == (expected > 0 ? 1u : 0u));
        });
      }
    };
    at(plane, 0);
    at(std::nextafter(plane, 1.0f), 0.5);
    at(std::nextafter(plane, 0.0f), 0);
  }
  // A turned camera: the float32 key decides, in every precision. Which Gaussians are visible must
  // agree.
  Rng rng(16);
  std::vector<RawGaussian> gs;
  camera.near_plane = 0.5;
  for (int i = 0; i < 4000; ++i) {
    gs.push_back(gaussian({rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05),
                           0.5 + 1e-7 * std::floor(rng.uniform(-4, 5))},
                          {0.01, 0.01, 0.01}, 0.5));
  }
  Camera turned = camera;
  const Quatd turn = axis_angle(normalized(Vec3d{1, 2, 3}), 0.7);
  turned.viewmat.linear = rotation_matrix(turn);
  turned.viewmat.translation = {0.1, -0.2, 0.3};
  for (RawGaussian& g : gs) g.mean = rotate(conjugate(turn), g.mean - turned.viewmat.translation);
  const GaussianCloud cloud = cloud_of(gs);
  std::optional<std::uint64_t> visible;  // none if only batches are drawn, which do not count
  for_each_renderer([&](auto& renderer) {
    const auto f = renderer.render({&cloud}, turned, all_outputs());
    if (f.stats.empty()) return;
    if (!visible) visible = f.stats[0].visible;
    CHECK(f.stats[0].visible == *visible);
  });
  if (visible) {
    CHECK(*visible > 1000);
    CHECK(*visible < 3000);
  }
}

TEST_CASE("N17_camera_inside_splat") {
  Camera camera = axis_camera();
  camera.near_plane = 0.01;
  const auto check_drawn = [&](double z, double near_sigma, bool drawn) {
    CAPTURE(z);
    camera.near_sigma = near_sigma;
    const GaussianCloud cloud = cloud_of({gaussian({0, 0, z}, {0.5, 0.5, 0.5}, 0.5)});
    for (const Response response : {Response::ewa, Response::tangent_plane, Response::ray}) {
      RenderConfig config = all_outputs();
      config.response = response;
      render_everywhere({&cloud}, camera, config, [&](const auto& f, const auto&) {
        CHECK(all_finite(f));
        CHECK((peak(f) > 0) == drawn);
      });
    }
  };
  for (const double near_sigma : {0.0, 1.0}) check_drawn(0.0, near_sigma, false);
  // Tools draw everything beyond the plane; sensors nothing within its own extent.
  check_drawn(0.4, 0, true);
  check_drawn(0.4, 1, false);
  check_drawn(0.5, 1, false);
  check_drawn(0.500001, 1, true);
  // Close before the camera the contract's image is still the contract's.
  Rng rng(17);
  std::vector<RawGaussian> gs;
  for (int i = 0; i < 60; ++i) {
    RawGaussian g = gaussian({0.2 * rng.normal(), 0.2 * rng.normal(), rng.uniform(0.02, 0.6)},
                             {0.3, std::pow(10, rng.uniform(-3, -0.5)), 0.2}, 0.3, {1, 0, -0.5f});
    g.quat = random_rotation(rng);
    gs.push_back(g);
  }
  const GaussianCloud cloud = cloud_of(gs);
  camera.near_sigma = 0;
  const OracleImage truth = oracle_render({&cloud}, camera);
  render_everywhere({&cloud}, camera, all_outputs(), [&](const auto& f, const auto& renderer) {
    CHECK(image_error(f.rgb, truth.rgb, 3, truth.undecided).max < renderer.bound(1e-4, 1e-9));
  });
}
