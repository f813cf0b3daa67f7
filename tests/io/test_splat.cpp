// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>

#include "check_quantised.hpp"
#include "gsnav/detail/io/splat.hpp"
#include "gsnav/io/scene_file.hpp"
#include "splat_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::vector<PlyRow> splat_rows(std::size_t n) {
  std::vector<PlyRow> rows = random_rows(n, 0, 21);
  for (PlyRow& row : rows) {  // the format has no colours outside of [0, 1]
    for (const char* name : {"f_dc_0", "f_dc_1", "f_dc_2"}) row[name] = std::tanh(row[name]);
  }
  return rows;
}

LoadedCloud parse_records(const std::string& text) {
  return io::parse_splat(bytes_of(text), "some.splat").value();
}

std::string with_float(std::string text, std::size_t offset, float value) {
  std::memcpy(text.data() + offset, &value, sizeof value);
  return text;
}

}  // namespace

TEST_CASE("splat: every field within half a step of what was packed") {
  const std::vector<PlyRow> rows = splat_rows(200);
  const LoadedCloud loaded = parse_records(splat_text(rows));
  check_consistent(loaded);
  REQUIRE(loaded.cloud.size() == rows.size());
  CHECK(loaded.cloud.sh_degree == 0);
  CHECK(loaded.cloud.filter == Filter::classic);
  CHECK(loaded.report.source == "some.splat");
  QuantisedBounds b;
  b.colour.fill(0.5 / 255);
  b.opacity = 0.5 / 255;
  // A component's error is at most 1/128, where 1 becomes 255 instead of 256; unit length moves it
  // again.
  b.quat = 1.0 / 128;
  for (std::size_t i = 0; i < rows.size(); ++i) check_quantised(loaded.cloud, i, rows[i], 0, b);
}

TEST_CASE("splat: bytes that are known") {
  std::string text;
  for (const float v : {1.5f, -2.25f, 1000.0f, 0.5f, 0.0f, 2.0f}) put(text, v);
  text += std::string("\xff\x00\x80\xff\x80\xc0\x80\x40", 8);
  const GaussianCloud c = parse_records(text).cloud;
  REQUIRE(c.size() == 1);
  CHECK(c.mean(0) == Vec3d{1.5, -2.25, 1000.0});
  CHECK(c.scales[0][0] == 0.5f);
  CHECK(c.scales[1][0] == 0.0f);  // flat
  CHECK(c.scales[2][0] == doctest::Approx(2).epsilon(1e-7));
  CHECK(c.sh0[0] == doctest::Approx(1.7724539).epsilon(1e-7));
  CHECK(c.sh0[1] == doctest::Approx(-1.7724539).epsilon(1e-7));
  CHECK(c.opacities[0] == 1.0f);
  CHECK(c.quats[0][0] == 0.0f);
  CHECK(c.quats[1][0] == doctest::Approx(std::sqrt(0.5)));
  CHECK(c.quats[2][0] == 0.0f);
  CHECK(c.quats[3][0] == doctest::Approx(-std::sqrt(0.5)));
}

TEST_CASE("splat: what is no drawable Gaussian is counted") {
  const std::string text = splat_text(splat_rows(4));
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  for (const float v : {nan, inf, -inf}) {
    CHECK(parse_records(with_float(text, 0, v)).report.dropped_non_finite == 1);
  }
  for (const float v : {nan, -1.0f, -inf}) {
    CHECK(parse_records(with_float(text, 32 + 16, v)).report.dropped_non_finite == 1);
  }
  for (const float v : {inf, 1e30f, 1e-30f}) {
    CHECK(parse_records(with_float(text, 32 + 16, v)).report.clamped_scales == 1);
  }
  std::string no_quat = text;
  no_quat.replace(64 + 28, 4, "\x80\x80\x80\x80");
  CHECK(parse_records(no_quat).report.dropped_zero_quat == 1);
  std::string clear = text;
  clear[96 + 27] = '\0';
  const LoadedCloud loaded = parse_records(clear);
  CHECK(loaded.report.dropped_transparent == 1);
  check_consistent(loaded);
}

TEST_CASE("splat: cut off anywhere but between two records") {
  const std::string text = splat_text(splat_rows(3));
  for (std::size_t n = 0; n < text.size(); ++n) {
    const auto result = io::parse_splat(bytes_of(text.substr(0, n)), "some.splat");
    if (n != 0 && n % 32 == 0) {
      CHECK(result.value().cloud.size() == n / 32);
      continue;
    }
    REQUIRE(result.code() == Errc::invalid_file);
    REQUIRE(contains(result.message(), "some.splat: " + std::to_string(n) + " bytes"));
  }
}

TEST_CASE("splat: from a file, by its extension") {
  TempFolder folder("splat");
  write_file(folder / "a.SPLAT", splat_text(splat_rows(6)));
  CHECK(io::load_splat(folder / "a.SPLAT").value().cloud.size() == 6);
  CHECK(io::load_scene((folder / "a.SPLAT").string()).value().cloud.size() == 6);
  CHECK(io::load_splat(folder / "none.splat").code() == Errc::file_not_found);
}
