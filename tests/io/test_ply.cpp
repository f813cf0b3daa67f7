// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "check_cloud.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "support/data.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

LoadedCloud parse_rows(const std::string& text) { return io::parse_ply(bytes_of(text), "test").value(); }

void check_all(const PlyFile& file, int rest, int degree) {
  const LoadedCloud loaded = parse_rows(file.text());
  check_consistent(loaded);
  CHECK(loaded.report.warnings.empty());
  CHECK(loaded.cloud.sh_degree == degree);
  CHECK(loaded.report.source == "test");
  REQUIRE(loaded.cloud.size() == file.rows.size());
  for (std::size_t i = 0; i < file.rows.size(); ++i) check_gaussian(loaded.cloud, i, file.rows[i], rest);
}

}  // namespace

TEST_CASE("N36_sh_degree_mismatch") {
  // Every degree there is, more rows than a block; of degree 4 the bands that kernels evaluate.
  const int counts[] = {0, 9, 24, 45, 72};
  for (int degree = 0; degree <= 4; ++degree) {
    PlyFile file;
    file.properties = inria_properties(counts[degree]);
    file.rows = random_rows(600, counts[degree], 1u + static_cast<unsigned>(degree));
    if (degree <= kMaxShDegree) {
      check_all(file, counts[degree], degree);
      continue;
    }
    const LoadedCloud loaded = parse_rows(file.text());
    CHECK(loaded.cloud.sh_degree == kMaxShDegree);
    for (std::size_t i = 0; i < 600; ++i) check_gaussian(loaded.cloud, i, file.rows[i], 72);
    REQUIRE(loaded.report.warnings.size() == 1);
    CHECK(contains(loaded.report.warnings[0], "degree 4"));
  }
  // 10 fit no degree; test_ply_bad.cpp has more such counts.
  PlyFile file;
  file.properties = inria_properties(10);
  file.rows = random_rows(3, 10, 2);
  const auto result = io::parse_ply(bytes_of(file.text()), "some.ply");
  CHECK(result.code() == Errc::invalid_file);
  CHECK(contains(result.message(), "some.ply"));
  CHECK(contains(result.message(), "10 properties f_rest_*"));
}

TEST_CASE("ply: properties in any order") {
  std::mt19937 generator(5);
  for (int turn = 0; turn < 20; ++turn) {
    PlyFile file;
    file.properties = inria_properties(turn % 2 == 0 ? 45 : 9);
    file.properties.emplace_back("label", "uchar");
    file.properties.emplace_back("weight", "double");
    std::shuffle(file.properties.begin(), file.properties.end(), generator);
    file.rows = random_rows(7, turn % 2 == 0 ? 45 : 9, 100u + static_cast<unsigned>(turn));
    check_all(file, turn % 2 == 0 ? 45 : 9, turn % 2 == 0 ? 3 : 1);
  }
}

TEST_CASE("ply: doubles, big endian, ascii, type names of both kinds") {
  for (const char* format : {"binary_little_endian", "binary_big_endian", "ascii"}) {
    for (const char* type : {"double", "float64", "float", "float32"}) {
      CAPTURE(format);
      CAPTURE(type);
      PlyFile file;
      file.format = format;
      file.properties = inria_properties(9, type);
      file.rows = random_rows(300, 9, 9);
      check_all(file, 9, 1);
    }
  }
}

TEST_CASE("ply: integer types") {
  for (const char* format : {"binary_little_endian", "binary_big_endian", "ascii"}) {
    PlyFile file;
    file.format = format;
    file.properties = inria_properties(0);
    const std::map<std::string, std::pair<std::string, double>> typed = {
        {"x", {"short", -1234}},    {"y", {"ushort", 60000}},   {"z", {"uint", 3000000000.0}},
        {"f_dc_0", {"uchar", 200}}, {"f_dc_1", {"char", -100}}, {"opacity", {"int8", -2}},
        {"scale_0", {"int", -7}},   {"rot_0", {"uint8", 255}},  {"rot_1", {"int16", -255}}};
    file.rows = random_rows(3, 0, 4);
    for (auto& [name, type] : file.properties) {
      const auto found = typed.find(name);
      if (found == typed.end()) continue;
      type = found->second.first;
      for (PlyRow& row : file.rows) row[name] = found->second.second;
    }
    check_all(file, 0, 0);
  }
}

TEST_CASE("ply: doubles keep positions far from zero") {
  PlyFile file;
  file.properties = inria_properties(0, "double");
  file.rows = random_rows(2, 0, 4);
  file.rows[0]["x"] = 500000.123456;
  file.rows[1]["x"] = 500000.123556;
  const LoadedCloud loaded = parse_rows(file.text());
  CHECK(std::fabs(loaded.cloud.mean(1).x - loaded.cloud.mean(0).x - 1e-4) < 5e-6);
}

TEST_CASE("ply: CRLF header, comments that name the filter") {
  const std::pair<const char*, Filter> comments[] = {
      {"comment SplatRenderMode: mip\n", Filter::mip},
      {"comment SplatRenderMode: default\n", Filter::classic},
      {"comment antialiased 1\n", Filter::mip},
      {"comment antialiased 0\n", Filter::classic},
      {"comment antialiased: true\n", Filter::mip},
      {"comment made by mip\n", Filter::classic},
      {"obj_info SplatRenderMode: mip\n", Filter::mip},
      {"", Filter::classic}};
  for (const auto& [line, filter] : comments) {
    const std::string comment = line;
    for (const char* eol : {"\n", "\r\n"}) {
      CAPTURE(comment);
      PlyFile file;
      file.comments = comment;
      file.eol = eol;
      file.properties = inria_properties(0);
      file.rows = random_rows(3, 0, 2);
      check_all(file, 0, 0);
      CHECK(parse_rows(file.text()).cloud.filter == filter);
    }
  }
}

TEST_CASE("ply: other elements before and after") {
  PlyFile file;
  file.properties = inria_properties(9);
  file.rows = random_rows(5, 9, 3);
  file.before_header =
      "element camera 2\nproperty double a\nproperty uchar b\n"
      "element face 3\nproperty list uchar int vertex_indices\nproperty short tag\n"
      "element nothing 99999999999\n";
  file.before_rows = std::string(18, 'c');
  for (int i = 0; i < 3; ++i) {
    put(file.before_rows, static_cast<unsigned char>(i));
    for (int k = 0; k < i; ++k) put(file.before_rows, k);
    put(file.before_rows, static_cast<short>(1));
  }
  file.after_header = "element edge 2\nproperty int a\nproperty int b\n";
  file.after_rows = std::string(16, 'e');
  check_all(file, 9, 1);

  SUBCASE("ascii") {
    file.format = "ascii";
    file.before_rows = "1.5 2\n3 4\n0 7\n1 5 7\n2 5 6 7\n";
    file.after_rows = "1 2\n3 4\n\n";
    check_all(file, 9, 1);
  }
  SUBCASE("an element behind is cut off: the Gaussians are whole") {
    file.after_rows.pop_back();
    const LoadedCloud loaded = parse_rows(file.text());
    CHECK(loaded.cloud.size() == 5);
    REQUIRE(loaded.report.warnings.size() == 1);
    CHECK(contains(loaded.report.warnings[0], "'edge' promises 2 rows, 1 are there"));
  }
}

TEST_CASE("N35_nan_position_row") {
  // 100 000 rows of degree 1 by hand, so that the file is as large as files are.
  constexpr std::size_t kRows = 100000, kFloats = 26;
  PlyFile file;
  file.properties = inria_properties(9);
  REQUIRE(file.properties.size() == kFloats);
  std::mt19937 generator(35);
  std::uniform_real_distribution<float> uniform(0.1f, 2.0f);
  std::vector<float> values(kRows * kFloats);
  for (float& v : values) v = uniform(generator);
  const auto text_of = [&](const std::vector<float>& rows) {
    file.count = std::to_string(rows.size() / kFloats);
    return file.header() +
           std::string(reinterpret_cast<const char*>(rows.data()), rows.size() * sizeof(float));
  };
  std::vector<float> without = values;
  without.erase(without.begin() + 17 * kFloats, without.begin() + 18 * kFloats);
  const LoadedCloud expected = parse_rows(text_of(without));
  REQUIRE(expected.cloud.size() == kRows - 1);
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  // x, z and, for the same reason, a coefficient of SH.
  for (const auto& [column, bad] : {std::pair<std::size_t, float>{0, nan}, {2, inf}, {9 + 4, nan}}) {
    std::vector<float> rows = values;
    rows[17 * kFloats + column] = bad;
    const LoadedCloud loaded = parse_rows(text_of(rows));
    CHECK(loaded.report.read == kRows);
    CHECK(loaded.report.kept == kRows - 1);
    CHECK(loaded.report.dropped_non_finite == 1);
    CHECK(loaded.report.dropped() == 1);
    CHECK(loaded.cloud.means == expected.cloud.means);
    CHECK(loaded.cloud.quats == expected.cloud.quats);
    CHECK(loaded.cloud.scales == expected.cloud.scales);
    CHECK(loaded.cloud.opacities == expected.cloud.opacities);
    CHECK(loaded.cloud.sh0 == expected.cloud.sh0);
    CHECK(loaded.cloud.shN == expected.cloud.shN);
  }
}

TEST_CASE("N37_truncated_ply_zero_rows") {
  // A writer that died: the header promises all rows, the disk has zeros after the first.
  PlyFile file;
  file.properties = inria_properties(45);
  file.rows = random_rows(1000, 45, 37);
  std::string text = file.text();
  const std::size_t stride = (text.size() - file.header().size()) / 1000;
  std::fill(text.begin() + static_cast<std::ptrdiff_t>(file.header().size() + stride), text.end(), '\0');
  const LoadedCloud loaded = parse_rows(text);
  check_consistent(loaded);
  CHECK(loaded.report.read == 1000);
  CHECK(loaded.report.dropped_zero_quat == 999);
  CHECK(loaded.report.dropped() == 999);
  REQUIRE(loaded.cloud.size() == 1);
  check_gaussian(loaded.cloud, 0, file.rows[0], 45);
}

TEST_CASE("ply: bad rows are counted and their neighbours stay whole") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  PlyFile file;
  file.properties = inria_properties(45);
  file.rows = random_rows(12, 45, 21);
  file.rows[1]["x"] = nan;
  file.rows[2]["f_rest_44"] = nan;
  file.rows[3]["opacity"] = nan;
  file.rows[4]["scale_1"] = nan;
  file.rows[5]["f_dc_2"] = inf;
  for (const char* r : {"rot_0", "rot_1", "rot_2", "rot_3"}) file.rows[6][r] = 0;
  file.rows[7]["rot_2"] = nan;
  file.rows[8]["opacity"] = -30;
  file.rows[9]["scale_0"] = 50;
  file.rows[10]["opacity"] = inf;  // opaque
  for (const char* format : {"binary_little_endian", "ascii"}) {
    file.format = format;
    const LoadedCloud loaded = parse_rows(file.text());
    check_consistent(loaded);
    CHECK(loaded.report.read == 12);
    CHECK(loaded.report.dropped_non_finite == 5);
    CHECK(loaded.report.dropped_zero_quat == 2);
    CHECK(loaded.report.dropped_transparent == 1);
    CHECK(loaded.report.clamped_scales == 1);
    REQUIRE(loaded.cloud.size() == 4);
    check_gaussian(loaded.cloud, 0, file.rows[0], 45);
    PlyRow clamped = file.rows[9];
    clamped["scale_0"] = 20;
    check_gaussian(loaded.cloud, 1, clamped, 45);
    check_gaussian(loaded.cloud, 2, file.rows[10], 45);
    CHECK(loaded.cloud.opacities[2] == 1.0f);
    check_gaussian(loaded.cloud, 3, file.rows[11], 45);
  }
}

TEST_CASE("ply: no rows, stray bytes") {
  PlyFile file;
  file.properties = inria_properties(0);
  CHECK(parse_rows(file.text()).cloud.size() == 0);
  file.rows = random_rows(3, 0, 1);
  file.after_rows = "12345";
  const LoadedCloud loaded = parse_rows(file.text());
  CHECK(loaded.cloud.size() == 3);
  REQUIRE(loaded.report.warnings.size() == 1);
  CHECK(contains(loaded.report.warnings[0], "5 stray bytes follow the 3 rows"));
}

TEST_CASE("ply: a real file whose header promises fewer rows than follow") {
  const std::string path = data_file("splats/misc/cvlab_pc_short.ply");
  if (path.empty()) return;
  const LoadedCloud loaded = io::load_ply(path).value();
  check_consistent(loaded);
  CHECK(loaded.report.read == 100);
  CHECK(loaded.cloud.sh_degree == 3);
  CHECK(loaded.report.source == path);
  REQUIRE(loaded.report.warnings.size() == 1);
  CHECK(contains(loaded.report.warnings[0], "14029 stray bytes"));
  // The first row by hand: 62 floats behind the header.
  const std::string text = read_file(path);
  const std::size_t at = text.find("end_header\n") + 11;
  float row[62];
  std::memcpy(row, text.data() + at, sizeof row);
  CHECK(loaded.cloud.mean(0).x == row[0]);
  CHECK(loaded.cloud.sh0[2] == row[8]);
  CHECK(loaded.cloud.shN[3 * 14 + 1] == row[9 + 15 + 14]);  // green, last coefficient
  CHECK(near(loaded.cloud.opacities[0], 1 / (1 + std::exp(-static_cast<long double>(row[54])))));
  CHECK(near(loaded.cloud.scales[2][0], std::exp(static_cast<long double>(row[57]))));
}
