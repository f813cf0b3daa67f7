// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "check_cloud.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/frame/sh.hpp"
#include "neighbours.hpp"
#include "ply_file.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Root mean square distance to the k nearest others, by asking all.
double brute_force(const std::vector<Vec3d>& points, std::size_t i, std::size_t k) {
  std::vector<double> squares;
  for (std::size_t j = 0; j < points.size(); ++j) {
    const Vec3d d = points[j] - points[i];
    if (j != i && is_finite(points[j])) squares.push_back(dot(d, d));
  }
  std::sort(squares.begin(), squares.end());
  k = std::min(k, squares.size());
  double sum = 0;
  for (std::size_t n = 0; n < k; ++n) sum += squares[n];
  return k == 0 ? 0 : std::sqrt(sum / static_cast<double>(k));
}

std::vector<Vec3d> random_points(std::size_t n, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<Vec3d> out;
  for (std::size_t i = 0; i < n; ++i) {
    // A dense sheet, a loose cloud, and points twice.
    const double spread = i % 3 == 0 ? 0.01 : 5;
    out.push_back({10 * rng.uniform(), spread * rng.uniform(), 10 * rng.uniform()});
    if (i % 17 == 0) out.push_back(out.back());
  }
  return out;
}

PlyFile point_file(const std::vector<Vec3d>& points, const std::string& colour) {
  PlyFile file;
  file.properties = {{"x", "float"},  {"y", "float"},    {"z", "double"},
                     {"red", colour}, {"green", colour}, {"blue", colour}};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double full = colour == "uchar" ? 255 : colour == "ushort" ? 65535 : 1;
    file.rows.push_back({{"x", points[i].x},
                         {"y", points[i].y},
                         {"z", points[i].z},
                         {"red", i % 2 == 0 ? full : 0},
                         {"green", colour == "float" ? 0.25 : full},
                         {"blue", 0}});
  }
  return file;
}

}  // namespace

TEST_CASE("neighbours: distances are those that asking all points gives") {
  for (const std::size_t n : {1u, 2u, 3u, 9u, 500u, 6000u}) {
    std::vector<Vec3d> points = random_points(n, n);
    if (n > 100) points[7].x = std::numeric_limits<double>::quiet_NaN();
    for (const std::size_t k : {1u, 3u, 8u}) {
      const std::vector<double> got = io::detail::neighbour_distances(points, k);
      REQUIRE(got.size() == points.size());
      double worst = 0;
      for (std::size_t i = 0; i<points.size(); i += n> 1000 ? 13 : 1) {
        const double want = is_finite(points[i]) ? brute_force(points, i, k) : 0;
        worst = std::max(worst, std::fabs(got[i] - want));
      }
      CHECK(worst < 1e-12);
    }
  }
  const std::vector<Vec3d> same(5000, Vec3d{1, 2, 3});
  CHECK(io::detail::neighbour_distances(same, 3)[4321] == 0);
  CHECK(io::detail::neighbour_distances({}, 3).empty());
}

TEST_CASE("ply points: coloured points become round Gaussians of their neighbours' distance") {
  std::vector<Vec3d> points;
  for (int x = 0; x < 10; ++x) {
    for (int y = 0; y < 10; ++y) points.push_back({0.1 * x, 0.1 * y, 1});
  }
  points.push_back({50, 0, 0});  // far from all others
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const char* colour : {"uchar", "ushort", "float"}) {
      CAPTURE(format);
      CAPTURE(colour);
      PlyFile file = point_file(points, colour);
      file.format = format;
      TempFolder folder("ply_points");
      write_file(folder / "a.ply", file.text());
      const LoadedCloud loaded = io::load_ply(folder / "a.ply").value();
      check_consistent(loaded);
      const GaussianCloud& c = loaded.cloud;
      REQUIRE(c.size() == points.size());
      CHECK(loaded.report.warnings.size() == 1);
      for (std::size_t i = 0; i < c.size(); ++i) {
        CHECK(norm(c.mean(i) - points[i]) < 1e-5);
        // In a square grid the three nearest are one step away, but for the corners' third and the far
        // point's.
        const bool corner = i == 0 || i == 9 || i == 90 || i == 99;
        const double want = i == 100 ? 0.4 : 0.1 * (corner ? std::sqrt(4.0 / 3) : 1);
        for (const auto& axis : c.scales)
          CHECK(static_cast<double>(axis[i]) == doctest::Approx(want).epsilon(1e-4));
        const auto drawn = [&](std::size_t k) {
          return 0.5 + static_cast<double>(c.sh0[3 * i + k]) * kSh0;
        };
        CHECK(drawn(0) == doctest::Approx(i % 2 == 0 ? 1 : 0));
        CHECK(drawn(1) == doctest::Approx(std::string(colour) == "float" ? 0.25 : 1));
        CHECK(drawn(2) == doctest::Approx(0));
        CHECK(static_cast<double>(c.opacities[i]) == doctest::Approx(0.99));
      }
    }
  }
}

TEST_CASE("ply points: Gaussians with plain colours have these, not SH coefficients of that value") {
  PlyFile file;
  file.properties = inria_properties(0);
  file.rows = random_rows(40, 0, 5);
  for (auto& [name, type] : file.properties) {
    const std::string plain[] = {"red", "green", "blue"};
    for (std::size_t k = 0; k < 3; ++k) {
      if (name != "f_dc_" + std::to_string(k)) continue;
      name = plain[k];
      type = "uchar";
    }
  }
  for (std::size_t i = 0; i < file.rows.size(); ++i) {
    file.rows[i]["red"] = 255;
    file.rows[i]["green"] = 51;
    file.rows[i]["blue"] = 0;
  }
  const LoadedCloud loaded = io::parse_ply(bytes_of(file.text()), "a.ply").value();
  REQUIRE(loaded.cloud.size() > 10);
  for (std::size_t i = 0; i < loaded.cloud.size(); ++i) {
    CHECK(0.5 + static_cast<double>(loaded.cloud.sh0[3 * i]) * kSh0 == doctest::Approx(1));
    CHECK(0.5 + static_cast<double>(loaded.cloud.sh0[3 * i + 1]) * kSh0 == doctest::Approx(0.2));
  }
}

TEST_CASE("ply points: cut files and empty ones are refused") {
  const PlyFile file = point_file(random_points(30, 3), "uchar");
  const std::string text = file.text();
  for (std::size_t n = file.header().size(); n < text.size(); ++n) {
    REQUIRE(io::parse_ply(bytes_of(text.substr(0, n)), "a.ply").code() == Errc::invalid_file);
  }
  PlyFile empty = file;
  empty.rows.clear();
  CHECK(io::parse_ply(bytes_of(empty.text()), "a.ply").code() == Errc::invalid_file);
}
