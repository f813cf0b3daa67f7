// SPDX-License-Identifier: Apache-2.0
// Frames drawn in slices of depth, what earlier ones hide left out: it does not show.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "arrays.hpp"
#include "backends.hpp"
#include "cases.hpp"
#include "gsnav/detail/frame/cull.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "support/image_hashes.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Opaque disks facing z on a wall at depth z, far larger than the view.
GaussianCloud wall_of_gaussians(std::uint64_t seed, double z, int count) {
  Rng rng(seed);
  std::vector<RawGaussian> disks;
  for (int i = 0; i < count; ++i) {
    disks.push_back(gaussian({rng.uniform(-z, z), rng.uniform(-z, z), z + 0.01 * rng.normal()},
                             {0.06 * z, 0.06 * z, 1e-3}, 0.98, {0.3f, 0.1f, 0.2f}));
  }
  return cloud_of(disks);
}

Camera random_camera(Rng& rng) {
  const auto in = [&](double r) {
    return Vec3d{rng.uniform(-r, r), rng.uniform(-r, r), rng.uniform(-r, r)};
  };
  const Vec3d eye = in(2);
  Camera c =
      Camera::look_at(eye, eye + in(1) + Vec3d{0, 0, 1.2}, {0.1, 1, 0.05}, 75, 58, rng.uniform(30, 110));
  c.cx += rng.uniform(-20, 20);
  c.cy += rng.uniform(-20, 20);
  c.near_plane = rng.uniform() < 0.5 ? 0.02 : 0.8;
  return c;
}

}  // namespace

TEST_CASE("N65_cull_invariance of slices of depth") {
  // A room of many layers, sorted in space; a cloud without chunks of its own among it, and one that is
  // placed.
  GaussianCloud layers = random_cloud(661, {.count = 24000,
                                            .sh_degree = 1,
                                            .needle = 0.002,
                                            .scale = 0.05,
                                            .center = {0, 0, 3},
                                            .extent = 4});
  REQUIRE(append(layers, wall_of_gaussians(660, 3.0, 4000)).ok());
  const GaussianCloud room = sorted(layers);
  const GaussianCloud plain = random_cloud(662, {.count = 800, .sh_degree = 2, .needle = 0.1});
  const GaussianCloud placed = sorted(random_cloud(663, {.count = 3000, .sh_degree = 0, .scale = 0.03}));
  const Similarity place{{0.8, 0.2, -0.5, 0.26457513110645907}, {0.3, -0.2, 0.5}, 1.5};
  const std::array<unsigned, 4> outputs{kRgb, kMedianDepth, kRgb | kAlpha | kMedianDepth,
                                        kRgb | kAlpha | kAnyDepth};
  Rng rng(664);
  std::uint64_t drawn = 0, all = 0;
  for (int i = 0; i < 12; ++i) {
    const Camera camera = random_camera(rng);
    RenderConfig one;
    one.outputs = outputs[static_cast<std::size_t>(i % 4)];
    one.quality.exponential = i % 2 == 0 ? Exponential::exact : Exponential::fast;
    one.sort_order = i % 5 == 4 ? SortOrder::camera_distance : SortOrder::z_depth;
    one.tuning.tile_size = 8 << (i % 3);
    one.quality.transmittance_min = i % 3 == 0 ? 0.05 : 1e-4;
    one.tuning.depth_slices = 1;
    RenderConfig several = one;
    several.tuning.depth_slices = 2 + i % 15;
    for_each_renderer([&](auto& renderer) {
      const std::vector<Placed> scene{{&room}, {&plain}, {&placed, place}};
      const auto a = renderer.render(scene, camera, one);
      const auto b = renderer.render(scene, camera, several);
      CAPTURE(i);
      CAPTURE(renderer.name());
      CHECK(same_images(a, b));
      if (!b.stats.empty()) CHECK(b.stats[0].visible <= a.stats[0].visible);
      if (renderer.name() == "openmp float, 1 thread") {
        drawn += b.stats[0].visible;
        all += a.stats[0].visible;
      }
    });
  }
#if defined(_OPENMP)
  CHECK(drawn < all - all / 20);  // or nothing was tested
#endif
}

TEST_CASE("N65_cull_invariance behind a wall, and before it") {
  GaussianCloud scene = wall_of_gaussians(665, 2.0, 4000);
  REQUIRE(append(scene, wall_of_gaussians(666, 5.0, 6000)).ok());
  const GaussianCloud cloud = sorted(scene);
  const Camera camera = axis_camera(64, 60);
  RenderConfig config = all_outputs();
  for_each_renderer([&](auto& renderer) {
    config.tuning.depth_slices = 1;
    const auto whole = renderer.render({&cloud}, camera, config);
    for (const int n : {2, 5, 8, 16}) {
      config.tuning.depth_slices = n;
      const auto f = renderer.render({&cloud}, camera, config);
      CAPTURE(n);
      CHECK(same_images(whole, f));
      // The second wall is not touched where a backend draws in slices.
      const bool slices = renderer.name().rfind("openmp float", 0) == 0;
      if (slices) CHECK(f.stats[0].visible < whole.stats[0].visible / 2);
    }
  });
}

TEST_CASE(
    "N65_cull_invariance needs bounds that hold: no footprint or key lies outside a chunk's extent") {
  GaussianCloud cloud = random_cloud(
      667,
      {.count = 15000, .sh_degree = 0, .needle = 0.01, .scale = 0.06, .center = {0, 0, 2}, .extent = 4});
  REQUIRE(append(cloud, random_cloud(668, {.count = 3,
                                           .sh_degree = 0,
                                           .needle = 0.5,
                                           .scale = 0.8,
                                           .center = {0, 0, 0},
                                           .extent = 6}))
              .ok());
  sort_spatially(cloud);
  SerialBackend backend;
  RenderWorkspace<float, SerialBackend> ws(backend);
  Rng rng(669);
  std::size_t seen = 0;
  double area = 0, image = 0;
  for (int i = 0; i < 40; ++i) {
    const Camera camera = random_camera(rng);
    RenderConfig config;
    config.outputs = kAlpha;
    config.sort_order = i % 2 == 0 ? SortOrder::z_depth : SortOrder::camera_distance;
    const Similarity place =
        i % 3 == 0 ? Similarity{{0.8, 0.2, -0.5, 0.26457513110645907}, {0.3, -0.2, 0.5}, 2.5}
                   : Similarity{};
    const GaussianSet set = cloud.set(place);
    std::vector<float> alpha(static_cast<std::size_t>(camera.width) *
                             static_cast<std::size_t>(camera.height));
    FrameImages<float> images;
    images.alpha = alpha.data();
    REQUIRE(render_camera<float>(backend, ws, {&set, 1}, camera, config, images).ok());
    Frames<float> frame;
    frame.alpha = alpha;
    record_hashes(frame, "serial float");
    const auto c64 = make_projection_camera<double>(camera, set, projection_rules(config));
    for (std::size_t c = 0; c < cloud.chunk_bounds.size(); ++c) {
      const std::uint32_t n = ws.visible.counts.data()[c];
      if (n == 0) continue;
      const ChunkExtent e = chunk_extent(c64, cloud.chunk_bounds[c]);
      area += (std::fmin(e.x1, camera.width) - std::fmax(e.x0, 0)) *
              (std::fmin(e.y1, camera.height) - std::fmax(e.y0, 0));
      image += camera.width * camera.height;
      for (std::uint32_t k = 0; k < n; ++k) {
        const std::size_t slot = c * kProjectChunk + k;
        const SplatBounds& b = ws.bounds.data()[slot];
        const bool within = b.x0 + 0.5 >= e.x0 && b.y0 + 0.5 >= e.y0 && b.x1 - 0.5 <= e.x1 &&
                            b.y1 - 0.5 <= e.y1 &&
                            ws.visible.chunk_keys.data()[slot] >= bits_of(e.nearest);
        if (!within) CHECK(within);
        ++seen;
      }
    }
  }
  CHECK(seen > 100000);
  CHECK(area < 0.85 * image);  // or they say nothing
}

TEST_CASE("slices of depth by distance, where the viewmat is as little rigid as is allowed") {
  // Small disks a little nearer than where slices may begin: by z, and by a distance that is not quite
  // z, on different sides.
  for (const double grow : {0.0, 1e-5, 4e-4}) {
    std::vector<RawGaussian> disks;
    Rng rng(2);
    const std::uint32_t base = bits_of(0.001f);
    for (std::uint32_t k = 160; k < 300; ++k) {
      const double border = static_cast<double>(float_of_bits(base + (k << 19)));
      if (!(border > 1 && border < 60)) continue;
      const double z = border * (1 - (grow > 0 ? grow / 2 : 2e-6));
      for (int i = 0; i < 256; ++i) {
        disks.push_back(gaussian({rng.uniform(-0.01, 0.01) * z, rng.uniform(-0.01, 0.01) * z, z},
                                 {1e-4 * z, 1e-4 * z, 0}, 0.12, {0.3f, 0.1f, 0.2f}));
      }
    }
    GaussianCloud cloud = cloud_of(disks);
    bound_chunks(cloud);
    Camera camera;
    camera.set_hfov(128, 128, 2);
    camera.cx = camera.cy = 64;
    camera.viewmat.linear = camera.viewmat.linear * (1 + grow);
    RenderConfig config;
    config.sort_order = SortOrder::camera_distance;
    OpenMPBackend backend(1);
    std::vector<float> first;
    for (const int slices : {1, 4, 16}) {
      config.tuning.depth_slices = slices;
      BasicRenderer<float, OpenMPBackend> renderer(backend, config);
      const auto frame = renderer.render(cloud.set(), camera).value();
      record_hashes(frame, "openmp float, one thread");
      if (slices == 1) first = frame.rgb;
      CAPTURE(grow);
      CAPTURE(slices);
      CHECK(frame.rgb == first);
    }
  }
}
