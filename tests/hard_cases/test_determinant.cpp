// SPDX-License-Identifier: Apache-2.0
// N03 to N06: the determinant of the 2D covariance, and the compensation made of it.
#include <doctest/doctest.h>

#include <algorithm>

#include "gsnav/math/functions.hpp"
#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/project_samples.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr double kFocal = 1000;

/// Needles of `aspect` : 1 in any direction, with a standard deviation of 10^[low, high] px.
std::vector<Sample> needles(std::size_t count, double aspect, double low, double high) {
  Rng rng(3);
  std::vector<Sample> out(count);
  for (Sample& s : out) {
    const double z = rng.uniform(2, 10);
    const double sigma = std::pow(10.0, rng.uniform(low, high)) * z / kFocal;
    s.position[0] = static_cast<float>(rng.uniform(-0.5, 0.5) * z);
    s.position[1] = static_cast<float>(rng.uniform(-0.5, 0.5) * z);
    s.position[2] = static_cast<float>(z);
    const Quatd q = random_rotation(rng);
    const double quat[4] = {q.w, q.x, q.y, q.z};
    for (int k = 0; k < 4; ++k) s.quat[k] = static_cast<float>(quat[k]);
    s.scale[0] = static_cast<float>(sigma);
    s.scale[1] = s.scale[2] = static_cast<float>(sigma / aspect);
  }
  return out;
}

/// The same needles turned to point at the camera but for 1e-5 to 1e-1 of their length, by `sines`.
std::vector<Sample> aimed_needles(std::size_t count, double aspect, std::vector<double>& sines) {
  std::vector<Sample> out = needles(count, aspect, 1, 5);
  Rng rng(33);
  for (Sample& s : out) {
    const Vec3d ray = normalized(Vec3d{s.position[0], s.position[1], s.position[2]});
    const double miss = std::pow(10.0, rng.uniform(-5, -1));
    const Vec3d axis =
        normalized(ray + normalized(cross(ray, Vec3d{rng.normal(), rng.normal(), rng.normal()})) * miss);
    const Vec3d half = normalized(axis + Vec3d{1, 0, 0});  // the half-way turn takes x to the axis
    const double quat[4] = {0, half.x, half.y, half.z};
    for (int k = 0; k < 4; ++k) s.quat[k] = static_cast<float>(quat[k]);
    sines.push_back(norm(cross(axis, ray)));
  }
  return out;
}

/// Largest relative error of det over the samples; every one must be positive.
void check_determinant(const std::vector<Sample>& samples, double bound_float, double bound_double) {
  const Camera camera = axis_camera(1024, kFocal);
  const GaussianSet set{};
  const auto truth_camera = make_projection_camera<double>(camera, set);
  for_each_lane_type([&]<class L>(const std::string& name) {
    CAPTURE(name);
    const auto results = project_samples<L>(camera, set, samples);
    double worst = 0;
    bool positive = true;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Truth2d truth = truth_project(samples[i].truth(truth_camera), camera);
      positive = positive && results[i].a > 0 && results[i].b > 0;
      worst = std::max(worst, static_cast<double>(std::abs(results[i].det() / truth.det - 1)));
    }
    CHECK(positive);
    CHECK(worst < (sizeof(scalar_of<L>) == sizeof(float) ? bound_float : bound_double));
    MESSAGE(name << ": det is off by " << worst);
  });
}

}  // namespace

TEST_CASE("N03_det_needle_1e2") {
  check_determinant(needles(sample_count(20000), 1e2, 1, 3), 2e-5, 1e-12);
}

TEST_CASE("N04_det_needle_1e4") {
  check_determinant(needles(sample_count(20000), 1e4, 1, 5), 2e-4, 1e-7);
}

TEST_CASE("N05_comp_factor_needle") {
  const auto samples = needles(sample_count(20000), 1e4, 1, 5);
  const Camera camera = axis_camera(1024, kFocal);
  GaussianSet set;
  set.filter = Filter::mip;
  const auto truth_camera = make_projection_camera<double>(camera, set);
  for_each_lane_type([&]<class L>(const std::string& name) {
    CAPTURE(name);
    const auto results = project_samples<L>(camera, set, samples);
    double worst = 0, largest = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      // Opacity is 1: what is left is the compensation.
      const double factor = std::exp2(results[i].log2_opacity);
      const Truth2d truth = truth_project(samples[i].truth(truth_camera), camera);
      worst = std::max(worst, std::abs(factor - static_cast<double>(truth.compensation())));
      largest = std::max(largest, factor);
    }
    CHECK(worst < 1e-5);
    CHECK(largest <= 1);
    MESSAGE(name << ": the compensation is off by " << worst << ", largest " << largest);
  });
}

TEST_CASE("N04_N05_needles_end_on") {
  // (r x ray) of the two short axes nearly vanishes there: its rounding, eps, is what det0 is made of.
  // So the relative error of sqrt(det0) goes as eps / sin, sin the angle between the needle and the ray,
  // down to the needle's own width. Random poses stay within the catalogue's bounds because few come
  // this close.
  const double aspect = 1e4;
  std::vector<double> sines;
  const auto samples = aimed_needles(sample_count(20000), aspect, sines);
  const Camera camera = axis_camera(1024, kFocal);
  GaussianSet set;
  set.filter = Filter::mip;
  const auto truth_camera = make_projection_camera<double>(camera, set);
  for_each_lane_type([&]<class L>(const std::string& name) {
    CAPTURE(name);
    const auto results = project_samples<L>(camera, set, samples);
    const double eps = sizeof(scalar_of<L>) == sizeof(float) ? 0x1p-24 : 0x1p-53;
    double det_scaled = 0, factor_scaled = 0, factor_worst = 0, largest = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Truth2d truth = truth_project(samples[i].truth(truth_camera), camera);
      const double sine = std::hypot(sines[i], 1 / aspect);
      const double factor = std::exp2(results[i].log2_opacity);
      const double factor_error = std::abs(factor - static_cast<double>(truth.compensation()));
      const double det_error = static_cast<double>(std::abs(results[i].det() / truth.det - 1));
      det_scaled = std::max(det_scaled, det_error * sine / eps);
      factor_scaled = std::max(factor_scaled, factor_error * sine / eps);
      factor_worst = std::max(factor_worst, factor_error);
      largest = std::max(largest, factor);
    }
    if (sizeof(scalar_of<L>) == sizeof(float)) {
      CHECK(det_scaled < 16);
      CHECK(factor_scaled < 8);
    }
    CHECK(largest <= 1);
    MESSAGE(name << ": det is off by " << det_scaled << " eps / sin, the compensation by "
                 << factor_scaled << " eps / sin, " << factor_worst << " at most");
  });
}

TEST_CASE("N06_det_flat_edge_on") {
  const Camera camera = axis_camera();
  const GaussianSet set{};
  const auto truth_camera = make_projection_camera<double>(camera, set);
  // Exactly edge-on: the flat axis across a ray along z, so det0 is 0 and det = h tr + h^2.
  std::vector<Sample> samples(1);
  samples[0].position[2] = 3;
  samples[0].scale[1] = samples[0].scale[2] = 0.2f;
  // As nearly as float quaternions go, anywhere in the image.
  Rng rng(6);
  for (std::size_t i = 0; i < sample_count(2000); ++i) {
    Sample s;
    const Vec3d mean{rng.uniform(-1, 1), rng.uniform(-1, 1), 3};
    const Vec3d normal = normalized(cross(mean, Vec3d{rng.normal(), rng.normal(), rng.normal()}));
    const Vec3d half = normalized(normal + Vec3d{0, 0, 1});  // the half-way turn takes z to the normal
    const double quat[4] = {0, half.x, half.y, half.z};
    for (int k = 0; k < 4; ++k) s.quat[k] = static_cast<float>(quat[k]);
    for (int k = 0; k < 3; ++k) s.position[k] = static_cast<float>(mean[k]);
    s.scale[0] = s.scale[1] = 0.2f;
    samples.push_back(s);
  }
  const Truth2d exact = truth_project(samples[0].truth(truth_camera), camera);
  const Real h = 0.3f;
  CHECK(exact.det0 == 0);
  CHECK(static_cast<double>(exact.det / (h * (exact.a + exact.c - 2 * h) + h * h)) ==
        doctest::Approx(1).epsilon(1e-15));
  for_each_lane_type([&]<class L>(const std::string& name) {
    CAPTURE(name);
    const auto results = project_samples<L>(camera, set, samples);
    double worst = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Truth2d truth = truth_project(samples[i].truth(truth_camera), camera);
      worst = std::max(worst, static_cast<double>(std::abs(results[i].det() / truth.det - 1)));
    }
    CHECK(static_cast<double>(std::abs(results[0].det() / exact.det - 1)) < 1e-6);
    CHECK(worst < 2e-6);
    MESSAGE(name << ": det is off by " << worst);
  });
}

TEST_CASE("N06_det_flat_edge_on in images") {
  // Those of a disk edge-on, and of points, are finite; along its plane the depth is the centre's.
  const Camera camera = axis_camera();
  RawGaussian disk = gaussian({0, 0, 3}, {0, 0.2, 0.2}, 0.9);
  const GaussianCloud cloud = cloud_of({disk, gaussian({0.5, 0.5, 3}, {2e-9, 2e-9, 2e-9}, 0.9),
                                        gaussian({-0.5, 0.5, 3}, {0, 0, 0}, 0.9)});
  render_everywhere({&cloud}, camera, all_outputs(), [&](const auto& f, const auto&) {
    CHECK(all_finite(f));
    // The disk is a vertical line of filter width; the point is the filter alone.
    CHECK(static_cast<double>(f.alpha[kAxisPixel]) == doctest::Approx(0.9).epsilon(1e-6));
    CHECK(std::abs(static_cast<double>(f.median_depth[kAxisPixel]) - 3) < 1e-6);
    CHECK(std::abs(static_cast<double>(f.expected_depth[kAxisPixel]) - 3) < 1e-6);
    const double px = 64 * (0.5 / 3) + 31.5, d = 0.5 + std::floor(px) - px;
    CHECK(static_cast<double>(f.alpha[static_cast<std::size_t>(std::floor(px)) * 64]) ==
          doctest::Approx(0.9 * std::exp(-d * d / 0.3)).epsilon(1e-5));
  });
}
