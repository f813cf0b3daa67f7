// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "allocations.hpp"
#include "check_cloud.hpp"
#include "check_refused.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "spz_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

SpzFile small_spz(int degree = 0) {
  SpzFile file;
  file.degree = degree;
  file.rows = random_rows(5, file.rest(), 41);
  return file;
}

void check_spz_fails(const std::string& text, Errc code, const std::string& part) {
  check_refused(io::parse_spz(bytes_of(text), "some.spz"), code, "some.spz", part);
}

std::string bytes4(std::uint32_t v) {
  std::string out;
  put(out, v);
  return out;
}

}  // namespace

TEST_CASE("spz: cut off anywhere, as it is and before it was compressed") {
  for (const std::uint32_t version : {1u, 2u, 3u}) {
    SpzFile file = small_spz(1);
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
  std::string text = small_spz().text();
  text[text.size() - 6] = static_cast<char>(text[text.size() - 6] ^ 1);
  check_spz_fails(text, Errc::invalid_file, "does not end well");
}

TEST_CASE("spz: headers that make no sense") {
  check_spz_fails("", Errc::invalid_file, "no gzip stream");
  check_spz_fails("no gzip at all", Errc::invalid_file, "no gzip stream");
  check_spz_fails(gzip("short"), Errc::invalid_file, "no gzip stream");
  std::string payload = small_spz().payload();
  payload[0] = 'M';
  check_spz_fails(gzip(payload), Errc::invalid_file, "SPZ's header");
  for (const std::uint32_t version : {0u, 4u, 0xffffffffu}) {
    SpzFile file = small_spz();
    file.version = version;
    check_spz_fails(gzip(file.payload()), Errc::unsupported,
                    "version " + std::to_string(version) + " in gzip");
  }
  for (const std::uint32_t version : {0u, 3u, 5u, 0xffffffffu}) {
    SpzFile file = small_spz();
    file.version = version;
    check_spz_fails(file.plain(), Errc::unsupported,
                    "version " + std::to_string(version) + " without gzip");
  }
  payload = small_spz().payload();
  payload[12] = 5;
  check_spz_fails(gzip(payload), Errc::invalid_file, "SH degree 5");
  payload[12] = 0;
  payload[13] = 31;
  check_spz_fails(gzip(payload), Errc::invalid_file, "31 fractional bits");
}

TEST_CASE("spz: a count in the header is not trusted with memory") {
  for (const std::uint32_t count : {6u, 2000u, 100000u, 0x7fffffffu, 0xffffffffu}) {
    SpzFile file = small_spz(3);
    file.count = bytes4(count);
    reset_largest_allocation();
    const std::string text = file.text();
    reset_largest_allocation();
    check_spz_fails(text, Errc::invalid_file, std::to_string(count) + " Gaussians");
    CHECK(largest_allocation() < 300000);
  }
}

TEST_CASE("spz: a gzip bomb is not unpacked") {
  // A million Gaussians of zeros, which gzip takes down to one thousandth.
  std::string payload = "NGSP" + bytes4(3) + bytes4(1000000) + std::string("\0\x0c\0\0", 4);
  payload += std::string(20000000, '\0');
  const std::string text = gzip(payload);
  reset_largest_allocation();
  check_spz_fails(text, Errc::invalid_file, "implausible");
  CHECK(largest_allocation() < 300000);
  // The same behind the Gaussians: read as far as 256 KiB.
  const std::string tail = gzip(small_spz().payload() + std::string(20000000, '\0'));
  reset_largest_allocation();
  check_spz_fails(tail, Errc::invalid_file, "does not end well");
  CHECK(largest_allocation() < 300000);
}

TEST_CASE("spz: extensions and stray bytes are told") {
  SpzFile file = small_spz();
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
  SpzFile file = small_spz();
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

namespace {

SpzFile small_v4(int degree = 1) {
  SpzFile file = small_spz(degree);
  file.version = 4;
  return file;
}

std::string with(std::string text, std::size_t at, const std::string& bytes) {
  return text.replace(at, bytes.size(), bytes);
}

std::string bytes8(std::uint64_t v) {
  std::string out;
  put(out, v);
  return out;
}

}  // namespace

TEST_CASE("spz 4: cut off anywhere") {
  const std::string text = small_v4().text();
  for (std::size_t n = 0; n < text.size(); ++n) {
    REQUIRE(io::parse_spz(bytes_of(text.substr(0, n)), "some.spz").code() == Errc::invalid_file);
  }
}

TEST_CASE("spz 4: a table that makes no sense") {
  const std::string text = small_v4().text();
  check_spz_fails(with(text, 15, "\5"), Errc::invalid_file, "5 streams, must be 6 for SH degree 1");
  check_spz_fails(with(small_v4(0).text(), 15, "\6"), Errc::invalid_file, "6 streams, must be 5");
  for (const std::uint32_t toc : {0u, 31u, static_cast<std::uint32_t>(text.size()), 0xffffffffu}) {
    check_spz_fails(with(text, 16, bytes4(toc)), Errc::invalid_file,
                    "begins at byte " + std::to_string(toc));
  }
  for (const std::uint64_t size : {std::uint64_t{44}, std::uint64_t{46}, ~std::uint64_t{0}}) {
    check_spz_fails(small_v4().plain("", {size}), Errc::invalid_file,
                    "positions has " + std::to_string(size) + " bytes unpacked, 5 Gaussians need 45");
  }
  for (const std::uint64_t size : {std::uint64_t{text.size()}, ~std::uint64_t{0}}) {
    check_spz_fails(with(text, 32, bytes8(size)), Errc::invalid_file,
                    "positions has " + std::to_string(size) + " bytes, ");
  }
}

TEST_CASE("spz 4: a stream that holds something else") {
  SpzFile file = small_v4();
  const std::string text = file.text();
  const std::size_t first = 32 + 6 * 16;
  check_spz_fails(with(text, first, "XXXX"), Errc::invalid_file,
                  "stream of positions cannot be unpacked");
  // Streams of fewer and of more bytes than the table says.
  for (const std::size_t rows : {4u, 6u}) {
    SpzFile other = file;
    other.rows = random_rows(rows, file.rest(), 41);
    const std::string from = other.text();
    const std::uint64_t sizes[] = {45, 5, 15, 15, 20, 45};
    std::string mixed = from;
    mixed.replace(8, 4, bytes4(5));
    for (std::size_t k = 0; k < 6; ++k) mixed.replace(32 + 16 * k + 8, 8, bytes8(sizes[k]));
    check_spz_fails(mixed, Errc::invalid_file, "stream of SH bands");  // the first to be unpacked
  }
}

TEST_CASE("spz 4: neither count nor streams are trusted with memory") {
  for (const std::uint32_t count : {0x7fffffffu, 0xffffffffu}) {
    SpzFile file = small_v4(3);
    file.count = bytes4(count);
    const std::uint64_t n = count;
    const std::string text = file.plain("", {9 * n, n, 3 * n, 3 * n, 4 * n, 45 * n});
    reset_largest_allocation();
    check_spz_fails(text, Errc::invalid_file, "implausible");
    CHECK(largest_allocation() < 300000);
  }
  // A million Gaussians of zeros, which zstd takes down to some hundred bytes each plane.
  SpzFile bomb = small_v4(0);
  bomb.rows.clear();
  std::string toc, streams;
  for (const std::size_t width : {9u, 1u, 3u, 3u, 4u}) {
    const std::string packed = zstd(std::string(width * 1000000, '\0'));
    toc += bytes8(packed.size()) + bytes8(width * 1000000);
    streams += packed;
  }
  bomb.count = bytes4(1000000);
  const std::string text = bomb.head(5) + bytes4(32) + std::string(12, '\0') + toc + streams;
  reset_largest_allocation();
  check_spz_fails(text, Errc::invalid_file, "implausible");
  CHECK(largest_allocation() < 300000);
}

TEST_CASE("spz 4: extensions and stray bytes are told") {
  SpzFile file = small_v4();
  const std::string stray = file.plain() + "stray";
  const LoadedCloud a = io::parse_spz(bytes_of(stray), "a.spz").value();
  CHECK(a.cloud.size() == 5);
  REQUIRE(a.report.warnings.size() == 1);
  CHECK(contains(a.report.warnings[0], "stray bytes follow the 5 Gaussians"));
  file.flags = 2;
  const std::string known = bytes4(0xadbe0003) + bytes4(4) + bytes4(5);
  const std::string text = file.plain(bytes4(7) + bytes4(3) + "abc" + known);
  const LoadedCloud b = io::parse_spz(bytes_of(text), "a.spz").value();
  CHECK(b.cloud.size() == 5);
  REQUIRE(b.report.warnings.size() == 2);
  CHECK(contains(b.report.warnings[0], "extensions"));
  CHECK(contains(b.report.warnings[1], "other axes"));
  check_spz_fails(file.plain(bytes4(7) + bytes4(4) + "abc"), Errc::invalid_file,
                  "an extension of 4 bytes, 3");
}
