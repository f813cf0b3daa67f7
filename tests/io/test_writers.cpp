// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>

#include "check_quantised.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/splat.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "row_clouds.hpp"

// What is written is read back and compared with the rows that the cloud was made of, within half of
// the step that the format's description gives.

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Rows whose colours and SH bands every format here can hold.
std::vector<PlyRow> moderate_rows(std::size_t n, int rest, unsigned seed) {
  std::vector<PlyRow> rows = random_rows(n, rest, seed);
  for (PlyRow& row : rows) {
    for (const char* name : {"f_dc_0", "f_dc_1", "f_dc_2"}) row[name] = std::tanh(row[name]);
    for (int k = 0; k < rest; ++k) {
      double& v = row["f_rest_" + std::to_string(k)];
      v = std::clamp(v, -0.85, 0.85);
    }
  }
  return rows;
}

constexpr int kRestOfDegree[] = {0, 9, 24, 45};

}  // namespace

TEST_CASE("save_splat: every field within half a step, and again the same file") {
  TempFolder folder("save_splat");
  const std::vector<PlyRow> rows = moderate_rows(300, 9, 51);
  REQUIRE(io::save_splat(folder / "a.splat", cloud_of(rows, 9)).ok());
  CHECK(read_file(folder / "a.splat").size() == 32 * 300);
  const LoadedCloud loaded = io::load_splat(folder / "a.splat").value();
  check_consistent(loaded);
  REQUIRE(loaded.cloud.size() == 300);
  QuantisedBounds b;
  b.colour.fill(0.5 / 255);
  b.opacity = 0.5 / 255;
  b.quat = 1.0 / 128;
  for (std::size_t i = 0; i < 300; ++i) check_quantised(loaded.cloud, i, rows[i], 0, b);
  REQUIRE(io::save_splat(folder / "b.splat", loaded.cloud).ok());
  const LoadedCloud again = io::load_splat(folder / "b.splat").value();
  CHECK(again.cloud.means == loaded.cloud.means);
  CHECK(again.cloud.sh0 == loaded.cloud.sh0);
  CHECK(again.cloud.opacities == loaded.cloud.opacities);
}

TEST_CASE("save_spz: every field within half a step") {
  TempFolder folder("save_spz");
  for (int degree = 0; degree <= 3; ++degree) {
    CAPTURE(degree);
    const int rest = kRestOfDegree[degree];
    const std::vector<PlyRow> rows = moderate_rows(200, rest, 52);
    GaussianCloud cloud = cloud_of(rows, rest);
    cloud.filter = degree == 1 ? Filter::mip : Filter::classic;
    io::SaveSpzOptions options;
    options.fractional_bits = 8 + 2 * degree;
    REQUIRE(io::save_spz(folder / "a.spz", cloud, options).ok());
    const LoadedCloud loaded = io::load_spz(folder / "a.spz").value();
    check_consistent(loaded);
    REQUIRE(loaded.cloud.size() == 200);
    CHECK(loaded.cloud.sh_degree == degree);
    CHECK(loaded.cloud.filter == cloud.filter);
    CHECK(loaded.report.warnings.empty());
    QuantisedBounds b;
    b.mean.fill(std::exp2(-options.fractional_bits - 1));
    b.log_scale.fill(1.0 / 32);
    b.colour.fill(0.5 / 255 / 0.15 * 0.2820948);
    b.opacity = 0.5 / 255;
    b.quat = std::sqrt(0.5) / 511 / 2;
    b.rest = 0.5 / 128;
    for (std::size_t i = 0; i < 200; ++i) check_quantised(loaded.cloud, i, rows[i], rest, b);
    // What has been quantised once loses nothing the second time.
    REQUIRE(io::save_spz(folder / "b.spz", loaded.cloud, options).ok());
    const GaussianCloud again = io::load_spz(folder / "b.spz").value().cloud;
    CHECK(again.means == loaded.cloud.means);
    CHECK(again.scales == loaded.cloud.scales);
    CHECK(again.opacities == loaded.cloud.opacities);
    CHECK(again.sh0 == loaded.cloud.sh0);
    CHECK(again.shN == loaded.cloud.shN);
  }
}

TEST_CASE("save_spz: options") {
  TempFolder folder("save_spz_options");
  const std::vector<PlyRow> rows = moderate_rows(50, 45, 53);
  GaussianCloud cloud = cloud_of(rows, 45);
  const auto path = folder / "a.spz";
  REQUIRE(io::save_spz(path, cloud, {.sh1_bits = 5, .sh_rest_bits = 4}).ok());
  const GaussianCloud coarse = io::load_spz(path).value().cloud;
  float first = 0, rest = 0;
  for (std::size_t k = 0; k < cloud.shN.size(); ++k) {
    float& worst = k % 45 < 9 ? first : rest;
    worst = std::max(worst, std::fabs(coarse.shN[k] - cloud.shN[k]));
  }
  CHECK(first <= 1.0f / 32);
  CHECK(first > 1.0f / 40);
  CHECK(rest <= 1.0f / 16);
  CHECK(rest > 1.0f / 20);
  REQUIRE(io::save_spz(path, cloud, {.keep_axes = true}).ok());
  const GaussianCloud kept = io::load_spz(path, {.keep_axes = true}).value().cloud;
  CHECK(std::fabs(kept.mean(7).y - cloud.mean(7).y) <= 1.0 / 8192);
  CHECK(std::fabs(io::load_spz(path).value().cloud.mean(7).y + cloud.mean(7).y) <= 1.0 / 8192);
  // Far means take bits from the fraction.
  cloud = cloud_of(moderate_rows(3, 0, 54), 0);
  cloud.means[1][2] = 100000.25f;
  REQUIRE(io::save_spz(path, cloud).ok());
  CHECK(io::load_spz(path).value().cloud.mean(2).y == 100000.25);
  cloud.means[1][2] = 8.4e6f;
  CHECK(contains(io::save_spz(path, cloud).message(), "8400000"));
  cloud.means[1][2] = 0;
  CHECK(contains(io::save_spz(path, cloud, {.fractional_bits = 24}).message(), "fractional_bits is 24"));
  CHECK(contains(io::save_spz(path, cloud, {.sh1_bits = 0}).message(), "0 bits"));
}

TEST_CASE("save_compressed_ply: every field within half a step of its chunk") {
  TempFolder folder("save_compressed_ply");
  for (int degree = 0; degree <= 3; ++degree) {
    CAPTURE(degree);
    const int rest = kRestOfDegree[degree];
    std::vector<PlyRow> rows = moderate_rows(600, rest, 55);
    for (PlyRow& row : rows) row["f_dc_0"] *= 3;  // ranges of colour reach beyond [0, 1]
    GaussianCloud cloud = cloud_of(rows, rest);
    cloud.filter = degree == 2 ? Filter::mip : Filter::classic;
    REQUIRE(io::save_compressed_ply(folder / "a.compressed.ply", cloud).ok());
    const LoadedCloud loaded = io::load_ply(folder / "a.compressed.ply").value();
    check_consistent(loaded);
    REQUIRE(loaded.cloud.size() == 600);
    CHECK(loaded.cloud.sh_degree == degree);
    CHECK(loaded.cloud.filter == cloud.filter);
    CHECK(loaded.report.warnings.empty());
    for (std::size_t first = 0; first < 600; first += 256) {
      const std::size_t last = std::min<std::size_t>(600, first + 256);
      const auto range = [&](const std::string& name) {
        double low = 1e9, high = -1e9;
        for (std::size_t i = first; i < last; ++i) {
          low = std::min(low, rows[i].at(name));
          high = std::max(high, rows[i].at(name));
        }
        return high - low;
      };
      QuantisedBounds b;
      const double steps[] = {2047, 1023, 2047};
      const char* axes[] = {"x", "y", "z"};
      for (std::size_t k = 0; k < 3; ++k) {
        b.mean[k] = range(axes[k]) / steps[k] / 2;
        b.log_scale[k] = range("scale_" + std::to_string(k)) / steps[k] / 2;
        b.colour[k] = range("f_dc_" + std::to_string(k)) * 0.2820948 / 255 / 2;
      }
      b.opacity = 0.5 / 255;
      b.quat = std::sqrt(0.5) / 1023;
      b.rest = 1.0 / 64;
      for (std::size_t i = first; i < last; ++i) check_quantised(loaded.cloud, i, rows[i], rest, b);
    }
  }
}

TEST_CASE("save_compressed_ply: means far from zero lie within their chunk's bounds too") {
  TempFolder folder("save_compressed_far");
  std::vector<PlyRow> rows = moderate_rows(256, 0, 56);
  for (PlyRow& row : rows) row["x"] += 1e6;
  GaussianCloud cloud = cloud_of(rows, 0);
  double low = 1e9, high = -1e9;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    low = std::min(low, cloud.mean(i).x);
    high = std::max(high, cloud.mean(i).x);
  }
  REQUIRE(io::save_compressed_ply(folder / "a.compressed.ply", cloud).ok());
  const GaussianCloud back = io::load_ply(folder / "a.compressed.ply").value().cloud;
  REQUIRE(back.size() == cloud.size());
  // Bounds are float32, of 1/16 m there, and hold all of it.
  const double half_step = (high - low + 2 * 0.0625) / 2047 / 2;
  double worst = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    worst = std::max(worst, std::abs(back.mean(i).x - cloud.mean(i).x));
  CHECK(worst < half_step * 1.001);
}

TEST_CASE("writers: flat, opaque and nearly transparent Gaussians stay drawable") {
  TempFolder folder("save_extremes");
  std::vector<PlyRow> rows = moderate_rows(4, 0, 56);
  rows[0]["scale_1"] = -INFINITY;
  rows[1]["opacity"] = INFINITY;
  rows[2]["opacity"] = std::log(1.0 / 253);  // 1/254
  const GaussianCloud cloud = cloud_of(rows, 0);
  REQUIRE(cloud.size() == 4);
  REQUIRE(io::save_splat(folder / "a.splat", cloud).ok());
  REQUIRE(io::save_spz(folder / "a.spz", cloud).ok());
  REQUIRE(io::save_compressed_ply(folder / "a.ply", cloud).ok());
  const GaussianCloud got[] = {io::load_splat(folder / "a.splat").value().cloud,
                               io::load_spz(folder / "a.spz").value().cloud,
                               io::load_ply(folder / "a.ply").value().cloud};
  for (const GaussianCloud& c : got) {
    REQUIRE(c.size() == 4);
    CHECK(c.scales[1][0] < 1e-4f);
    CHECK(c.opacities[1] == 1.0f);
    CHECK(c.opacities[2] == doctest::Approx(1.0 / 255));
  }
}

TEST_CASE("writers: clouds and places that are wrong") {
  TempFolder folder("save_wrong");
  GaussianCloud cloud = cloud_of(moderate_rows(3, 0, 57), 0);
  const auto all = [&](const GaussianCloud& c, const std::string& base) {
    return std::array<Status, 3>{io::save_splat(folder / (base + ".splat"), c),
                                 io::save_spz(folder / (base + ".spz"), c),
                                 io::save_compressed_ply(folder / (base + ".ply"), c)};
  };
  for (const Status& s : all(cloud, "none/a")) {
    CHECK(s.code() == Errc::file_not_found);
    CHECK(contains(s.message(), "none does not exist"));
  }
  cloud.sh_degree = 1;
  for (const Status& s : all(cloud, "a")) {
    CHECK(s.code() == Errc::invalid_argument);
    CHECK(contains(s.message(), "SH degree 1"));
  }
  const GaussianCloud empty;
  CHECK(io::save_splat(folder / "e.splat", empty).code() == Errc::invalid_argument);
  REQUIRE(io::save_spz(folder / "e.spz", empty).ok());
  CHECK(io::load_spz(folder / "e.spz").value().cloud.size() == 0);
  REQUIRE(io::save_compressed_ply(folder / "e.ply", empty).ok());
  CHECK(io::load_ply(folder / "e.ply").value().cloud.size() == 0);
}
