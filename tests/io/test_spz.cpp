// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>

#include "allocations.hpp"
#include "check_quantised.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "gsnav/frame/sh.hpp"
#include "gsnav/io/scene_file.hpp"
#include "spz_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Half of the format's steps.
QuantisedBounds spz_bounds(const SpzFile& file, const PlyRow& row) {
  QuantisedBounds b;
  const char* axes[] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    b.mean[k] = file.version == 1 ? std::fabs(row.at(axes[k])) / 2048 + std::exp2(-14)
                                  : std::exp2(-file.fractional_bits - 1);
  }
  b.log_scale.fill(1.0 / 32);
  b.colour.fill(0.5 / 255 / 0.15 * 0.2820948);
  b.opacity = 0.5 / 255;
  b.quat = file.version < 3 ? 1.0 / 255 : std::sqrt(0.5) / 511 / 2;
  b.rest = 0.5 / 128;
  return b;
}

std::vector<PlyRow> spz_rows(std::size_t n, int rest, unsigned seed) {
  std::vector<PlyRow> rows = random_rows(n, rest, seed);
  for (PlyRow& row : rows) {  // what the format holds
    for (int k = 0; k < rest; ++k) {
      double& v = row["f_rest_" + std::to_string(k)];
      v = std::clamp(v, -0.99, 0.99);
    }
  }
  return rows;
}

}  // namespace

TEST_CASE("spz: every field within half a step of what was packed") {
  for (const std::uint32_t version : {1u, 2u, 3u, 4u}) {
    for (const int degree : {0, 1, 2, 3, 4}) {
      CAPTURE(version);
      CAPTURE(degree);
      SpzFile file;
      file.version = version;
      file.degree = degree;
      file.fractional_bits = 10 + degree;
      file.flags = degree == 2 ? 1 : 0;
      file.rows = spz_rows(60, file.rest(), 31);
      if (version < 3) {  // the error of w grows without bound as w goes to zero
        for (PlyRow& row : file.rows) row["rot_0"] = 4 + std::fabs(row["rot_0"]);
      }
      const LoadedCloud loaded = io::parse_spz(bytes_of(file.text()), "some.spz").value();
      check_consistent(loaded);
      REQUIRE(loaded.cloud.size() == 60);
      CHECK(loaded.cloud.sh_degree == std::min(degree, 3));
      CHECK(loaded.cloud.filter == (degree == 2 ? Filter::mip : Filter::classic));
      CHECK(loaded.report.warnings.size() == (degree == 4 ? 1 : 0));
      for (std::size_t i = 0; i < 60; ++i) {
        QuantisedBounds b = spz_bounds(file, file.rows[i]);
        if (version < 3) b.quat *= 2;
        check_quantised(loaded.cloud, i, file.rows[i], file.rest(), b);
      }
    }
  }
}

namespace {

// Niantic's library, in the build that @playcanvas/splat-transform 2.7.1 carries, wrote both of the
// three rows below.
constexpr const char* kVersion3 =
    "1f8b0800000000000003358c210fc23010852fc14082a840202b10c8ca09c41c4b48964b30939508c414c17124fc8092993"
    "9"
    "aa16648344f52754202610d5a84a50633441dcbd9777efbb7cb9c60100c419f76b0ad0cbb383f9df2700338005d0e55e515"
    "3"
    "ed9a6adb9405c982b0a0c3f1b33a9f26b7fcf518bdebc4caf7be4d31a88046a8a053af3b295cc94a6765206e2d2766309ed"
    "a"
    "cd50bba40e4aa061e4113d05696357c84e0b2b3979137f659ed8358b94d3acf4a98e14276eac50ac4f7f542a83f268bec3c"
    "a"
    "354ad3000000";
constexpr const char* kVersion4 =
    "4e4753500400000003000000030c00062000000000000000000000000000000024000000000000001b000000000000000c0"
    "0"
    "000000000000030000000000000012000000000000000900000000000000120000000000000009000000000000001500000"
    "0"
    "000000000c000000000000007300000000000000870000000000000028b52ffd201bd90000001800000c0000dcff0028000"
    "0"
    "1800000c00003800002400003c0028b52ffd2003190000809fba28b52ffd20094900009380a69376a6936ca628b52ffd200"
    "9"
    "49000070588060588050588028b52ffd200c6100007f81f94b918414b24eead40928b52ffd208755030022481819c02507a"
    "e"
    "b7267a6b47224bf4d644669875247aaab7fa4fe45c6b9e7f553a49bc04c91ae56b7919edd24f1a06833ed8e7db3a9263d2e"
    "3"
    "a8cb94e67b7433c759a37c426805048ad24fb21d24cc04ffb8cb94a63bd44b3f69edf3ad0a81712c104601007b165414";

std::string unhex(const std::string& hex) {
  std::string text;
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    text += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  }
  return text;
}

}  // namespace

TEST_CASE("spz: bytes that Niantic's library wrote") {
  static constexpr double kQuats[3][4] = {
      {0.5, 0.25, -0.75, 0.125}, {-0.25, 0.5, 0.5, 1.0}, {0.125, -1.0, 0.25, 0.5}};
  SpzFile file;
  file.degree = 3;
  for (int i = 0; i < 3; ++i) {
    PlyRow row = {{"x", 1.5 + i},       {"y", -0.75 * (i + 1)}, {"z", 2.25 - 3 * i},
                  {"f_dc_0", 0.5},      {"f_dc_1", -0.25 * i},  {"f_dc_2", 1.0},
                  {"opacity", 0.5 * i}, {"scale_0", -3.0 - i},  {"scale_1", -4.5},
                  {"scale_2", -2.0}};
    for (int k = 0; k < 4; ++k) row["rot_" + std::to_string(k)] = kQuats[i][k];
    for (int k = 0; k < 45; ++k) {
      row["f_rest_" + std::to_string(k)] = ((k * 7 + i * 11) % 31 - 15) / 16.0;
    }
    file.rows.push_back(row);
  }
  for (const char* hex : {kVersion3, kVersion4}) {
    const std::string text = unhex(hex);
    const LoadedCloud loaded = io::parse_spz(bytes_of(text), "some.spz").value();
    check_consistent(loaded);
    REQUIRE(loaded.cloud.size() == 3);
    REQUIRE(loaded.cloud.sh_degree == 3);
    CHECK(loaded.report.warnings.empty());
    for (std::size_t i = 0; i < 3; ++i) {
      QuantisedBounds b = spz_bounds(file, file.rows[i]);
      b.rest = 8.5 / 128;  // the library keeps 5 bits of the first band and 4 of the others
      check_quantised(loaded.cloud, i, file.rows[i], 45, b);
    }
  }
}

TEST_CASE("spz: axes as stored") {
  SpzFile file;
  file.degree = 3;
  file.rows = spz_rows(5, 45, 32);
  const std::string text = file.text();
  const GaussianCloud turned = io::parse_spz(bytes_of(text), "a.spz").value().cloud;
  const GaussianCloud kept = io::parse_spz(bytes_of(text), "a.spz", {.keep_axes = true}).value().cloud;
  const Quatd turn{0, 1, 0, 0};  // half a turn about x
  const Vec3d v = normalized(Vec3d{0.3, -0.5, 0.8});
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(turned.mean(i) == rotate(turn, kept.mean(i)));
    const auto quat = [i](const GaussianCloud& c) {
      return Quatd{static_cast<double>(c.quats[0][i]), static_cast<double>(c.quats[1][i]),
                   static_cast<double>(c.quats[2][i]), static_cast<double>(c.quats[3][i])};
    };
    // An ellipsoid is the same after half a turn about its own axis, so that turn is free.
    const Vec3d want = rotate(turn, rotate(quat(kept), rotate(turn, v)));
    CHECK(norm(rotate(quat(turned), v) - want) < 1e-6);
    // The colour seen from a direction is the colour seen from the turned direction.
    const auto colour = [i](const GaussianCloud& c, const Vec3d& d) {
      return evaluate_sh<double>(3, d, [&](int k) {
        const auto at = [&](std::size_t channel) {
          const std::size_t first = 45 * i + 3 * (static_cast<std::size_t>(k) - 1);
          return static_cast<double>(k == 0 ? c.sh0[3 * i + channel] : c.shN[first + channel]);
        };
        return Vec3d{at(0), at(1), at(2)};
      });
    };
    CHECK(norm(colour(turned, rotate(turn, v)) - colour(kept, v)) < 1e-6);
  }
  CHECK(turned.scales == kept.scales);
  CHECK(turned.sh0 == kept.sh0);
}

TEST_CASE("spz: positions of all signs and of any precision") {
  for (const int bits : {0, 12, 23, 30}) {
    CAPTURE(bits);
    SpzFile file;
    file.fractional_bits = bits;
    file.rows = spz_rows(4, 0, 33);
    const double most = std::ldexp(8388607, -bits), least = std::ldexp(-8388608, -bits);
    const double places[4][3] = {
        {most, -least - std::ldexp(1, -bits), 0}, {least, 0, 0}, {0, 0, 0}, {0, most, most}};
    for (std::size_t i = 0; i < 4; ++i) {
      file.rows[i]["x"] = places[i][0];
      file.rows[i]["y"] = places[i][1];
      file.rows[i]["z"] = places[i][2];
    }
    const GaussianCloud c = io::parse_spz(bytes_of(file.text()), "a.spz").value().cloud;
    for (std::size_t i = 0; i < 4; ++i) {
      CHECK(c.mean(i) == Vec3d{places[i][0], places[i][1], places[i][2]});
    }
  }
}

TEST_CASE("spz: from a file, by its extension") {
  TempFolder folder("spz");
  SpzFile file;
  file.rows = spz_rows(6, 0, 34);
  write_file(folder / "a.spz", file.text());
  CHECK(io::load_spz(folder / "a.spz").value().cloud.size() == 6);
  CHECK(io::load_scene((folder / "a.spz").string()).value().cloud.size() == 6);
  CHECK(io::load_spz(folder / "none.spz").code() == Errc::file_not_found);
}

TEST_CASE("spz: a file becomes a cloud in the cloud's own memory") {
  TempFolder folder("spz_memory");
  for (const int degree : {0, 3}) {
    CAPTURE(degree);
    SpzFile file;
    file.degree = degree;
    file.rows = random_rows(40000, file.rest(), 44);
    for (const std::uint32_t version : {3u, 4u}) {
      CAPTURE(version);
      file.version = version;
      const std::string text = file.text();
      write_file(folder / "a.spz", text);
      const LoadedCloud from_bytes = io::parse_spz(bytes_of(text), "a.spz").value();
      reset_largest_allocation();
      const LoadedCloud loaded = io::load_spz(folder / "a.spz").value();
      // The cloud's largest plane; of what is packed a stream, or a piece of it, is no larger.
      CHECK(largest_allocation() <= 4 * 40000 * (degree == 0 ? 3u : 45u));
      CHECK(loaded.cloud.size() > 10000);
      CHECK(loaded.cloud.means == from_bytes.cloud.means);
      CHECK(loaded.cloud.quats == from_bytes.cloud.quats);
      CHECK(loaded.cloud.scales == from_bytes.cloud.scales);
      CHECK(loaded.cloud.opacities == from_bytes.cloud.opacities);
      CHECK(loaded.cloud.sh0 == from_bytes.cloud.sh0);
      CHECK(loaded.cloud.shN == from_bytes.cloud.shN);
    }
  }
}
