// SPDX-License-Identifier: Apache-2.0
// N01, N02: what a Gaussian off the axis of a wide camera looks like, by each response.
#include <doctest/doctest.h>

#include <algorithm>

#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr double kRadians = 3.14159265358979323846 / 180;

struct Sphere {
  double rho, theta;  ///< standard deviation over distance; degrees off the axis
  GaussianCloud cloud;
};

/// Spheres a metre away, towards the right and towards a corner of the image.
std::vector<Sphere> sphere_grid() {
  std::vector<Sphere> grid;
  for (const double rho : {0.01, 0.03, 0.1}) {
    for (const double theta : {0.0, 30.0, 45.0, 60.0}) {
      for (const double roll : {0.0, 0.7}) {
        const double s = std::sin(theta * kRadians);
        const Vec3d mean{s * std::cos(roll), s * std::sin(roll), std::cos(theta * kRadians)};
        grid.push_back({rho, theta, cloud_of({gaussian(mean, {rho, rho, rho}, 0.98)})});
      }
    }
  }
  return grid;
}

Camera wide_camera(int width, int height) {
  Camera c;
  c.set_hfov(width, height, 130);
  return c;
}

/// Largest error of alpha, `truth(x, y)` the alpha without thresholds.
template <class S, class Truth>
double alpha_error(const Frames<S>& f, const Truth& truth) {
  double worst = 0;
  for (std::size_t p = 0; p < f.alpha.size(); ++p) {
    const Real x = static_cast<Real>(p % f.width) + 0.5L, y = static_cast<Real>(p / f.width) + 0.5L;
    const double raw = static_cast<double>(truth(x, y));
    // Whether a pixel at the threshold is drawn is a matter of rounding.
    if (std::abs(raw * 255 - 1) < 1e-4) continue;
    const double expected = raw * 255 < 1 ? 0 : std::min(raw, 0.99);
    worst = std::max(worst, std::abs(static_cast<double>(f.alpha[p]) - expected));
  }
  return worst;
}

/// Largest errors over the grid, by precision.
struct LargestErrors {
  double in_float = 0, in_double = 0;
  template <class R>
  void add(const R&, double e) {
    double& worst = R::is_float ? in_float : in_double;
    worst = std::max(worst, e);
  }
};

}  // namespace

TEST_CASE("N01_ewa_offaxis_grid") {
  LargestErrors worst;
  // A GPU draws small and large images in two ways.
  for (const Camera& camera : {wide_camera(256, 192), wide_camera(64, 48)}) {
    for (const Sphere& s : sphere_grid()) {
      CAPTURE(s.rho);
      CAPTURE(s.theta);
      const Truth2d truth = truth_project(truth_of(s.cloud, 0), camera);
      render_everywhere({&s.cloud}, camera, all_outputs(), [&](const auto& f, const auto& renderer) {
        const double e = alpha_error(f, [&](Real x, Real y) { return truth.alpha(x, y); });
        worst.add(renderer, e);
        CHECK(e < renderer.bound(2e-6, 1e-12));
      });
    }
  }
  MESSAGE("ewa: float " << worst.in_float << ", double " << worst.in_double);
}

TEST_CASE("N02_exact_ray_grid") {
  const Camera camera = wide_camera(256, 192);
  LargestErrors worst_ray, worst_tangent;
  for (const Sphere& s : sphere_grid()) {
    CAPTURE(s.rho);
    CAPTURE(s.theta);
    const TruthSplat splat = truth_of(s.cloud, 0);
    const Truth2d ewa = truth_project(splat, camera);
    const TruthRay ray(splat, camera);
    const TruthTangent tangent(splat, camera);
    RenderConfig config = all_outputs();
    config.response = Response::ray;
    render_everywhere({&s.cloud}, camera, config, [&](const auto& f, const auto& renderer) {
      const double e = alpha_error(f, [&](Real x, Real y) { return ray.alpha(x, y); });
      worst_ray.add(renderer, e);
      CHECK(e < renderer.bound(2e-6, 1e-12));
    });
    config.response = Response::tangent_plane;
    render_everywhere({&s.cloud}, camera, config, [&](const auto& f, const auto& renderer) {
      const double e = alpha_error(f, [&](Real x, Real y) { return tangent.alpha(x, y); });
      worst_tangent.add(renderer, e);
      CHECK(e < renderer.bound(2e-6, 1e-12));
    });
    Real gap = 0;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        gap = std::max(gap, std::abs(ewa.alpha(x + 0.5L, y + 0.5L) - ray.alpha(x + 0.5L, y + 0.5L)));
      }
    }
    MESSAGE("rho " << s.rho << ", theta " << s.theta << ": ewa against the exact response "
                   << static_cast<double>(gap) << ", 1.2 rho tan + 1.1 rho^2 = "
                   << 1.2 * s.rho * std::tan(s.theta * kRadians) + 1.1 * s.rho * s.rho);
  }
  MESSAGE("ray: float " << worst_ray.in_float << ", double " << worst_ray.in_double);
  MESSAGE("tangent_plane: float " << worst_tangent.in_float << ", double " << worst_tangent.in_double);
}
