// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "backends.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

GaussianCloud sorted_scene(int degree, int count = 1500) {
  CloudOptions options;
  options.count = count;
  options.sh_degree = degree;
  GaussianCloud cloud = random_cloud(9, options);
  sort_spatially(cloud);
  return cloud;
}

const Camera kView = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 160, 120, 60);
constexpr PackLimits kAnything{1e9, 1e9, 1e9};

/// f(backend) for each that tests have.
template <class F>
void on_backends(const F& f) {
  SerialBackend serial;
  f(serial);
  ToyBackend toy;
  f(toy);
#if defined(_OPENMP)
  OpenMPBackend openmp;
  f(openmp);
#endif
}

/// Largest value of a channel of row i's chunk.
template <class Value>
long double most_in_chunk(std::size_t i, std::size_t n, const Value& value) {
  long double most = 0;
  for (std::size_t k = i / kProjectChunk * kProjectChunk;
       k < std::min(n, (i / kProjectChunk + 1) * kProjectChunk); ++k) {
    most = std::max(most, value(k));
  }
  return most;
}

}  // namespace

TEST_CASE("packed clouds: each field within its steps, which the errors report") {
  for (const int degree : {0, 1, 2, 3}) {
    CAPTURE(degree);
    const GaussianCloud full = sorted_scene(degree);
    PackErrors errors;
    const PackedCloud packed = pack_cloud(full, kAnything, &errors);
    const GaussianCloud got = unpack_cloud(packed);
    const std::size_t n = full.size(),
                      rest = 3 * static_cast<std::size_t>(sh_coefficient_count(degree) - 1);
    REQUIRE(got.size() == n);
    CHECK(errors.mean_bits == 16);
    CHECK(errors.sh_bits == 8);
    // 10 codes, 3 halves and the bands; ids of rows, chunks of 40 and 56 bytes, parts of 56.
    CHECK(packed.bytes() == n * (20 + 6 + rest + 4) + (n + 255) / 256 * (40 + 56) + (n + 63) / 64 * 56);
    PackErrors seen;
    for (std::size_t i = 0; i < n; ++i) {
      long double moved = 0, largest = 0, change = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const long double is = got.means[k][i], was = full.means[k][i];
        const long double low =
            -most_in_chunk(i, n, [&](std::size_t r) { return -1.0L * full.means[k][r] + 1000; }) + 1000;
        const long double high =
            most_in_chunk(i, n, [&](std::size_t r) { return 1.0L * full.means[k][r] + 1000; }) - 1000;
        REQUIRE(std::fabs(is - was) <=
                (high - low) / 131070 + 1e-6L * (std::fabs(low) + std::fabs(high)));
        moved += (is - was) * (is - was);
        const long double s = full.scales[k][i], t = got.scales[k][i];
        const long double most = most_in_chunk(i, n, [&](std::size_t r) {
          return 1.0L * std::max({full.scales[0][r], full.scales[1][r], full.scales[2][r]});
        });
        REQUIRE(std::fabs(std::sqrt(s) - std::sqrt(t)) <= std::sqrt(most) * (0.5L / 65535 + 2e-7L));
        largest = std::max(largest, s);
        change = std::max(change, std::fabs(s - t));
        const long double colour = full.sh0[3 * i + k];
        REQUIRE(std::fabs(got.sh0[3 * i + k] - colour) <= std::max(std::fabs(colour) / 2048, 0x1p-25L));
      }
      long double dot = 0, length = 0, other = 0, apart = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        dot += 1.0L * got.quats[k][i] * full.quats[k][i];
        length += 1.0L * got.quats[k][i] * got.quats[k][i];
        other += 1.0L * full.quats[k][i] * full.quats[k][i];
      }
      REQUIRE(std::fabs(length - 1) < 1e-6L);
      for (std::size_t k = 0; k < 4; ++k) {
        const long double d = got.quats[k][i] / std::sqrt(length) -
                              std::copysign(full.quats[k][i] / std::sqrt(other), dot * full.quats[k][i]);
        apart += d * d;
      }
      // Half a step of 4.3e-5 in each of three parts; the fourth follows with at most three times
      // theirs.
      const long double angle = 4 * std::asin(std::sqrt(apart) / 2);
      REQUIRE(angle < 1.6e-4L);
      seen.rotation = std::max(seen.rotation, static_cast<double>(angle));
      REQUIRE(std::fabs(1.0L * got.opacities[i] - full.opacities[i]) <= 1 / 131070.0L + 6e-8L);
      seen.mean = std::max(seen.mean, static_cast<double>(std::sqrt(moved)));
      seen.mean_deviations =
          std::max(seen.mean_deviations, static_cast<double>(std::sqrt(moved) / largest));
      seen.scale = std::max(seen.scale, static_cast<double>(change / largest));
      for (std::size_t k = 0; k < rest; ++k) {
        const std::size_t from = k < 9 ? 0 : k < 24 ? 9 : 24, to = k < 9 ? 9 : k < 24 ? 24 : 45;
        const long double most = most_in_chunk(i, n, [&](std::size_t r) {
          long double m = 0;
          for (std::size_t j = from; j < std::min(to, rest); ++j)
            m = std::max(m, std::fabs(1.0L * full.shN[rest * r + j]));
          return m;
        });
        const long double error = std::fabs(1.0L * got.shN[rest * i + k] - full.shN[rest * i + k]);
        REQUIRE(error <= most / 254 + 1e-6L * most);
        seen.sh = std::max(seen.sh, static_cast<double>(error));
      }
    }
    CHECK(errors.mean == doctest::Approx(seen.mean).epsilon(1e-4));
    CHECK(errors.mean_deviations == doctest::Approx(seen.mean_deviations).epsilon(1e-4));
    CHECK(errors.scale == doctest::Approx(seen.scale).epsilon(1e-4));
    CHECK(errors.sh == doctest::Approx(seen.sh).epsilon(1e-4));
    CHECK(errors.rotation ==
          doctest::Approx(seen.rotation).epsilon(1e-2));  // of floats, not quite of unit length
    CHECK(errors.opacity < 7.7e-6);
  }
}

TEST_CASE("packed clouds: images of what the codes stand for, bit for bit") {
  for (const int degree : {0, 1, 2, 3}) {
    CAPTURE(degree);
    const GaussianCloud full = sorted_scene(degree);
    const PackLimits limits[] = {
        kAnything, {1e9, 0, 1e9}, {0, 0, 0}};  // 8, 16 and 32 bits of SH; means as floats
    for (const PackLimits& limit : limits) {
      PackErrors errors;
      const PackedCloud packed = pack_cloud(full, limit, &errors);
      CHECK(errors.mean_bits == (limit.mean > 0 ? 16 : 32));
      CHECK(errors.sh_bits == (limit.sh > 0 || degree == 0 ? 8 : limit.sh_max > 0 ? 16 : 32));
      const GaussianCloud floats = unpack_cloud(packed);
      if (limit.mean == 0) CHECK(floats.means == full.means);
      if (errors.sh_bits == 32) CHECK(floats.shN == full.shN);
      CHECK(floats.chunk_bounds.size() == full.chunk_bounds.size());
      CHECK(floats.row_ids == full.row_ids);
      on_backends([&](auto& backend) {
        using B = std::decay_t<decltype(backend)>;
        const GaussianArrays<B> a(backend, packed), b(backend, floats);
        const auto got = render<float>(backend, {a.set()}, kView),
                   want = render<float>(backend, {b.set()}, kView);
        CHECK(got.stats[0].visible > 100);
        CHECK(got.rgb == want.rgb);
        CHECK(got.median_depth == want.median_depth);
      });
      SerialBackend serial;
      const auto got = render<double>(serial, {packed.set()}, kView),
                 want = render<double>(serial, {floats.set()}, kView);
      CHECK(got.rgb == want.rgb);
    }
  }
}

TEST_CASE("packed clouds: chunks by a list are those of the floats, whatever its order") {
  const GaussianCloud full = sorted_scene(1, 3000);
  const PackedCloud packed = pack_cloud(full, kAnything);
  const GaussianCloud floats = unpack_cloud(packed);
  const std::vector<std::uint32_t> list{7, 2, 11, 0};
  on_backends([&](auto& backend) {
    const auto drawn = [&](GaussianSet set) {
      set.selection.drawn_chunks = {list.data(), list.size()};
      return render<float>(backend, {set}, kView);
    };
    const auto got = drawn(packed.set()), want = drawn(floats.set());
    CHECK(got.stats[0].visible > 50);
    CHECK(got.stats[0].visible == want.stats[0].visible);
    CHECK(got.rgb == want.rgb);
    CHECK(got.median_depth == want.median_depth);
  });
}

TEST_CASE("packed clouds: far places, large and needle-like Gaussians, a last chunk that is not full") {
  // A scene from -300 to 300 m is of many origins; shapes from flat to needles of 1e4 : 1.
  GaussianCloudBuilder builder(1);
  Rng rng(4);
  std::vector<float> bands(9, 0.1f);
  for (int n = 0; n < 1000; ++n) {
    RawGaussian g;
    g.mean = {rng.uniform(-300, 300), rng.uniform(-20, 20), rng.uniform(2, 300)};
    g.quat = {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)};
    g.log_scales = {rng.uniform(-7, 2), rng.uniform(-7, 2), n % 7 == 0 ? -INFINITY : rng.uniform(-7, 2)};
    g.opacity_logit = rng.uniform(-5, 9);
    g.sh0 = {0.5f, -0.25f, 1.0f};
    g.shN = bands.data();
    builder.add(g);
  }
  GaussianCloud full = std::move(builder.cloud());
  sort_spatially(full);
  REQUIRE(full.size() % kProjectChunk != 0);
  REQUIRE(full.origins.size() > 10);
  const PackedCloud packed = pack_cloud(full, kAnything);
  const GaussianCloud floats = unpack_cloud(packed);
  // What is flat stays flat, and bounds hold what the codes stand for.
  for (std::size_t i = 0; i < full.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (full.scales[k][i] == 0) CHECK(floats.scales[k][i] == 0);
    }
    const ChunkBounds& bounds = packed.rest.chunk_bounds[i / kProjectChunk];
    for (int k = 0; k < 3; ++k) {
      REQUIRE(floats.mean(i)[k] >= bounds.low[k]);
      REQUIRE(floats.mean(i)[k] <= bounds.high[k]);
      REQUIRE(floats.scales[static_cast<std::size_t>(k)][i] <= bounds.scale_max);
      const ChunkBounds& part = packed.rest.part_bounds[i / kChunkPart];
      REQUIRE(floats.mean(i)[k] >= part.low[k]);
      REQUIRE(floats.mean(i)[k] <= part.high[k]);
      REQUIRE(floats.scales[static_cast<std::size_t>(k)][i] <= part.scale_max);
    }
  }
  on_backends([&](auto& backend) {
    using B = std::decay_t<decltype(backend)>;
    const GaussianArrays<B> packed_arrays(backend, packed), float_arrays(backend, floats);
    const auto got = render<float>(backend, {packed_arrays.set()}, kView);
    const auto want = render<float>(backend, {float_arrays.set()}, kView);
    CHECK(got.stats[0].visible > 20);
    CHECK(got.rgb == want.rgb);
  });
}

TEST_CASE("packed clouds: the image stays within a bound of the cloud's own") {
  const GaussianCloud full = sorted_scene(3, 4000);
  PackErrors errors;
  const PackedCloud packed = pack_cloud(full, {}, &errors);
  SerialBackend serial;
  const auto got = render<double>(serial, {packed.set()}, kView),
             want = render<double>(serial, {full.set()}, kView);
  double squares = 0;
  for (std::size_t i = 0; i < got.rgb.size(); ++i) squares += std::pow(got.rgb[i] - want.rgb[i], 2);
  const double psnr = -10 * std::log10(squares / static_cast<double>(got.rgb.size()));
  CAPTURE(psnr);
  CHECK(psnr > 60);  // as docs/reference/formats.md says
}

TEST_CASE("packed clouds: planes that do not fit are named") {
  const PackedCloud packed = pack_cloud(sorted_scene(1), kAnything);
  const auto refused = [&](auto change, const char* part) {
    GaussianSet set = packed.set();
    change(set.gaussians);
    const Status s = validate(set);
    CAPTURE(s.message());
    CHECK(s.code() == Errc::invalid_argument);
    CHECK(s.message().find(part) != std::string::npos);
  };
  CHECK(validate(packed.set()).ok());
  refused([](GaussianRows& v) { --v.shape.codes.size; }, "shape.codes");
  refused([](GaussianRows& v) { v.shape.codes.size = 7 * v.size(); }, "shape.codes");
  refused([](GaussianRows& v) { --v.shape.chunks.size; }, "shape.chunks");
  refused([](GaussianRows& v) { --v.color.sh0_half.size; }, "color.sh0_half");
  refused([](GaussianRows& v) { v.color.shN_codes.size -= 3; }, "color.shN_codes");
  refused([](GaussianRows& v) { --v.color.chunks.size; }, "color.chunks");
  refused([](GaussianRows& v) { v.color.shN_codes = {}; }, "color.shN has 0");
  refused([](GaussianRows& v) { v.color.sh0_half = {}; }, "color.shN_codes (without sh0_half)");
  refused([](GaussianRows& v) { v.shape.codes = {}; }, "shape.means");
  const PackedCloud none = pack_cloud(GaussianCloud{});
  CHECK(none.size() == 0);
  CHECK(validate(none.set()).ok());
  CHECK(unpack_cloud(none).size() == 0);
}
