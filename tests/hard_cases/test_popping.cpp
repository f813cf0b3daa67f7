// SPDX-License-Identifier: Apache-2.0
// N27: how much a turning camera's image jumps where Gaussians change places.
#include <doctest/doctest.h>

#include <algorithm>
#include <utility>

#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr int kFrames = 200;
constexpr double kStep = 0.01 * 3.14159265358979323846 / 180;

/// Disks and needles that pass through each other, all in view.
GaussianCloud crossing_cloud() {
  Rng rng(27);
  std::vector<RawGaussian> gs;
  for (int i = 0; i < 50; ++i) {
    RawGaussian g = gaussian({0.6 * rng.normal(), 0.4 * rng.normal(), 3 + 0.15 * rng.normal()},
                             {0.25, 0.12, 0.002}, rng.uniform(0.3, 0.95),
                             {static_cast<float>(rng.normal()), static_cast<float>(rng.normal()), 0});
    g.quat = random_rotation(rng);
    gs.push_back(g);
  }
  return cloud_of(gs);
}

Camera yawed(int frame) {
  Camera c;
  c.set_hfov(28, 21, 60);
  c.viewmat.linear = rotation_matrix(axis_angle(Vec3d{0, 1, 0}, (frame - kFrames / 2) * kStep));
  return c;
}

/// Exact response and, per pixel, exact order: blended by the depth of each Gaussian's own maximum.
std::vector<double> ordered_truth(const GaussianCloud& cloud, const Camera& camera) {
  std::vector<TruthRay> rays;
  Camera axis = camera;
  axis.viewmat = {};
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    TruthSplat t = truth_of(cloud, i);
    const Vec3d mean = camera.viewmat.linear * cloud.mean(i);
    for (int k = 0; k < 3; ++k) t.mean[k] = mean[k];
    const Quatd turn = quat_from_matrix(camera.viewmat.linear);
    const Quatd own{cloud.quats[0][i], cloud.quats[1][i], cloud.quats[2][i], cloud.quats[3][i]};
    const Quatd q = turn * own;
    t.quat[0] = q.w;
    t.quat[1] = q.x;
    t.quat[2] = q.y;
    t.quat[3] = q.z;
    rays.emplace_back(t, axis);
  }
  std::vector<double> red;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      std::vector<std::pair<Real, std::size_t>> hits;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        Real depth = 0;
        if (rays[i].alpha(x + 0.5L, y + 0.5L, &depth) * 255 >= 1) hits.emplace_back(depth, i);
      }
      std::sort(hits.begin(), hits.end());
      Real transmittance = 1, sum = 0;
      for (const auto& [depth, i] : hits) {
        const Real alpha = std::min<Real>(rays[i].alpha(x + 0.5L, y + 0.5L), 0.99L);
        sum += alpha * transmittance * std::max(0.0, 0.5 + kSh0 * static_cast<double>(cloud.sh0[3 * i]));
        transmittance *= 1 - alpha;
      }
      red.push_back(static_cast<double>(sum));
    }
  }
  return red;
}

/// Largest change between two frames in a row: of any pixel, and of the mean over the image. A swap of
/// centres moves all pixels that two Gaussians share at once; where surfaces cross, the true order
/// changes too, but along a line.
struct Steps {
  double pixel = 0, mean = 0;
  std::vector<double> last;

  void add(std::vector<double> red) {
    double largest = 0, sum = 0;
    for (std::size_t p = 0; p < last.size(); ++p) {
      largest = std::max(largest, std::abs(red[p] - last[p]));
      sum += std::abs(red[p] - last[p]);
    }
    pixel = std::max(pixel, largest);
    mean = std::max(mean, sum / static_cast<double>(red.size()));
    last = std::move(red);
  }
};

}  // namespace

TEST_CASE("N27_yaw_popping") {
  const GaussianCloud cloud = crossing_cloud();
  Steps truth;
  for (int frame = 0; frame < kFrames; ++frame) truth.add(ordered_truth(cloud, yawed(frame)));
  MESSAGE("exact response and order: largest step of a pixel " << truth.pixel << ", of the image's mean "
                                                               << truth.mean);
  for_each_renderer([&](auto& renderer) {
    for (const Response response : {Response::ewa, Response::ray}) {
      RenderConfig config;
      config.outputs = kRgb;
      config.response = response;
      Steps steps;
      for (int frame = 0; frame < kFrames; ++frame) {
        const auto f = renderer.render({&cloud}, yawed(frame), config);
        std::vector<double> red;
        for (std::size_t p = 0; p < f.rgb.size(); p += 3) red.push_back(static_cast<double>(f.rgb[p]));
        steps.add(std::move(red));
      }
      MESSAGE(renderer.name() << (response == Response::ewa ? ", ewa" : ", ray")
                              << ", order of centres, over the exact order: a pixel "
                              << steps.pixel - truth.pixel << ", the mean " << steps.mean - truth.mean);
      CHECK(steps.pixel < truth.pixel + 4.0 / 255);
      CHECK(steps.mean < truth.mean + 0.25 / 255);
    }
  });
}
