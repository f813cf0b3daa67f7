// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "allocations.hpp"
#include "check_cloud.hpp"
#include "gsnav/io/spz.hpp"
#include "spz_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

SpzFile small_file(int degree = 0) {
  SpzFile file;
  file.degree = degree;
  file.rows = random_rows(5, file.rest(), 41);
  return file;
}

void check_fails(const std::string& text, Errc code, const std::string& part) {
  const auto result = io::parse_spz(bytes_of(text), "some.spz");
  CAPTURE(part);
  CAPTURE(result.message());
  CHECK(result.code() == code);
  CHECK(contains(result.message(), "some.spz"));
  CHECK(contains(result.message(), part));
}

std::string bytes4(std::uint32_t v) {
  std::string out;
  put(out, v);
  return out;
}

}  // namespace

TEST_CASE("spz: cut off anywhere, as it is and before it was compressed") {
  for (const std::uint32_t version : {1u, 2u, 3u}) {
    SpzFile file = small_file(1);
    file.version = version;
    const std::string text = file.text(), payload = file.payload();
    for (std::size_t n = 0; n < text.size(); ++n) {
      REQUIRE(io::parse_spz(bytes_of(text.substr(0, n)), "some.spz").code() == Errc::invalid_file);
    }
    for (std::size_t n = 0; n < payload.size(); ++n) {
      const auto result = io::parse_spz(bytes_of(gzip(payload.substr(0, n))), "some.spz");
      REQUIRE(result.code() == Errc::invalid_file);
      if (n >= 16) REQUIRE(contains(result.message(), std::to_string(n - 16) + " are there"));
    }
  }
}

TEST_CASE("spz: a checksum that does not fit") {
  std::string text = small_file().text();
  text[text.size() - 6] = static_cast<char>(text[text.size() - 6] ^ 1);
  check_fails(text, Errc::invalid_file, "does not end well");
}

TEST_CASE("spz: headers that make no sense") {
  check_fails("", Errc::invalid_file, "no gzip stream");
  check_fails("no gzip at all", Errc::invalid_file, "no gzip stream");
  check_fails(gzip("short"), Errc::invalid_file, "no gzip stream");
  std::string payload = small_file().payload();
  payload[0] = 'M';
  check_fails(gzip(payload), Errc::invalid_file, "SPZ's header");
  for (const std::uint32_t version : {0u, 4u, 0xffffffffu}) {
    SpzFile file = small_file();
    file.version = version;
    check_fails(file.text(), Errc::unsupported, "version " + std::to_string(version) + " in gzip");
  }
  SpzFile plain = small_file();
  plain.version = 4;
  check_fails(plain.payload(), Errc::unsupported, "version 4 without gzip");
  payload = small_file().payload();
  payload[12] = 5;
  check_fails(gzip(payload), Errc::invalid_file, "SH degree 5");
  payload[12] = 0;
  payload[13] = 31;
  check_fails(gzip(payload), Errc::invalid_file, "31 fractional bits");
}

TEST_CASE("spz: a count in the header is not trusted with memory") {
  for (const std::uint32_t count : {6u, 2000u, 100000u, 0x7fffffffu, 0xffffffffu}) {
    SpzFile file = small_file(3);
    file.count = bytes4(count);
    reset_largest_allocation();
    const std::string text = file.text();
    reset_largest_allocation();
    check_fails(text, Errc::invalid_file, std::to_string(count) + " Gaussians");
    CHECK(largest_allocation() < 300000);
  }
}

TEST_CASE("spz: a gzip bomb is not unpacked") {
  // A million Gaussians of zeros, which gzip takes down to one thousandth.
  std::string payload = "NGSP" + bytes4(3) + bytes4(1000000) + std::string("\0\x0c\0\0", 4);
  payload += std::string(20000000, '\0');
  const std::string text = gzip(payload);
  reset_largest_allocation();
  check_fails(text, Errc::invalid_file, "not believed");
  CHECK(largest_allocation() < 300000);
  // The same behind the Gaussians: read as far as 256 KiB.
  const std::string tail = gzip(small_file().payload() + std::string(20000000, '\0'));
  reset_largest_allocation();
  check_fails(tail, Errc::invalid_file, "does not end well");
  CHECK(largest_allocation() < 300000);
}

TEST_CASE("spz: extensions and stray bytes are told") {
  SpzFile file = small_file();
  const std::string stray = gzip(file.payload() + "stray");
  const LoadedCloud a = io::parse_spz(bytes_of(stray), "a.spz").value();
  CHECK(a.cloud.size() == 5);
  REQUIRE(a.report.warnings.size() == 1);
  CHECK(contains(a.report.warnings[0], "stray bytes follow the 5 Gaussians"));
  file.flags = 2;
  const std::string extended = gzip(file.payload() + "some extension");
  const LoadedCloud b = io::parse_spz(bytes_of(extended), "a.spz").value();
  CHECK(b.cloud.size() == 5);
  REQUIRE(b.report.warnings.size() == 1);
  CHECK(contains(b.report.warnings[0], "extensions"));
}

TEST_CASE("spz: what is no drawable Gaussian is counted") {
  SpzFile file = small_file();
  file.rows[3]["opacity"] = -9;
  CHECK(io::parse_spz(bytes_of(file.text()), "a.spz").value().report.dropped_transparent == 1);
  file.version = 1;
  std::string payload = file.payload();
  payload.replace(16, 4, std::string("\x00\x7e\x00\xfc", 4));  // NaN, minus infinity
  const LoadedCloud loaded = io::parse_spz(bytes_of(gzip(payload)), "a.spz").value();
  check_consistent(loaded);
  CHECK(loaded.report.dropped_non_finite == 1);
  file.rows.clear();
  CHECK(io::parse_spz(bytes_of(file.text()), "a.spz").value().cloud.size() == 0);
}
