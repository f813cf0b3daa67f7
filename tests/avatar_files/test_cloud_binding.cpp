// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/rigging/cloud_binding.hpp"

using namespace gsnav;

namespace {

/// A strip of squares along x from 0 to 2, on a chain of three joints, weights linear in x between them.
SkinnedMesh strip() {
  SkinnedMesh m;
  m.skeleton.names = {"a", "b", "c"};
  m.skeleton.parents = {-1, 0, 1};
  m.skeleton.rest_local.resize(3);
  m.skeleton.rest_local[1].translation = m.skeleton.rest_local[2].translation = {1, 0, 0};
  m.influences = 2;
  for (int i = 0; i <= 20; ++i) {
    for (int k = 0; k < 2; ++k) {
      const double x = 0.1 * i;
      m.positions.push_back({x, 0, 0.1 * k});
      const std::uint16_t first = x < 1 ? 0 : 1;
      m.joint_indices.insert(m.joint_indices.end(), {first, static_cast<std::uint16_t>(first + 1)});
      const float w = static_cast<float>(x - first);
      m.weights.insert(m.weights.end(), {1 - w, w});
    }
    if (i == 20) continue;
    const auto v = static_cast<std::uint32_t>(2 * i);
    m.triangles.push_back({v, v + 1, v + 2});
    m.triangles.push_back({v + 1, v + 3, v + 2});
  }
  return m;
}

}  // namespace

TEST_CASE("the nearest point of a surface is that of brute force") {
  const SkinnedMesh m = strip();
  const detail::NearestTriangle nearest(m);
  Rng rng(3);
  for (int i = 0; i < 2000; ++i) {
    const double far = i % 10 == 0 ? 20 : 0.3;
    const Vec3d p{rng.uniform(-0.2, 2.2), rng.uniform(-far, far), rng.uniform(-0.2, 0.3)};
    double found = 0;
    nearest.find(p, found);
    // The strip is a rectangle.
    const Vec3d q{std::clamp(p.x, 0.0, 2.0), 0, std::clamp(p.z, 0.0, 0.1)};
    CHECK(found == doctest::Approx(norm(p - q)).epsilon(1e-9));
  }
}

TEST_CASE("Gaussians around a body take the weights of the surface below them, in metres") {
  const SkinnedMesh m = strip();
  GaussianCloudBuilder builder(1);
  RawGaussian g;
  Rng rng(4);
  std::vector<float> sh(9, 0.25f);
  g.shN = sh.data();
  g.opacity_logit = 1.0;
  g.log_scales = {std::log(0.02), std::log(0.01), std::log(0.001)};
  const Similarity mesh_from_cloud{{}, {1, 0.5, 0}, 0.4};
  for (int i = 0; i < 500; ++i) {
    const Vec3d p{rng.uniform(0, 2), rng.uniform(-0.04, 0.04) + (i % 50 == 0 ? 1 : 0),
                  rng.uniform(0, 0.1)};
    g.mean = inverse(mesh_from_cloud) * p;
    builder.add(g);
  }
  CloudBindingOptions options;
  options.mesh_from_cloud = mesh_from_cloud;
  const BoundCloud bound = bind_cloud(builder.cloud(), m, options).value();
  CHECK(bound.left_out == 10);
  CHECK(bound.asset.size() == 490);
  CHECK(bound.furthest < 0.0401);
  for (std::size_t i = 0; i < bound.asset.size(); ++i) {
    const double x = bound.asset.cloud.mean(i).x;
    double along = 0;
    for (std::size_t k = 4 * i; k < 4 * i + 4; ++k)
      along += weight_of_parts(bound.asset.skinning_weights[k]) * bound.asset.joint_indices[k];
    CHECK(std::abs(along - x) < 1e-4);
    CHECK(bound.asset.cloud.scales[0][i] == doctest::Approx(0.008));
    CHECK(bound.asset.cloud.shN[9 * i] == 0.25f);
  }
  options.mesh_from_cloud.rotation = axis_angle(Vec3d{0, 1, 0}, 0.5);
  CHECK(bind_cloud(builder.cloud(), m, options).code() == Errc::unsupported);
  options.mesh_from_cloud = {{}, {100, 0, 0}, 1};
  CHECK(bind_cloud(builder.cloud(), m, options).message().find("no Gaussian lies within") !=
        std::string::npos);
  options.furthest = 0;
  CHECK(bind_cloud(builder.cloud(), m, options).message().find("furthest") != std::string::npos);
  options.mesh_from_cloud.scale = 0;
  CHECK(bind_cloud(builder.cloud(), m, options).message().find("mesh_from_cloud") != std::string::npos);
}
