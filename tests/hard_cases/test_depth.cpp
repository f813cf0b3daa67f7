// SPDX-License-Identifier: Apache-2.0
// N45 to N48, N70: what depth is.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>

#include "hard_cases/arrays.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth.hpp"
#include "ops/mesh_images.hpp"
#include "support/oracle.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr std::size_t kCenter = kAxisPixel;

template <class S>
double at_center(const std::vector<S>& image) {
  return static_cast<double>(image[kCenter]);
}

template <class S>
bool all_zero(const std::vector<S>& image) {
  return std::all_of(image.begin(), image.end(), [](S v) { return v == 0; });
}

}  // namespace

TEST_CASE("N45_depth_definitions") {
  double worst = 0;
  for (const double a : {0.1, 0.49, 0.499, 0.505, 0.51, 0.9}) {
    CAPTURE(a);
    const GaussianCloud cloud =
        cloud_of({gaussian({0, 0, 4}, {9, 9, 1e-5}, 0.98), gaussian({0, 0, 2}, {5, 5, 1e-5}, a)});
    const double w1 = static_cast<double>(cloud.opacities[1]);
    const double w2 = (1 - w1) * static_cast<double>(cloud.opacities[0]);
    for (const double tau : {0.05, 0.3, 0.5, 0.95, 0.999}) {
      RenderConfig config = all_outputs();
      config.first_hit_tau = tau;
      render_everywhere({&cloud}, axis_camera(), config, [&](const auto& f, const auto&) {
        const double first = w1 >= tau ? 2 : w1 + w2 >= tau ? 4 : 0;
        const std::array<double, 4> errors{at_center(f.accumulated_depth) - (2 * w1 + 4 * w2),
                                           at_center(f.expected_depth) - (2 * w1 + 4 * w2) / (w1 + w2),
                                           at_center(f.median_depth) - (w1 > 0.5 ? 2 : 4),
                                           at_center(f.first_hit_depth) - first};
        for (const double e : errors) {
          CHECK(std::abs(e) < 1e-5);
          worst = std::max(worst, std::abs(e));
        }
      });
    }
    // Alone, it is found in another way.
    RenderConfig median;
    median.outputs = kMedianDepth;
    render_everywhere({&cloud}, axis_camera(), median, [&](const auto& f, const auto&) {
      CHECK(std::abs(at_center(f.median_depth) - (w1 > 0.5 ? 2 : 4)) < 1e-5);
    });
  }
  MESSAGE("depths are off by " << worst << " m");
}

TEST_CASE("N46_depth_tilted_disk") {
  // Flat, standard deviation 0.2 m, turned by 80 degrees about y and x: every pixel sees its own depth.
  double nearest = 1e9, farthest = 0, largest = 0;
  for (const Vec3d& axis : {Vec3d{0, 1, 0}, Vec3d{1, 0, 0}, normalized(Vec3d{1, -2, 0})}) {
    for (const Vec3d& mean : {Vec3d{0, 0, 3}, Vec3d{0.4, -0.3, 3}}) {
      RawGaussian g = gaussian(mean, {0.2, 0.2, 0}, 0.95);
      g.quat = axis_angle(axis, 80 * 3.14159265358979323846 / 180);
      const GaussianCloud cloud = cloud_of({g});
      const Vec3d normal = rotate(g.quat, Vec3d{0, 0, 1});
      // The contract's clamp: k standard deviations along the view axis.
      const double sigma_z = 0.2 * std::sqrt(1 - normal.z * normal.z);
      const double reach = std::sqrt(2 * std::log(255 * 0.95)) * sigma_z;
      Camera camera = axis_camera(kAxisSize, 128);
      RenderConfig config = all_outputs();
      config.first_hit_tau = 0.02;
      render_everywhere({&cloud}, camera, config, [&](const auto& f, const auto&) {
        int plane = 0, clamped = 0;
        double worst = 0;
        for (std::size_t p = 0; p < f.alpha.size(); ++p) {
          if (f.alpha[p] == 0) continue;
          const Vec3d ray{(static_cast<double>(p % kAxisSize) + 0.5 - camera.cx) / camera.fx,
                          (static_cast<double>(p / kAxisSize) + 0.5 - camera.cy) / camera.fy, 1};
          const double z = dot(normal, mean) / dot(normal, ray);
          const bool inside = std::abs(z - mean.z) < reach && z > 0;
          (inside ? plane : clamped) += 1;
          const double seen = static_cast<double>(f.expected_depth[p]);
          if (inside) {
            worst = std::max(worst, std::abs(seen - z));
            nearest = std::min(nearest, z);
            farthest = std::max(farthest, z);
          } else {
            worst = std::max(worst, std::abs(std::abs(seen - mean.z) - reach));
          }
          if (f.median_depth[p] != 0)
            worst = std::max(worst, std::abs(static_cast<double>(f.median_depth[p]) - seen));
          if (f.first_hit_depth[p] != 0) {
            worst = std::max(worst, std::abs(static_cast<double>(f.first_hit_depth[p]) - seen));
          }
        }
        CHECK(worst < 1e-3);
        largest = std::max(largest, worst);
        CHECK(plane > 80);
        CHECK(clamped > 0);
      });
      // The depth of the centre, which compat modes know only, is off by decimetres.
      config.compat = Compat::inria;
      config.tuning.tile_size = 16;
      render_everywhere({&cloud}, camera, config, [&](const auto& f, const auto&) {
        double off = 0;
        for (std::size_t p = 0; p < f.alpha.size(); ++p) {
          if (f.alpha[p] > 0)
            off = std::max(off, std::abs(static_cast<double>(f.expected_depth[p]) - mean.z));
        }
        CHECK(off < 1e-6);
      });
    }
  }
  MESSAGE("depths of one Gaussian at 3 m: " << nearest << " to " << farthest << " m, off by " << largest
                                            << " m");
  if (farthest > 0) CHECK(farthest - nearest > 0.5);  // unless no backend draws
}

TEST_CASE("N47_depth_far") {
  Camera camera = axis_camera(33, 64);
  // A plane at 100 m of 1000 Gaussians: across the view axis, and turned; patches of it, and faint
  // sheets that all cover the image.
  for (const double tilt : {0.0, 35.0}) {
    for (const bool sheets : {false, true}) {
      Rng rng(47);
      const Quatd turn = axis_angle(normalized(Vec3d{1, 2, 0}), tilt * 3.14159265358979323846 / 180);
      std::vector<RawGaussian> gs;
      for (int i = 0; i < 1000; ++i) {
        const Vec3d at{rng.uniform(-30, 30), rng.uniform(-30, 30), 0};
        // Not flat: the long double truth inverts the covariance.
        RawGaussian g = gaussian(Vec3d{0, 0, 100} + rotate(turn, at),
                                 sheets ? Vec3d{60, 50, 1e-3} : Vec3d{3, 2.5, 1e-3},
                                 sheets ? rng.uniform(0.004, 0.006) : rng.uniform(0.02, 0.9));
        g.quat = turn * axis_angle(Vec3d{0, 0, 1}, rng.uniform(0, 3));
        gs.push_back(g);
      }
      const GaussianCloud cloud = cloud_of(gs);
      const OracleImage truth = oracle_render({&cloud}, camera);
      const Vec3d normal = rotate(turn, Vec3d{0, 0, 1});
      double worst = 0, plane_error = 0;
      render_everywhere({&cloud}, camera, all_outputs(), [&](const auto& f, const auto&) {
        for (std::size_t p = 0; p < f.alpha.size(); ++p) {
          if (truth.undecided[p] || truth.alpha[p] < 0.01L) continue;
          const double seen = static_cast<double>(f.expected_depth[p]);
          worst = std::max(worst, std::abs(seen - static_cast<double>(truth.expected[p])));
          const Vec3d ray{(static_cast<double>(p % 33) + 0.5 - camera.cx) / camera.fx,
                          (static_cast<double>(p / 33) + 0.5 - camera.cy) / camera.fy, 1};
          plane_error = std::max(plane_error, std::abs(seen - 100 * normal.z / dot(normal, ray)));
        }
      });
      MESSAGE(tilt << " degrees, " << std::string(sheets ? "sheets" : "patches") << ": " << worst
                   << " m; from the plane " << plane_error << " m");
      CHECK(worst < 1e-4);
      // Across the view axis the answer is known without any rendering: the thickness is a millimetre.
      if (tilt == 0) CHECK(plane_error < 1e-4);
    }
  }
}

TEST_CASE("N48_depth_no_return") {
  const GaussianCloud faint = cloud_of({gaussian({0, 0, 2}, {5, 5, 1e-4}, 0.3)});
  render_everywhere({&faint}, axis_camera(), all_outputs(), [](const auto& f, const auto&) {
    CHECK(all_zero(f.median_depth));
    CHECK(all_zero(f.first_hit_depth));
    CHECK(std::abs(at_center(f.alpha) - 0.3) < 1e-6);  // the mask to tell by
    CHECK(std::abs(at_center(f.expected_depth) - 2) < 1e-5);
  });
  // Half a hundredth: no return by Habitat-GS's rule.
  const GaussianCloud fainter = cloud_of({gaussian({0, 0, 2}, {5, 5, 1e-4}, 0.008)});
  RenderConfig config = all_outputs();
  config.compat = Compat::habitat_gs;
  render_everywhere({&fainter}, axis_camera(), config,
                    [](const auto& f, const auto&) { CHECK(all_zero(f.expected_depth)); });
  const GaussianCloud none;
  render_everywhere({&none}, axis_camera(), all_outputs(), [](const auto& f, const auto&) {
    for (const auto* image :
         {&f.median_depth, &f.expected_depth, &f.accumulated_depth, &f.first_hit_depth}) {
      CHECK(all_zero(*image));
    }
  });
}

TEST_CASE("N70_depth_only_equals_rgbd") {
  const GaussianCloud a = random_cloud(70, {.count = 1500, .needle = 0.3});
  const GaussianCloud b = needle_cloud(71, 300);
  const std::vector<Placed> scene{&a, &b};
  for (const Response response : {Response::ewa, Response::ray}) {
    RenderConfig config = all_outputs();
    config.response = response;
    for_each_renderer([&](auto& renderer) {
      config.outputs = kRgb | kAlpha | kAnyDepth;
      const auto all = renderer.render(scene, axis_camera(), config);
      // Each output alone, with colour, and every depth without it.
      for (const unsigned more : {0u, static_cast<unsigned>(kRgb), static_cast<unsigned>(kAlpha),
                                  static_cast<unsigned>(kMedianDepth)}) {
        for (const unsigned output :
             {kRgb, kAlpha, kMedianDepth, kExpectedDepth, kAccumulatedDepth, kFirstHitDepth}) {
          config.outputs = output | more;
          const auto f = renderer.render(scene, axis_camera(), config);
          const auto same = [&](const auto& part, const auto& whole, unsigned which) {
            return (config.outputs & which) != 0 ? part == whole : part.empty();
          };
          CHECK(same(f.rgb, all.rgb, kRgb));
          CHECK(same(f.alpha, all.alpha, kAlpha));
          CHECK(same(f.median_depth, all.median_depth, kMedianDepth));
          CHECK(same(f.expected_depth, all.expected_depth, kExpectedDepth));
          CHECK(same(f.accumulated_depth, all.accumulated_depth, kAccumulatedDepth));
          CHECK(same(f.first_hit_depth, all.first_hit_depth, kFirstHitDepth));
        }
      }
    });
  }
}

TEST_CASE("depths alone have the bits that they have beside colour, though pixels close earlier") {
  GaussianCloud cloud = random_cloud(21, {.count = 6000, .scale = 0.08});
  for (std::size_t i = 0; i < cloud.size(); i += 7)
    cloud.opacities[i] = i % 2 == 0 ? 0.5f : 0.99f;  // steps to a half
  const Camera camera = Camera::look_at({0.1, 0, 0}, {0, 0, 4}, {0, -1, 0}, 97, 64, 70);
  const MeshScene ball = [] {
    MeshScene scene;
    scene.add(sphere(0.8, 24, 16)).value();
    return scene;
  }();
  const std::vector<MeshInstance> instances{ball.instance(0, {{}, {0.2, 0.1, 4}, 1}, 1)};
  for (const double tau : {0.05, 0.5, 0.99999}) {
    RenderConfig config = all_outputs();
    config.first_hit_tau = tau;
    for_each_renderer([&](auto& renderer) {
      for (const bool with_mesh : {false, true}) {
        if (kSanitized && with_mesh != (tau == 0.5)) continue;  // device code is emulated there
        const auto draw = [&](unsigned outputs) {
          RenderConfig c = config;
          c.outputs = outputs;
          return renderer.render({{&cloud, {}}}, {camera}, c,
                                 with_mesh ? instances : std::vector<MeshInstance>{});
        };
        const auto all = draw(config.outputs), median = draw(kMedianDepth), first = draw(kFirstHitDepth),
                   both = draw(kMedianDepth | kFirstHitDepth);
        CHECK(median.median_depth == all.median_depth);
        CHECK(first.first_hit_depth == all.first_hit_depth);
        CHECK(both.median_depth == all.median_depth);
        CHECK(both.first_hit_depth == all.first_hit_depth);
        CHECK(std::count_if(all.median_depth.begin(), all.median_depth.end(),
                            [](auto d) { return d > 0; }) > 1000);
      }
    });
  }
}
