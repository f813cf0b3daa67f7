// SPDX-License-Identifier: Apache-2.0
// Moment matching and its cost, against mixtures, quadrature and sampling.
#include <doctest/doctest.h>

#include <cmath>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/scene/lod_merge.hpp"
#include "gsnav/math/quat.hpp"

using namespace gsnav;

namespace {

LodGaussian random_gaussian(Rng& rng) {
  LodGaussian g;
  Quatd q{rng.normal(), rng.normal(), rng.normal(), rng.normal()};
  normalize(q);
  const Mat3d r = rotation_matrix(q);
  for (int k = 0; k < 3; ++k) {
    const double s = std::exp(0.7 * rng.normal());
    g.covariance.add_outer(r.column(k), s * s);
    g.mean[k] = rng.normal();
    g.color[k] = rng.uniform();
  }
  g.normal = r.column(2);
  g.flatness = 0;
  g.mass = rng.uniform(0.1, 2.0);
  return g;
}

LodGaussian ball(double x, double sigma) {
  LodGaussian g;
  g.mean = {x, 0, 0};
  g.covariance = {sigma * sigma, 0, 0, sigma * sigma, 0, sigma * sigma};
  g.mass = 1;
  g.color = {0.2, 0.5, 0.8};
  g.normal = {0, 0, 1};
  return g;
}

}  // namespace

TEST_CASE("lod merge: mean and covariance are the mixture's, mass is the sum") {
  Rng rng(1);
  for (int run = 0; run < 200; ++run) {
    const LodGaussian a = random_gaussian(rng), b = random_gaussian(rng);
    const LodGaussian m = moment_match(a, b);
    CHECK(m.mass == doctest::Approx(a.mass + b.mass).epsilon(1e-14));
    // Raw moments add up: E[x] and E[x x^T].
    const Mat3d ca = a.covariance.matrix(), cb = b.covariance.matrix(), cm = m.covariance.matrix();
    for (int i = 0; i < 3; ++i) {
      CHECK(std::abs(m.mass * m.mean[i] - a.mass * a.mean[i] - b.mass * b.mean[i]) < 1e-12);
      CHECK(std::abs(m.mass * m.color[i] - a.mass * a.color[i] - b.mass * b.color[i]) < 1e-12);
      for (int j = 0; j < 3; ++j) {
        const double raw =
            a.mass * (ca(i, j) + a.mean[i] * a.mean[j]) + b.mass * (cb(i, j) + b.mean[i] * b.mean[j]);
        CHECK(std::abs(m.mass * (cm(i, j) + m.mean[i] * m.mean[j]) - raw) < 1e-11);
      }
    }
  }
}

TEST_CASE("lod merge: area is the mean square of the projected areas over directions") {
  Rng rng(2);
  const LodGaussian g = random_gaussian(rng);
  const Mat3d c = g.covariance.matrix();
  double sum = 0;
  constexpr int kDirections = 200000;
  for (int i = 0; i < kDirections; ++i) {
    Vec3d n{rng.normal(), rng.normal(), rng.normal()};
    n = n * (1 / norm(n));
    const Vec3d any = std::abs(n.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    Vec3d u = cross(n, any);
    u = u * (1 / norm(u));
    const Vec3d v = cross(n, u);
    const double uu = dot(u, c * u), vv = dot(v, c * v), uv = dot(u, c * v);
    sum += uu * vv - uv * uv;  // determinant of the projection along n: its area over pi, squared
  }
  CHECK(lod_area(g.covariance) == doctest::Approx(std::sqrt(3 * sum / kDirections)).epsilon(0.01));
}

TEST_CASE("lod merge: the density of a difference is the integral of the product") {
  Rng rng(3);
  for (int run = 0; run < 5; ++run) {
    const LodGaussian a = random_gaussian(rng), b = random_gaussian(rng);
    const double blur = 0.3;
    // The mean of b's blurred density over samples of a's: int N_a N_b.
    const Mat3d c = b.covariance.matrix();
    LodGaussian wide = b;
    wide.covariance.xx += blur;
    wide.covariance.yy += blur;
    wide.covariance.zz += blur;
    const Mat3d w = wide.covariance.matrix();
    const double det = determinant(w);
    const Vec3d r0 = cross(w.row[1], w.row[2]) * (1 / det), r1 = cross(w.row[2], w.row[0]) * (1 / det),
                r2 = cross(w.row[0], w.row[1]) * (1 / det);
    // Cholesky of a's covariance.
    const Sym3& s = a.covariance;
    const double l00 = std::sqrt(s.xx), l10 = s.xy / l00, l20 = s.xz / l00,
                 l11 = std::sqrt(s.yy - l10 * l10), l21 = (s.yz - l20 * l10) / l11,
                 l22 = std::sqrt(s.zz - l20 * l20 - l21 * l21);
    double sum = 0;
    constexpr int kSamples = 400000;
    for (int i = 0; i < kSamples; ++i) {
      const double x = rng.normal(), y = rng.normal(), z = rng.normal();
      const Vec3d d = a.mean + Vec3d{l00 * x, l10 * x + l11 * y, l20 * x + l21 * y + l22 * z} - b.mean;
      sum += std::exp(-0.5 * dot(d, Vec3d{dot(r0, d), dot(r1, d), dot(r2, d)}));
    }
    const double density = sum / kSamples / std::sqrt(std::pow(6.283185307179586, 3) * det);
    CHECK(c(0, 0) > 0);
    CHECK(density_product(a, b, blur) == doctest::Approx(density).epsilon(0.02));
  }
}

TEST_CASE("lod merge: two equal blobs cost what the survey measured (N68)") {
  const double d[] = {0.25, 0.5, 0.75, 1.0, 1.5, 2.0};
  for (const double x : d) {
    CAPTURE(x);
    const LodGaussian a = ball(0, 1), b = ball(x, 1);
    // By quadrature along the line that they lie on; across it nothing differs but a common factor.
    const double wide = 1 + x * x / 4;
    double off = 0, all = 0;
    for (double t = -12; t < 14; t += 1e-3) {
      const double both = std::exp(-t * t / 2) + std::exp(-(t - x) * (t - x) / 2);
      const double one = 2 / std::sqrt(wide) * std::exp(-(t - x / 2) * (t - x / 2) / (2 * wide));
      off += (both - one) * (both - one);
      all += both * both;
    }
    const double energy = 1 + dot(a.color, a.color);
    const double pair = 2 * energy * (density_product(a, a, 0) + density_product(a, b, 0));
    CHECK(std::sqrt(merge_cost(a, b, 0) / pair) == doctest::Approx(std::sqrt(off / all)).epsilon(1e-4));
  }
  // 1.1 % at one sigma, 4.6 % at 1.5, 11 % at 2.
  const auto relative = [](double x) {
    const LodGaussian a = ball(0, 1), b = ball(x, 1);
    const double energy = 1 + dot(a.color, a.color);
    return std::sqrt(merge_cost(a, b, 0) /
                     (2 * energy * (density_product(a, a, 0) + density_product(a, b, 0))));
  };
  CHECK(relative(1.0) == doctest::Approx(0.011).epsilon(0.1));
  CHECK(relative(1.5) == doctest::Approx(0.046).epsilon(0.1));
  CHECK(relative(2.0) == doctest::Approx(0.11).epsilon(0.1));
}

TEST_CASE("lod merge: faces that look different ways cost more") {
  LodGaussian a = ball(0, 1), b = ball(1, 1);
  a.flatness = b.flatness = 0.9;
  const double along = merge_cost(a, b, 0.1);
  b.normal = {1, 0, 0};
  CHECK(merge_cost(a, b, 0.1) > along);
}

TEST_CASE("lod merge: two discs that cover one another let through what they do together") {
  Rng rng(4);
  for (int run = 0; run < 20; ++run) {
    // In the plane z = 0, turned in it; alpha = opacity exp(-q / 2).
    LodGaussian g[2];
    double opacity[2], sx[2], sy[2], turn[2];
    for (int k = 0; k < 2; ++k) {
      opacity[k] = rng.uniform(0.1, 0.95);
      sx[k] = rng.uniform(0.5, 1.5);
      sy[k] = rng.uniform(0.5, 1.5);
      turn[k] = rng.uniform(0, 3);
      const Vec3d along{std::cos(turn[k]), std::sin(turn[k]), 0}, across{-along.y, along.x, 0};
      g[k].mean = {rng.uniform(-1, 1), rng.uniform(-1, 1), 0.3 * k};
      g[k].covariance.add_outer(along, sx[k] * sx[k]);
      g[k].covariance.add_outer(across, sy[k] * sy[k]);
      g[k].normal = {0, 0, 1};
      g[k].mass = opacity[k] * sx[k] * sy[k];
    }
    double covered = 0;
    const double step = 0.02;
    for (double x = -9; x < 9; x += step) {
      for (double y = -9; y < 9; y += step) {
        double through = 1;
        for (int k = 0; k < 2; ++k) {
          const double dx = x - g[k].mean.x, dy = y - g[k].mean.y;
          const double u = (std::cos(turn[k]) * dx + std::sin(turn[k]) * dy) / sx[k];
          const double v = (-std::sin(turn[k]) * dx + std::cos(turn[k]) * dy) / sy[k];
          through *= 1 - opacity[k] * std::exp(-0.5 * (u * u + v * v));
        }
        covered += (1 - through) * step * step;
      }
    }
    CHECK(merged(g[0], g[1]).mass * 6.283185307179586 == doctest::Approx(covered).epsilon(1e-5));
  }
}
