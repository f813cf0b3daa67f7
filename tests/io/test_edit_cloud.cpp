// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>

#include "check_cloud.hpp"
#include "check_turned.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "row_clouds.hpp"
#include "support/compiled_frames.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::vector<double> image_of(const GaussianCloud& cloud, const Similarity& asset,
                             const Similarity& camera) {
  SerialBackend backend;
  BasicRenderer<double, SerialBackend> renderer(backend);
  const Vec3d eye = camera * Vec3d{2, -3, -14}, target = camera * Vec3d{0.3, 0.2, 0};
  const Camera view = Camera::look_at(eye, target, rotate(camera.rotation, {0.1, -1, 0.2}), 48, 40, 70);
  return renderer.render(cloud.set(asset), view).value().rgb;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

const Similarity kMoves[] = {{{0.5, 0.5, -0.5, 0.5}, {1, -2, 30}, 1},
                             {{0.1, -0.7, 0.5, 0.4998}, {-4, 0.5, 2}, 1},
                             {{0, 1, 0, 0}, {}, 1.75},
                             {{0.9, 0.1, 0.3, -0.3}, {1e5, 20, -3e5}, 0.6}};

}  // namespace

TEST_CASE("transform: means, covariances and colours move as a solid body") {
  for (int degree = 0; degree <= 3; ++degree) {
    const GaussianCloud before = cloud_of_random_rows(40, degree, 81);
    for (Similarity by : kMoves) {
      normalize(by.rotation);
      GaussianCloud after = before;
      transform(after, by);
      check_turned(before, after, by);
    }
  }
}

TEST_CASE("transform: a turned scene before a turned camera is the same image") {
  const GaussianCloud before = cloud_of_random_rows(200, 3, 82);
  const std::vector<double> want = image_of(before, {}, {});
  double sum = 0;
  for (const double v : want) sum += v;
  REQUIRE(sum > 100);  // there is something to see
  for (Similarity by : kMoves) {
    normalize(by.rotation);
    GaussianCloud after = before;
    transform(after, by);
    // float32 offsets from the lattice: 4e-6 m, some 1e-5 of a pixel.
    CHECK(largest_difference(image_of(after, {}, by), want) < 2e-4);
    CHECK(largest_difference(image_of(before, by, by), want) < 2e-4);
    // Without its bands turned the image is another one.
    GaussianCloud naive = after;
    naive.shN = before.shN;
    CHECK(largest_difference(image_of(naive, {}, by), want) > 0.02);
  }
}

TEST_CASE("transform: there and back") {
  const GaussianCloud before = cloud_of_random_rows(100, 3, 83);
  GaussianCloud cloud = before;
  sort_spatially(cloud);
  Similarity by{{0.1, -0.7, 0.5, 0.4998}, {-4, 0.5, 2}, 3};
  normalize(by.rotation);
  transform(cloud, by);
  CHECK(cloud.chunk_bounds.empty());
  transform(cloud, inverse(by));
  CHECK(cloud.origins.empty());
  for (std::size_t k = 0; k < cloud.shN.size(); ++k) {
    const std::size_t row = cloud.row_ids[k / 45];
    REQUIRE(std::fabs(cloud.shN[k] - before.shN[45 * row + k % 45]) < 2e-6f);
  }
}

TEST_CASE("crop and filter_rows keep whole rows, in their order") {
  GaussianCloud cloud = cloud_of_random_rows(500, 2, 84);
  cloud.means[0][7] = 60;  // a second origin would be needed beyond 32 m; this stays in the first
  const GaussianCloud before = cloud;
  Aabb<double> box;
  box.add(Vec3d{-4, -3, -10});
  box.add(Vec3d{5, 4, 10});
  crop(cloud, box);
  std::size_t at = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Vec3d m = before.mean(i);
    if (m.x < -4 || m.x > 5 || m.y < -3 || m.y > 4 || m.z < -10 || m.z > 10) continue;
    REQUIRE(at < cloud.size());
    CHECK(cloud.mean(at) == m);
    CHECK(cloud.opacities[at] == before.opacities[i]);
    CHECK(cloud.quats[3][at] == before.quats[3][i]);
    CHECK(cloud.shN[24 * at + 23] == before.shN[24 * i + 23]);
    ++at;
  }
  CHECK(at == cloud.size());
  CHECK(at > 100);
  CHECK(cloud.shN.size() == 24 * at);
  filter_rows(cloud, [](std::size_t) { return false; });
  CHECK(cloud.size() == 0);
  CHECK(cloud.shN.empty());
}

TEST_CASE("limit_sh_degree keeps the bands below") {
  const GaussianCloud before = cloud_of_random_rows(20, 3, 85);
  for (int degree = 0; degree <= 3; ++degree) {
    GaussianCloud cloud = before;
    limit_sh_degree(cloud, degree);
    CHECK(cloud.sh_degree == degree);
    const std::size_t rest = 3 * static_cast<std::size_t>((degree + 1) * (degree + 1) - 1);
    REQUIRE(cloud.shN.size() == rest * 20);
    for (std::size_t k = 0; k < cloud.shN.size(); ++k) {
      CHECK(cloud.shN[k] == before.shN[45 * (k / rest) + k % rest]);
    }
  }
  GaussianCloud flat = cloud_of_random_rows(3, 0, 86);
  limit_sh_degree(flat, 2);
  CHECK(flat.sh_degree == 0);
}

TEST_CASE("a cloud that is mirrored and stretched is seen as in the mirror") {
  const GaussianCloud before = cloud_of(random_rows(30, 45, 91), 45);
  GaussianCloud after = before;
  // Mirrored in x, then stretched along z: the stretch leaves colours to their directions.
  Affine3<double> by;
  by.linear = Mat3d{{{-1, 0, 0}, {0, 1, 0}, {0, 0, 3}}};
  by.translation = {0, 5, 0};
  REQUIRE(transform(after, by).ok());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Vec3d m = before.mean(i);
    CHECK(norm(after.mean(i) - Vec3d{-m.x, m.y + 5, 3 * m.z}) < 1e-5 * (1 + norm(m)));
    const Mat3d c = covariance_of(before, i), got = covariance_of(after, i);
    const double size = std::fabs(c(0, 0)) + std::fabs(c(1, 1)) + 9 * std::fabs(c(2, 2));
    CHECK(std::fabs(got(0, 1) + c(0, 1)) < 1e-5 * size);
    CHECK(std::fabs(got(0, 2) + 3 * c(0, 2)) < 1e-5 * size);
    CHECK(std::fabs(got(2, 2) - 9 * c(2, 2)) < 1e-5 * size);
    for (const Vec3d& d : {Vec3d{0.6, -0.48, 0.64}, Vec3d{-0.36, 0.48, 0.8}}) {
      CHECK(norm(colour_of(after, i, {-d.x, d.y, d.z}) - colour_of(before, i, d)) < 1e-5);
    }
  }
  by.linear = Mat3d{{{1, 0, 0}, {0, 0, 0}, {0, 0, 1}}};
  CHECK(transform(after, by).code() == Errc::invalid_argument);
}
