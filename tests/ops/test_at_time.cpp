// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>

#include "backends.hpp"
#include "gsnav/detail/scene/temporal_gaussians.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Random Gaussians with random motion around the time 0; every seventh is always there.
TemporalCloud random_scene(std::uint64_t seed, int count, double speed = 0.3) {
  TemporalCloud scene;
  CloudOptions options;
  options.count = count;
  scene.cloud = random_cloud(seed, options);
  Rng rng(seed + 1);
  for (std::size_t i = 0; i < scene.size(); ++i) {
    scene.times.push_back(static_cast<float>(rng.normal()));
    scene.sigmas.push_back(i % 7 == 0 ? std::numeric_limits<float>::infinity()
                                      : static_cast<float>(rng.uniform(0, 1)));
    for (auto& plane : scene.motion) plane.push_back(static_cast<float>(speed * rng.normal()));
  }
  return scene;
}

struct Expected {
  std::array<long double, 3> offset{};
  long double opacity = 0;
  Expected(const TemporalCloud& s, std::size_t i, double t) {
    const long double dt = static_cast<long double>(t) - static_cast<long double>(s.times[i]);
    const long double sigma = static_cast<long double>(s.sigmas[i]);
    opacity = static_cast<long double>(s.cloud.opacities[i]);
    if (std::isfinite(sigma)) opacity *= std::exp(-dt * dt / (2 * (sigma * sigma + 1e-8L)));
    for (std::size_t k = 0; k < 3; ++k) {
      const auto part = [&](std::size_t m) { return static_cast<long double>(s.motion[3 * m + k][i]); };
      offset[k] = part(0) * dt + part(1) * dt * dt / 2 + part(2) * dt * dt * dt / 6;
    }
  }
};

/// Every mean and opacity, relative to the size of what is summed.
template <class S, class B>
void check_state(B& backend, double relative) {
  const TemporalCloud scene = random_scene(3, 1000);
  Moment<B> moment(backend);
  for (const double t : {-3.0, 0.0, 0.25, 2.0}) {
    REQUIRE(gaussians_at<S>(backend, scene.view(), t, moment).ok());
    REQUIRE(backend.synchronize().ok());
    std::size_t drawn = 0;
    for (std::size_t i = 0; i < scene.size(); ++i) {
      const Expected want(scene, i, t);
      if (std::fabs(want.opacity - 1 / 255.0L) < 1e-7L) continue;
      const bool seen = want.opacity >= 1 / 255.0L;
      drawn += seen ? 1 : 0;
      const double opacity = static_cast<double>(moment.opacities.data()[i]);
      if (!seen) {
        CHECK(opacity == 0);
        continue;
      }
      CHECK(std::fabs(opacity - static_cast<double>(want.opacity)) < 20 * relative);
      for (std::size_t k = 0; k < 3; ++k) {
        const long double mean = static_cast<long double>(scene.cloud.means[k][i]) + want.offset[k];
        const double size = 8 + std::fabs(t * t * t);
        CHECK(std::fabs(static_cast<double>(moment.means[k].data()[i]) - static_cast<double>(mean)) <
              relative * size);
      }
    }
    CHECK(drawn > 100);
    CHECK(drawn < scene.size());
  }
}

}  // namespace

TEST_CASE(
    "at_time: means and opacities by the formulas in long double, in every scalar and on every "
    "backend") {
  SerialBackend serial;
  check_state<float>(serial, 3e-7);
  check_state<double>(serial, 1.2e-7);  // the planes written are float
#if defined(_OPENMP)
  OpenMPBackend openmp(3);
  check_state<float>(openmp, 3e-7);
#endif
  ToyBackend toy;
  check_state<float>(toy, 3e-7);
}

TEST_CASE("at_time: backends and numbers of threads agree on every bit") {
  const TemporalCloud scene = random_scene(4, 3000);
  SerialBackend serial;
  Moment<SerialBackend> want(serial);
  REQUIRE(gaussians_at<float>(serial, scene.view(), 0.3, want).ok());
#if defined(_OPENMP)
  for (const int threads : {1, 4}) {
    OpenMPBackend openmp(threads);
    Moment<OpenMPBackend> got(openmp);
    REQUIRE(gaussians_at<float>(openmp, scene.view(), 0.3, got).ok());
    for (std::size_t i = 0; i < scene.size(); ++i) {
      REQUIRE(got.opacities.data()[i] == want.opacities.data()[i]);
      for (std::size_t k = 0; k < 3; ++k) REQUIRE(got.means[k].data()[i] == want.means[k].data()[i]);
    }
  }
#endif
}

TEST_CASE("at_time: far from its time nothing is drawn and nothing overflows") {
  TemporalCloud scene = random_scene(5, 300, 1e30);
  SerialBackend serial;
  Moment<SerialBackend> moment(serial);
  for (const double t : {1e9, -1e30, 1e300}) {
    REQUIRE(gaussians_at<float>(serial, scene.view(), t, moment).ok());
    for (std::size_t i = 0; i < scene.size(); ++i) {
      if (!std::isfinite(scene.sigmas[i])) continue;
      CHECK(moment.opacities.data()[i] == 0);
      CHECK(moment.means[0].data()[i] == scene.cloud.means[0][i]);
    }
  }
}

TEST_CASE(
    "at_time: a scene in uniform motion is the standing one before a camera that moves against it") {
  TemporalCloud scene = random_scene(6, 600);
  stand_still(scene);
  const Vec3d velocity{0.25, -0.125, 0.5};
  for (std::size_t k = 0; k < 3; ++k) {
    scene.motion[k].assign(scene.size(), static_cast<float>(velocity[static_cast<int>(k)]));
  }
  sort_spatially(scene);
  const double t = 2;
  const Camera still = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 160, 120, 70);
  const Camera against =
      Camera::look_at(Vec3d{} - velocity * t, Vec3d{0, 0, 4} - velocity * t, {0, -1, 0}, 160, 120, 70);
  const auto check = [&](auto& backend) {
    using B = std::decay_t<decltype(backend)>;
    TemporalGaussians<B> moving(backend, scene);
    REQUIRE(moving.set_time(t).ok());
    const auto got = render<float>(backend, {moving.set()}, still);
    const GaussianArrays<B> whole(backend, scene.cloud);
    const auto want = render<float>(backend, {whole.set()}, against);
    CHECK(got.stats[0].visible > 100);
    CHECK(image_error(got.rgb, want.rgb, 3).psnr > 90);
  };
  SerialBackend serial;
  check(serial);
#if defined(_OPENMP)
  OpenMPBackend openmp;
  check(openmp);
#endif
}

TEST_CASE("at_time: a moment drawn by its chunks is the moment as a cloud of its own") {
  TemporalCloud scene = random_scene(7, 2000, 1.0);
  sort_spatially(scene);
  const Camera camera = Camera::look_at({0, 0, 0}, {0.5, 0, 4}, {0, -1, 0}, 160, 120, 40);
  SerialBackend serial;
  TemporalGaussians<SerialBackend> moving(serial, scene);
  for (const double t : {-0.5, 0.75}) {
    REQUIRE(moving.set_time(t).ok());
    const GaussianRows v = moving.set().gaussians;
    REQUIRE(v.chunk_bounds.size == v.chunk_count());
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (!(v.shape.opacities[i] > 0)) continue;
      const ChunkBounds& b = v.chunk_bounds[i / kProjectChunk];
      const double x = static_cast<double>(v.shape.means[0][i]);
      CHECK((x >= b.low.x && x <= b.high.x && v.shape.opacities[i] <= b.opacity_max));
    }
    const GaussianCloud cloud = cloud_at(scene, t);
    const auto got = render<float>(serial, {moving.set()}, camera),
               want = render<float>(serial, {cloud.set()}, camera);
    CHECK(got.stats[0].visible == want.stats[0].visible);
    CHECK(image_error(got.rgb, want.rgb, 3).psnr > 90);  // that one was computed in double
  }
}

TEST_CASE("at_time: arrays that do not fit, and times that are none, are named") {
  const TemporalCloud scene = random_scene(8, 20);
  SerialBackend serial;
  Moment<SerialBackend> moment(serial);
  const auto message = [&](auto change) {
    TemporalCloud bad = scene;
    change(bad);
    const Status s = gaussians_at<float>(serial, bad.view(), 0, moment);
    CHECK(s.code() == Errc::invalid_argument);
    return s.message();
  };
  CHECK(message([](TemporalCloud& s) { s.times.pop_back(); }).find("times has 19") != std::string::npos);
  CHECK(message([](TemporalCloud& s) { s.sigmas.clear(); }).find("sigmas has 0") != std::string::npos);
  CHECK(message([](TemporalCloud& s) { s.motion[4].clear(); }).find("motion has 0") !=
        std::string::npos);
  CHECK_FALSE(
      gaussians_at<float>(serial, scene.view(), std::numeric_limits<double>::quiet_NaN(), moment).ok());
}
