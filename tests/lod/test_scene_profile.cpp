// SPDX-License-Identifier: Apache-2.0
// What a scene does not need: bands of zeros change no bit, bands too small to be seen no colour by more
// than they say.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/scene/drop_bands.hpp"
#include "gsnav/detail/scene/ledger.hpp"
#include "gsnav/detail/scene/scene_bands.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "support/compiled_frames.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Chunk c of the cloud gets the bands up to c % 4, all above are zero or at most `small`.
GaussianCloud banded(double small) {
  GaussianCloud cloud = random_cloud(12, {.count = 2500});
  sort_spatially(cloud);
  Rng rng(13);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::size_t kept =
        3 * static_cast<std::size_t>(sh_coefficient_count(static_cast<int>(i / kProjectChunk % 4)) - 1);
    for (std::size_t k = kept; k < 45; ++k)
      cloud.shN[45 * i + k] = static_cast<float>(small * rng.uniform(-1, 1));
  }
  return cloud;
}

}  // namespace

TEST_CASE("scene profile: bands of zeros are not read, and no bit changes") {
  const GaussianCloud cloud = banded(0);
  const SceneBands profile = scene_bands(cloud);
  REQUIRE(profile.chunk_sh_degrees.size() == 10);
  for (std::size_t c = 0; c < 10; ++c)
    CHECK(int{profile.chunk_sh_degrees[c]} == static_cast<int>(c % 4));
  CHECK(profile.color_error == 0);
  CHECK(profile.sh_numbers == 45 * cloud.size());
  CHECK(profile.sh_numbers_read < profile.sh_numbers);
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 96, 64, 70);
  const auto check = [&](auto& renderer) {
    const auto a = renderer.render(cloud.set(), camera).value();
    const auto b = renderer.render(profile.applied_to(cloud.set()), camera).value();
    CHECK(a.rgb == b.rgb);
    CHECK(a.median_depth == b.median_depth);
  };
  OpenMPBackend openmp(2);
  SerialBackend serial;
  BasicRenderer<float, OpenMPBackend> lanes(openmp);
  BasicRenderer<float, SerialBackend> one(serial);
  BasicRenderer<double, SerialBackend> reference(serial);
  check(lanes);
  check(one);
  check(reference);
}

namespace {

/// Chunk c of some 2500 Gaussians has the bands up to c % (most + 1); those above `most` are at most
/// `small` in all.
GaussianCloud banded_to(int most, double small) {
  GaussianCloud cloud = random_cloud(12, {.count = 2500});
  sort_spatially(cloud);
  Rng rng(13);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const int degree = static_cast<int>(i / kProjectChunk) % (most + 1);
    for (std::size_t k = static_cast<std::size_t>(3 * ((degree + 1) * (degree + 1) - 1)); k < 45; ++k) {
      const bool above = k >= static_cast<std::size_t>(3 * ((most + 1) * (most + 1) - 1));
      cloud.shN[45 * i + k] = above ? static_cast<float>(small * rng.uniform(-1, 1)) : 0.0f;
    }
  }
  return cloud;
}

/// Largest difference of two images.
double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double out = a.size() == b.size() ? 0 : 1e9;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    out = std::max(out, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
  return out;
}

enum class Kept { floats, halves, packed };

/// What follows from letting go of the bands above `most` of a cloud of degree 3: bytes counted one by
/// one, and images.
template <class Cloud>
void check_dropped(Cloud cloud, int most, std::size_t bytes_a_number, double unseen) {
  const Cloud whole = cloud;
  const std::size_t n = cloud.size();
  SceneBands profile = scene_bands(cloud, unseen);
  drop_bands(cloud, profile);
  const std::size_t kept = static_cast<std::size_t>(3 * ((most + 1) * (most + 1) - 1));
  const ColorRows v = cloud.view().color;
  CHECK(v.degree == most);
  CHECK(v.shN.size + v.shN_half.size + v.shN_codes.size == kept * n);
  CHECK(profile.bytes_let_go == (45 - kept) * n * bytes_a_number);
  CHECK(whole.bytes() - cloud.bytes() == profile.bytes_let_go);
  std::size_t unneeded = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const int degree = static_cast<int>(i / kProjectChunk) % (most + 1);
    unneeded +=
        bytes_a_number * (kept - static_cast<std::size_t>(3 * ((degree + 1) * (degree + 1) - 1)));
  }
  CHECK(profile.bytes_unneeded == unneeded);
  CHECK((unseen == 0) == (profile.color_error == 0));
  CHECK(profile.color_error <= unseen);
  CHECK(validate(profile.applied_to(cloud.set())).ok());
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 96, 64, 70);
  const auto check = [&](auto& renderer) {
    const auto before = renderer.render(whole.set(), camera).value();
    for (const GaussianSet& set : {cloud.set(), profile.applied_to(cloud.set())}) {
      const auto after = renderer.render(set, camera).value();
      CHECK(after.median_depth == before.median_depth);
      if (unseen == 0) CHECK(after.rgb == before.rgb);
      // A pixel's weights add up to 1 at most; a float's rounding beside what the profile says.
      if (unseen > 0) CHECK(largest_difference(after.rgb, before.rgb) <= profile.color_error + 1e-6);
    }
  };
  OpenMPBackend openmp(2);
  SerialBackend serial;
  BasicRenderer<float, OpenMPBackend> lanes(openmp);
  BasicRenderer<float, SerialBackend> one(serial);
  check(lanes);
  check(one);
}

}  // namespace

TEST_CASE("scene profile: storage follows, in floats, halves and packed") {
  for (const int most : {0, 1, 2}) {
    for (const double small : {0.0, 3e-4}) {
      for (const Kept how : {Kept::floats, Kept::halves, Kept::packed}) {
        CAPTURE(most);
        CAPTURE(small);
        CAPTURE(static_cast<int>(how));
        // In each pixel, band l of coefficients below 1e-4 is below 1e-4 (2 l + 1) / sqrt(4 pi): all
        // three below 1/1020.
        const double unseen = small > 0 ? kUnseenColor : 0;
        GaussianCloud cloud = banded_to(most, small / 3);
        if (how == Kept::packed) {
          const PackedCloud packed = pack_cloud(std::move(cloud));
          REQUIRE(packed.shN.size() == 45 * packed.size());
          check_dropped(packed, most, 1, unseen);
          continue;
        }
        if (how == Kept::halves) compact_sh(cloud);
        check_dropped(std::move(cloud), most, how == Kept::halves ? 2 : 4, unseen);
      }
    }
  }
}

TEST_CASE("scene profile: a cloud that needs its bands, or has no row, stays as it is") {
  GaussianCloud cloud = banded(0);
  const std::vector<float> before = cloud.shN;
  SceneBands profile = scene_bands(cloud);
  drop_bands(cloud, profile);
  CHECK(cloud.sh_degree == 3);
  CHECK(cloud.shN == before);
  CHECK(profile.bytes_let_go == 0);
  CHECK(profile.bytes_unneeded == 4 * (profile.sh_numbers - profile.sh_numbers_read));
  GaussianCloud none;
  none.sh_degree = 3;
  profile = scene_bands(none);
  drop_bands(none, profile);
  CHECK(profile.bytes_let_go == 0);
  CHECK(profile.bytes_unneeded == 0);
}

TEST_CASE("scene profile: what is let go is not held any more") {
  GaussianCloud cloud = banded_to(1, 0), halves = cloud;
  compact_sh(halves);
  CHECK(halves.shN.capacity() == 0);
  SceneBands profile = scene_bands(cloud);
  drop_bands(cloud, profile);
  CHECK(cloud.shN.capacity() == 9 * cloud.size());
  expand_sh(halves);
  CHECK(halves.shN_half.capacity() == 0);
}

TEST_CASE("scene profile: no colour changes by more than the bound (N69)") {
  const GaussianCloud cloud = banded(2e-4);
  const SceneBands profile = scene_bands(cloud, kUnseenColor);
  CHECK(profile.color_error > 0);
  CHECK(profile.color_error <= 1.0 / 1020);
  for (std::size_t c = 0; c < 10; ++c)
    CHECK(int{profile.chunk_sh_degrees[c]} <= static_cast<int>(c % 4));
  CHECK(scene_bands(cloud).sh_numbers_read == scene_bands(cloud).sh_numbers);
  const GaussianSet set = profile.applied_to(cloud.set());
  Rng rng(14);
  double worst = 0;
  for (int run = 0; run < 20000; ++run) {
    const std::size_t i = rng.next() % cloud.size();
    const Vec3d direction{rng.normal(), rng.normal(), rng.normal()};
    const auto all = gaussian_color<double>(set.gaussians.color, 3, i, direction);
    const auto some =
        gaussian_color<double>(set.gaussians.color, set.gaussians.color.degree_of(i, 3), i, direction);
    worst =
        std::max({worst, std::abs(all.r - some.r), std::abs(all.g - some.g), std::abs(all.b - some.b)});
  }
  CHECK(worst <= profile.color_error * (1 + 1e-9));
  CHECK(worst > 0.2 * profile.color_error);
}

TEST_CASE("scene profile: one that does not fit its set is refused") {
  const GaussianCloud cloud = banded(0);
  SceneBands profile = scene_bands(cloud);
  profile.chunk_sh_degrees.pop_back();
  CHECK(validate(profile.applied_to(cloud.set())).message().find("color.chunk_degrees") !=
        std::string::npos);
}

TEST_CASE("ledger: its counts are those of the frame") {
  const GaussianCloud cloud = banded(2e-4);
  const Camera camera = Camera::look_at({0, 0, 0}, {2, 0, 4}, {0, -1, 0}, 96, 64, 30);
  const SceneBands profile = scene_bands(cloud, kUnseenColor);
  SerialBackend backend;
  RenderConfig config;
  config.quality.exponential = Exponential::fast;
  BasicRenderer<float, SerialBackend> renderer(backend, config);
  const GaussianSet set = profile.applied_to(cloud.set());
  const auto f = renderer.render(set, camera).value();
  const FrameLedger l = frame_ledger(std::span(&set, 1), camera, config, f.stats[0], nullptr, &profile);
  CHECK(l.culled.rows == cloud.size());
  CHECK(l.visible == f.stats[0].visible);
  CHECK(l.culled.emitting > 0);
  CHECK(l.culled.emitting <= l.visible);
  CHECK(l.culled.touched >= l.visible);
  CHECK(l.culled.touched <= l.culled.rows);
  CHECK(l.sh_skipped == profile.sh_numbers - profile.sh_numbers_read);
  const std::string text = ledger_text(l);
  CHECK(text.find(std::to_string(l.sh_skipped) + " SH coefficients") != std::string::npos);
  CHECK(text.find(std::to_string(l.culled.touched) + " touched") != std::string::npos);
  CHECK(text.find("converted") == std::string::npos);
  CHECK(text.find("order:") == std::string::npos);
  // One frame has one order and one space: what asks for others is written down.
  GaussianSet linear = set;
  linear.color_space = ColorSpace::linear;
  LoadReport report;
  report.sort_order = SortOrder::camera_distance;
  const GaussianSet both[] = {set, linear};
  const FrameLedger other = frame_ledger(both, camera, config, f.stats[0], &report);
  CHECK(other.converted == cloud.size());
  CHECK(other.other_order);
  CHECK(other.culled.emitting == 2 * l.culled.emitting);
  CHECK(ledger_text(other).find("converted: the colours of " + std::to_string(cloud.size())) !=
        std::string::npos);
  CHECK(ledger_text(other).find("order: not") != std::string::npos);
  config.compat = Compat::inria;
  config.quality.key_bits = 24;
  config.quality.max_sh_degree = 1;
  const std::string rules = ledger_text(frame_ledger(both, camera, config, f.stats[0]));
  for (const char* line : {"order: by 24 bits", "SH bands above degree 1", "RenderConfig::compat"})
    CHECK(rules.find(line) != std::string::npos);
}
