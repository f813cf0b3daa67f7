// SPDX-License-Identifier: Apache-2.0
// N28, N29: scenes far from zero and across cells of the lattice that positions are stored on.
#include <doctest/doctest.h>

#include <algorithm>

#include "hard_cases/arrays.hpp"
#include "hard_cases/cases.hpp"
#include "support/oracle.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

double dyadic(double v, double step) { return std::floor(v / step) * step; }

/// Random Gaussians before the origin; means are whole multiples of `step`.
std::vector<RawGaussian> raw_scene(std::uint64_t seed, std::size_t count, double step) {
  Rng rng(seed);
  std::vector<RawGaussian> gs(count);
  for (RawGaussian& g : gs) {
    const Vec3d mean{dyadic(rng.uniform(-2, 2), step), dyadic(rng.uniform(-2, 2), step),
                     dyadic(rng.uniform(2, 6), step)};
    g = gaussian(mean, {0.08, 0.08 * rng.uniform(0.1, 1), 0.08 * rng.uniform(0.1, 1)},
                 rng.uniform(0.05, 0.95),
                 {static_cast<float>(rng.normal()), static_cast<float>(rng.normal()), 0});
    g.quat = random_rotation(rng);
  }
  return gs;
}

GaussianCloud shifted(std::vector<RawGaussian> gs, const Vec3d& shift) {
  for (RawGaussian& g : gs) g.mean += shift;
  return cloud_of(gs);
}

/// Moves a camera by `shift`.
Camera shifted(Camera camera, const Vec3d& shift) {
  const Vec3d eye = camera.position() + shift;
  camera.viewmat.translation = -(camera.viewmat.linear * eye);
  return camera;
}

/// Dots on a grid of pixels, depths between 2 and 6 m, as seen by `axis_camera` at `eye`: each alone at
/// its pixel, opaque, flat and across the view axis.
std::vector<RawGaussian> dots(Rng& rng, const Camera& camera, const Vec3d& eye) {
  std::vector<RawGaussian> gs;
  for (int y = 4; y < camera.height; y += 8) {
    for (int x = 4; x < camera.width; x += 8) {
      const double z = rng.uniform(2, 6);
      const Vec3d at{(x + 0.5 - camera.cx) / camera.fx * z, (y + 0.5 - camera.cy) / camera.fy * z, z};
      gs.push_back(gaussian(eye + at, {0.02 * z, 0.02 * z, 0}, 0.95));
    }
  }
  return gs;
}

/// Largest error of the depth of `dots`, metres.
template <class S>
double depth_error(const Frames<S>& f, const Camera& camera, const std::vector<RawGaussian>& gs,
                   const Vec3d& eye) {
  double worst = 0;
  std::size_t i = 0;
  for (int y = 4; y < camera.height; y += 8) {
    for (int x = 4; x < camera.width; x += 8, ++i) {
      const std::size_t p = static_cast<std::size_t>(y * camera.width + x);
      worst = std::max(worst, std::abs(static_cast<double>(f.median_depth[p]) - (gs[i].mean.z - eye.z)));
    }
  }
  return worst;
}

}  // namespace

TEST_CASE("N28_world_1e6") {
  SUBCASE("a shift by points of the lattice leaves every bit") {
    const auto gs = raw_scene(28, 600, 0x1p-20);
    const Vec3d shift{1e6, -640000, 64.0 * 15000};
    REQUIRE(std::fmod(shift.x, kOriginLattice) == 0);
    const GaussianCloud near = cloud_of(gs), far = shifted(gs, shift);
    REQUIRE(near.origins.empty());
    REQUIRE(far.origins.size() == 2);  // zero, and the cell
    Camera camera = axis_camera();
    camera.viewmat.translation = {0.125, -0.25, 0.5};
    Camera sideways = camera;  // turned by whole axes, so that the eye is exact in the world
    sideways.viewmat.linear = Mat3d{{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}};
    for (const Camera& c : {camera, sideways}) {
      for_each_renderer([&](auto& renderer) {
        const auto reference = renderer.render({&near}, c, all_outputs());
        CHECK(same_images(reference, renderer.render({&far}, shifted(c, shift), all_outputs())));
        const Placed placed(&near, {{}, shift, 1});
        CHECK(same_images(reference, renderer.render({placed}, shifted(c, shift), all_outputs())));
      });
    }
  }
  SUBCASE("any shift: depth, and the image against long double at zero") {
    Rng rng(280);
    Camera camera = axis_camera();
    const Vec3d eye{0.3, -0.2, 0.1};
    camera.viewmat.translation = -eye;
    const auto gs = raw_scene(281, 300, 0x1p-21);
    const GaussianCloud near = cloud_of(gs);
    const OracleImage truth = oracle_render({&near}, camera);
    // Positions move by up to 2^-20 m in each axis, alpha of the smallest by 3e-4 of itself.
    const std::vector<bool> undecided = undecided_pixels({&near}, camera, {}, 1e-3);
    double worst_depth = 0, worst_image = 0;
    for (int round = 0; round < 6; ++round) {
      const Vec3d shift = Vec3d{rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)} * 1e6;
      const auto at = dots(rng, camera, eye);
      const GaussianCloud far = shifted(gs, shift), far_dots = shifted(at, shift);
      for_each_renderer([&](auto& renderer) {
        const auto f = renderer.render({&far}, shifted(camera, shift), all_outputs());
        worst_image = std::max(worst_image, image_error(f.rgb, truth.rgb, 3, undecided).max);
        const auto d = renderer.render({&far_dots}, shifted(camera, shift), all_outputs());
        worst_depth = std::max(worst_depth, depth_error(d, camera, at, eye));
      });
    }
    MESSAGE("depth " << worst_depth << " m, image " << worst_image);
    // Half a step of a float below 32 m (the mean), and of one below 64 m (the cell's origin seen from
    // the camera): 2^-20 + 2^-19.
    CHECK(worst_depth <= 0x1p-20 + 0x1p-19 + 0x1p-22);
    CHECK(worst_image <= 1e-4);
  }
}

TEST_CASE("N29_chunk_boundary") {
  // Cells of the lattice meet at x = 32 m. The same scene around x = 0 has no seam.
  const Vec3d edge{32, 0, 0};
  Rng rng(29);
  SUBCASE(
      "positions that both cells hold exactly: the same bits, the camera on either side and between") {
    const std::vector<RawGaussian> gs = raw_scene(290, 800, 0x1p-18);
    const GaussianCloud across = shifted(gs, edge), inside = cloud_of(gs);
    REQUIRE(across.origins.size() == 2);
    REQUIRE(inside.origins.empty());
    std::size_t low = 0;
    for (const std::uint32_t id : across.origin_ids) low += across.origins[id].x == 0 ? 1 : 0;
    REQUIRE(low > 300);
    REQUIRE(low < 500);
    // Around a corner of eight cells, at once and put together from two files.
    const Vec3d corner{32, -32, 28};
    const GaussianCloud eight = shifted(gs, corner);
    REQUIRE(eight.origins.size() == 8);
    GaussianCloud halves = shifted({gs.begin(), gs.begin() + 400}, corner);
    REQUIRE(append(halves, shifted({gs.begin() + 400, gs.end()}, corner)).ok());
    for (const double x : {-1.5, -0.001953125, 0.0, 0.001953125, 1.5}) {
      Camera camera = axis_camera();
      camera.viewmat.translation = {-x, 0, 0};
      for_each_renderer([&](auto& renderer) {
        const auto reference = renderer.render({&inside}, camera, all_outputs());
        CHECK(same_images(reference, renderer.render({&across}, shifted(camera, edge), all_outputs())));
        CHECK(same_images(reference, renderer.render({&eight}, shifted(camera, corner), all_outputs())));
        CHECK(
            same_images(reference, renderer.render({&halves}, shifted(camera, corner), all_outputs())));
      });
    }
  }
  SUBCASE("any position: a wall across the edge has no step") {
    // The camera looks along x through the edge at 32 m, so that the cells differ in depth.
    double worst = 0;
    for (int round = 0; round < 8; ++round) {
      Camera camera = axis_camera();
      const Vec3d eye{rng.uniform(-1, 1), rng.uniform(-1, 1), 28 + rng.uniform(-0.5, 0.5)};
      camera.viewmat.translation = -eye;
      const auto at = dots(rng, camera, eye);  // depths 2 to 6 m: 30 to 34 m in z
      const GaussianCloud cloud = cloud_of(at);
      REQUIRE(cloud.origins.size() == 2);
      for_each_renderer([&](auto& renderer) {
        const auto f = renderer.render({&cloud}, camera, all_outputs());
        worst = std::max(worst, depth_error(f, camera, at, eye));
      });
    }
    MESSAGE("depth " << worst << " m");
    CHECK(worst <= 0x1p-20 + 0x1p-19 + 0x1p-22);
  }
}
