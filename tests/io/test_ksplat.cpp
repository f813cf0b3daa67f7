// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

#include "allocations.hpp"
#include "check_quantised.hpp"
#include "check_refused.hpp"
#include "gsnav/detail/io/ksplat.hpp"
#include "gsnav/io/scene_file.hpp"
#include "ksplat_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::vector<PlyRow> ksplat_rows(std::size_t n, int degree, unsigned seed) {
  const int rest = KsplatFile::rest(degree);
  std::vector<PlyRow> rows = random_rows(n, rest, seed);
  for (PlyRow& row : rows) {  // what the format holds
    for (const char* name : {"f_dc_0", "f_dc_1", "f_dc_2"}) row[name] = std::tanh(row[name]);
    for (int k = 0; k < rest; ++k) {
      double& v = row["f_rest_" + std::to_string(k)];
      v = std::clamp(v, -0.9, 0.9);
    }
  }
  return rows;
}

KsplatFile small_ksplat(int level, int degree = 1) {
  KsplatFile file;
  file.level = level;
  file.sections = {{degree, ksplat_rows(6, degree, 51), 0}};
  return file;
}

void check_ksplat_fails(const std::string& text, Errc code, const std::string& part) {
  check_refused(io::parse_ksplat(bytes_of(text), "some.ksplat"), code, "some.ksplat", part);
}

template <class T>
std::string with(std::string text, std::size_t at, T value) {
  KsplatFile::set(text, at, value);
  return text;
}

constexpr std::size_t kSection = KsplatFile::kHeader;  // offset of the first section's header

}  // namespace

TEST_CASE("ksplat: every field within half a step of what was packed") {
  for (const int level : {0, 1, 2}) {
    for (const int degree : {0, 1, 2, 3}) {
      CAPTURE(level);
      CAPTURE(degree);
      KsplatFile file;
      file.level = level;
      file.rest_low = degree == 2 ? -1.0f : 0.0f;
      file.rest_high = degree == 2 ? 1.25f : 0.0f;
      file.sections = {{degree, ksplat_rows(30, degree, 52), 3}, {0, ksplat_rows(8, 0, 53), 0}};
      const LoadedCloud loaded = io::parse_ksplat(bytes_of(file.text()), "some.ksplat").value();
      check_consistent(loaded);
      REQUIRE(loaded.cloud.size() == 38);
      REQUIRE(loaded.cloud.sh_degree == degree);
      CHECK(loaded.report.warnings.empty());
      QuantisedBounds b;
      b.colour.fill(0.5 / 255);
      b.opacity = 0.5 / 255;
      if (level > 0) {
        b.mean.fill(32.0 / 32767 / 2);
        b.log_scale.fill(1.0 / 2047);
        b.quat = 1.0 / 2048;
        b.rest = level == 1 ? 1.0 / 2048 : (degree == 2 ? 2.25 : 3.0) / 255 / 2;
      }
      for (std::size_t i = 0; i < 30; ++i) {
        check_quantised(loaded.cloud, i, file.sections[0].rows[i], KsplatFile::rest(degree), b);
      }
      // The second section has no bands: they are zero.
      for (std::size_t i = 0; i < 8; ++i) {
        PlyRow row = file.sections[1].rows[i];
        for (int k = 0; k < KsplatFile::rest(degree); ++k) row["f_rest_" + std::to_string(k)] = 0;
        b.rest = 0;
        check_quantised(loaded.cloud, 30 + i, row, KsplatFile::rest(degree), b);
      }
    }
  }
}

TEST_CASE("ksplat: cut off anywhere") {
  for (const int level : {0, 1, 2}) {
    const std::string text = small_ksplat(level).text();
    for (std::size_t n = 0; n < text.size(); n += n < 4000 ? 500 : n < 6000 ? 50 : 1) {
      REQUIRE(io::parse_ksplat(bytes_of(text.substr(0, n)), "a.ksplat").code() == Errc::invalid_file);
    }
  }
}

TEST_CASE("ksplat: counts are not trusted with memory") {
  const std::string text = small_ksplat(1).text();
  for (const std::uint32_t count : {7u, 100000u, 0x7fffffffu, 0xffffffffu}) {
    const std::string number = std::to_string(count);
    std::string all = with(with(text, kSection, count), 16, count);
    reset_largest_allocation();
    check_ksplat_fails(with(text, 4, count), Errc::invalid_file, number + " section headers");
    check_ksplat_fails(with(text, 16, count), Errc::invalid_file, "header's count is " + number);
    check_ksplat_fails(all, Errc::invalid_file, number + " Gaussians in room for 6");
    check_ksplat_fails(with(all, kSection + 4, count), Errc::invalid_file,
                       number + " Gaussians in 2 buckets");
    check_ksplat_fails(with(text, kSection + 12, count), Errc::invalid_file,
                       "in " + number + " buckets need");
    check_ksplat_fails(with(text, kSection + 32, count), Errc::invalid_file,
                       number + " full and 1 other");
    check_ksplat_fails(with(text, kSection + 36, count), Errc::invalid_file, "need");
    CHECK(largest_allocation() < 300000);
  }
  check_ksplat_fails(with(text, kSection + 8, 1u), Errc::invalid_file, "hold 3 of its 6");
  const std::size_t sizes = kSection + 2 * KsplatFile::kSectionHeader;
  check_ksplat_fails(with(text, sizes, 1u), Errc::invalid_file, "hold 5 of its 6");
  CHECK(io::parse_ksplat(bytes_of(with(text, sizes, 0xffffffffu)), "a.ksplat").ok());
}

TEST_CASE("ksplat: headers that make no sense") {
  const std::string text = small_ksplat(1).text();
  check_ksplat_fails("", Errc::invalid_file, "0 bytes");
  check_ksplat_fails(with(text, 0, std::uint8_t{1}), Errc::unsupported, "version 1.1");
  check_ksplat_fails(with(text, 1, std::uint8_t{0}), Errc::unsupported, "version 0.0");
  check_ksplat_fails(with(text, 20, std::uint16_t{3}), Errc::unsupported, "compression level 3");
  check_ksplat_fails(with(text, kSection + 40, std::uint16_t{4}), Errc::invalid_file,
                     "section 0: SH degree 4");
  check_ksplat_fails(with(text, kSection + 20, std::uint16_t{8}), Errc::invalid_file,
                     "8 bytes to a bucket");
  const LoadedCloud loaded = io::parse_ksplat(bytes_of(text + "stray"), "a.ksplat").value();
  REQUIRE(loaded.report.warnings.size() == 1);
  CHECK(contains(loaded.report.warnings[0], "5 stray bytes"));
}

TEST_CASE("ksplat: what is no drawable Gaussian is counted") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::string text = small_ksplat(1).text();
  const auto load = [](const std::string& t) {
    LoadedCloud loaded = io::parse_ksplat(bytes_of(t), "a.ksplat").value();
    check_consistent(loaded);
    return loaded.report;
  };
  CHECK(load(with(text, kSection + 16, nan)).dropped_non_finite == 6);
  const std::size_t centres = kSection + 2 * KsplatFile::kSectionHeader + 4;
  CHECK(load(with(text, centres, nan)).dropped_non_finite == 4);  // of the first bucket
  const std::size_t record = centres + 24;
  CHECK(load(with(text, record + 6, std::uint16_t{0xbc00})).dropped_non_finite == 1);  // scale -1
  CHECK(load(with(text, record + 6, std::uint16_t{0})).kept == 6);                     // flat
  CHECK(load(with(text, record + 12, std::uint64_t{0})).dropped_zero_quat == 1);
  CHECK(load(with(text, record + 23, std::uint8_t{0})).dropped_transparent == 1);
  CHECK(load(with(small_ksplat(2).text(), 36, nan)).dropped_non_finite == 6);
}

TEST_CASE("ksplat: from a file, by its extension") {
  TempFolder folder("ksplat");
  write_file(folder / "a.ksplat", small_ksplat(2).text());
  CHECK(io::load_ksplat(folder / "a.ksplat").value().cloud.size() == 6);
  CHECK(io::load_scene((folder / "a.ksplat").string()).value().cloud.size() == 6);
  CHECK(io::load_ksplat(folder / "none.ksplat").code() == Errc::file_not_found);
}
