// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <limits>

#include "allocations.hpp"
#include "check_quantised.hpp"
#include "check_refused.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "ply_compressed_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

CompressedPlyFile small_packed(int rest = 0, std::size_t n = 5) {
  CompressedPlyFile file;
  file.rest = rest;
  file.rows = random_rows(n, rest, 12);
  return file;
}

LoadedCloud parse_packed(const std::string& text) {
  return io::parse_ply(bytes_of(text), "some.compressed.ply").value();
}

void check_packed_fails(const std::string& text, Errc code, const std::string& part) {
  check_refused(io::parse_ply(bytes_of(text), "some.ply"), code, "some.ply", part);
}

}  // namespace

TEST_CASE("compressed ply: every field within half a step of what was packed") {
  for (const bool ranges : {true, false}) {
    for (const int rest : {0, 9, 24, 45, 72}) {
      CAPTURE(ranges);
      CAPTURE(rest);
      CompressedPlyFile file = small_packed(rest, 300);  // a whole chunk and a part of one
      file.colour_ranges = ranges;
      if (!ranges) {
        for (PlyRow& row : file.rows) {  // [0, 1] is all that such a file can hold
          for (const char* name : {"f_dc_0", "f_dc_1", "f_dc_2"}) row[name] = std::tanh(row[name]);
        }
      }
      const LoadedCloud loaded = parse_packed(file.text());
      check_consistent(loaded);
      REQUIRE(loaded.cloud.size() == 300);
      CHECK(loaded.cloud.sh_degree == (rest == 72 ? 3 : static_cast<int>(std::sqrt(rest / 3 + 1)) - 1));
      CHECK(loaded.cloud.filter == Filter::classic);
      CHECK(loaded.report.warnings.size() == (rest == 72 ? 1 : 0));
      for (std::size_t i = 0; i < 300; ++i) {
        const auto bounds = file.bounds(i / CompressedPlyFile::kChunk);
        const auto half_step = [&](std::size_t k, int bits) {
          return static_cast<double>(bounds[k][1] - bounds[k][0]) / (std::exp2(bits) - 1) / 2;
        };
        QuantisedBounds b;
        b.mean = {half_step(0, 11), half_step(1, 10), half_step(2, 11)};
        b.log_scale = {half_step(3, 11), half_step(4, 10), half_step(5, 11)};
        b.colour = {half_step(6, 8), half_step(7, 8), half_step(8, 8)};
        if (!ranges) b.colour.fill(0.5 / 255);
        b.quat = std::sqrt(2.0) / 1023 / 2;
        b.opacity = 0.5 / 255;
        b.rest = 8.0 / 256 / 2;
        check_quantised(loaded.cloud, i, file.rows[i], rest, b);
      }
    }
  }
}

TEST_CASE("compressed ply: bytes of sh, the outer ends of their range") {
  CompressedPlyFile file = small_packed(9, 1);
  std::string text = file.text();
  const std::string bytes("\x00\xff\x80\x7f\x01\xfe\x40\xc0\x00", 9);
  text.replace(text.size() - 9, 9, bytes);
  const GaussianCloud c = parse_packed(text).cloud;
  // f_rest_0, 3 and 6 are red, green and blue of the first coefficient.
  const float want[] = {-4.0f,     -0.015625f, -1.984375f, 4.0f, -3.953125f,
                        2.015625f, 0.015625f,  3.953125f,  -4.0f};
  for (std::size_t k = 0; k < 9; ++k) CHECK(c.shN[k] == want[k]);
}

TEST_CASE("compressed ply: comments, stray bytes, extra elements, other orders") {
  CompressedPlyFile file = small_packed();
  file.comments = "comment SplatRenderMode: mip\n";
  file.after_rows = "stray";
  const LoadedCloud loaded = parse_packed(file.text());
  CHECK(loaded.cloud.filter == Filter::mip);
  REQUIRE(loaded.report.warnings.size() == 1);
  CHECK(contains(loaded.report.warnings[0], "5 stray bytes"));
  CHECK(loaded.report.source == "some.compressed.ply");

  const std::string plain = small_packed().text(), header = small_packed().header();
  const std::string extra =
      replaced(header, "element vertex", "element face 3\nproperty short a\nelement vertex");
  const std::size_t chunk = 18 * 4;
  const std::string moved =
      extra + plain.substr(header.size(), chunk) + "aabbcc" + plain.substr(header.size() + chunk);
  const LoadedCloud a = parse_packed(plain), b = parse_packed(moved);
  REQUIRE(b.cloud.size() == 5);
  CHECK(a.cloud.means == b.cloud.means);
  CHECK(a.cloud.quats == b.cloud.quats);
}

TEST_CASE("compressed ply: what is no drawable Gaussian is counted") {
  CompressedPlyFile file = small_packed(0, 300);
  file.rows[7]["opacity"] = -9;  // packs to 0
  std::string text = file.text();
  CHECK(parse_packed(text).report.dropped_transparent == 1);
  // The first chunk's min_x: all of its Gaussians have no place.
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(text.data() + file.header().size(), &nan, sizeof nan);
  const LoadedCloud loaded = parse_packed(text);
  check_consistent(loaded);
  CHECK(loaded.report.dropped_non_finite == 256);
  CHECK(loaded.cloud.size() == 44);
  // Its max_scale_x, beyond the contract's range.
  text = file.text();
  const float huge = 50;
  std::memcpy(text.data() + file.header().size() + 9 * sizeof huge, &huge, sizeof huge);
  CHECK(parse_packed(text).report.clamped_scales > 10);
  CHECK(parse_packed(small_packed(0, 0).text()).cloud.size() == 0);
}

TEST_CASE("compressed ply: cut off anywhere") {
  const CompressedPlyFile file = small_packed(9);
  const std::string text = file.text();
  for (std::size_t n = 0; n < text.size(); ++n) {
    const auto result = io::parse_ply(bytes_of(text.substr(0, n)), "some.ply");
    REQUIRE(result.code() == Errc::invalid_file);
    if (n < file.header().size()) continue;
    REQUIRE(contains(result.message(), n < file.header().size() + 72 ? "'chunk' promises 1 rows, 0"
                                       : n < text.size() - 45        ? "'vertex' promises 5 rows, "
                                                                     : "'sh' promises 5 rows, "));
  }
}

TEST_CASE("compressed ply: counts are not trusted with memory, and must fit each other") {
  for (const char* count : {"1000000000", "18446744073709551615", "9223372036854775807"}) {
    CompressedPlyFile file = small_packed(45);
    file.vertex_count = count;
    reset_largest_allocation();
    check_packed_fails(file.text(), Errc::invalid_file, std::string("'vertex' promises ") + count);
    file.chunk_count = count;
    check_packed_fails(file.text(), Errc::invalid_file, std::string("'chunk' promises ") + count);
    file = small_packed(45);
    file.sh_count = count;
    check_packed_fails(file.text(), Errc::invalid_file, std::string("'sh' promises ") + count);
    CHECK(largest_allocation() < 300000);
  }
  CompressedPlyFile file = small_packed();
  file.chunk_count = "0";
  check_packed_fails(file.text(), Errc::invalid_file, "'chunk' has 0 rows, which do not fit the 5");
  file = small_packed(9);
  file.sh_count = "4";
  check_packed_fails(file.text(), Errc::invalid_file, "'sh' has 4 rows, 'vertex' has 5");
}

TEST_CASE("compressed ply: properties that are missing or of another type") {
  const std::string text = small_packed(9).text();
  for (const char* name : {"min_x", "max_scale_z", "min_g", "max_b", "packed_scale", "packed_color"}) {
    check_packed_fails(replaced(text, std::string(name) + "\n", "other\n"), Errc::invalid_file,
                       std::string("no property '") + name + "'");
  }
  check_packed_fails(replaced(text, "f_rest_4\n", "f_rest_9\n"), Errc::invalid_file,
                     "no property 'f_rest_4'");
  check_packed_fails(replaced(text, "property uchar f_rest_8\n", ""), Errc::invalid_file,
                     "8 properties");
  check_packed_fails(replaced(text, "uint packed_scale", "float packed_scale"), Errc::invalid_file,
                     "must be uint");
  check_packed_fails(replaced(text, "float max_y", "int max_y"), Errc::invalid_file, "must be float");
  check_packed_fails(replaced(text, "uchar f_rest_3", "char f_rest_3"), Errc::invalid_file,
                     "must be uchar");
  check_packed_fails(replaced(text, "element chunk", "element chunks"), Errc::invalid_file,
                     "no element 'chunk'");
  check_packed_fails(replaced(text, "float max_y", "list uchar float max_y"), Errc::unsupported, "list");
  check_packed_fails(replaced(text, "little", "big"), Errc::unsupported, "binary_little_endian");
  check_packed_fails(replaced(text, "binary_little_endian", "ascii"), Errc::unsupported,
                     "binary_little_endian");
}
