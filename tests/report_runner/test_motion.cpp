// SPDX-License-Identifier: Apache-2.0
// The truths that skinning and sweep rows are judged by, against closed forms.
#include <doctest/doctest.h>

#include <cmath>
#include <map>

#include "runner_ledger.hpp"
#include "skinning.hpp"
#include "sweep.hpp"

using namespace gsnav;
using namespace gsnav_report;

using V = Vec3<long double>;

TEST_CASE("sweep truth: distances known in closed form") {
  const V o{}, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  CHECK(segment_distance_truth(o, x, z, z + x) == doctest::Approx(1));               // parallel
  CHECK(segment_distance_truth(o, x, x * 3.0L, x * 2.0L) == doctest::Approx(1));     // in line
  CHECK(segment_distance_truth(-x, x, z - y, z + y) == doctest::Approx(1));          // skew
  CHECK(segment_distance_truth(-x, x, -y, y) == doctest::Approx(0).epsilon(1e-15));  // crossing
  CHECK(segment_distance_truth(o, o, x + y, x + y) == doctest::Approx(std::sqrt(2.0)));
  CHECK(segment_distance_truth(o, x, y * 2.0L + x * 2.0L, y * 2.0L + x * 5.0L) ==
        doctest::Approx(std::sqrt(5.0)));
}

TEST_CASE("sweep truth: the least gap of a passing sphere") {
  // A sphere of 0.1 m runs 100 m past one of 0.2 m: nearest 0.5 m away at the middle.
  const auto ball = [](const Vec3d& p, double r) { return Capsule<double>{p, p, r}; };
  const MovingCapsule<double> standing{ball({0, 0.5, 0}, 0.2), ball({0, 0.5, 0}, 0.2)};
  const MovingCapsule<double> flying{ball({-50, 0, 0}, 0.1), ball({50, 0, 0}, 0.1)};
  CHECK(static_cast<double>(least_gap(standing, flying, 1)) == doctest::Approx(0.2).epsilon(1e-7));
  CHECK(static_cast<double>(least_gap(standing, flying, 0.25L)) ==
        doctest::Approx(std::sqrt(625.25) - 0.3).epsilon(1e-7));  // only as far as x = -25
  // It grows meanwhile: gap(t) = sqrt(0.25 + (100 t - 50)^2) - 0.3 - t, least where its slope is 0.
  MovingCapsule<double> growing = flying;
  growing.end.radius = 1.1;
  const double s = 0.5 * 0.01 / std::sqrt(1 - 1e-4);  // x / sqrt(0.25 + x^2) = 1 / 100
  CHECK(static_cast<double>(least_gap(standing, growing, 1)) ==
        doctest::Approx(std::sqrt(0.25 + s * s) - 0.3 - (50 + s) / 100).epsilon(1e-6));
  // Through the middle of it: as deep as the radii.
  MovingCapsule<double> through = flying;
  through.begin.p0.y = through.begin.p1.y = through.end.p0.y = through.end.p1.y = 0.5;
  CHECK(static_cast<double>(least_gap(standing, through, 1)) == doctest::Approx(-0.3).epsilon(1e-7));
  CHECK(least_gap(standing, flying, 1, 0.1L) >= 0.1L);  // above the ceiling is all that is said
  CHECK(least_gap(standing, through, 1, 1, 0) < 0);
}

TEST_CASE("sweep rows: within the contract's budget at every speed") {
  SweepOptions options;
  options.pairs = 40;
  options.runs = 1;
  std::vector<std::size_t> steps;
  options.on_step = [&](std::size_t done, std::size_t total, const std::string&) {
    CHECK(total == 7 * 2);
    steps.push_back(done);
    return true;
  };
  const std::vector<Row> rows = sweep_rows(options);
  CHECK(rows.size() == 2 + 7 * 4);
  CHECK(steps == std::vector<std::size_t>{0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13});
  for (const Row& row : rows) {
    CAPTURE(row.get("name"));
    CAPTURE(row.get("knob_value"));
    CHECK(*row.number("error_max") <= (row.get("error_unit") == "relative" ? 1e-5 : 2e-4));
    if (row.get("name").rfind("penetration", 0) == 0) CHECK(*row.number("error_max") <= 1e-5);
    CHECK(*row.number("items_per_second") > 0);
  }
}

TEST_CASE("rows of sweeps and skinning: a step that is refused ends the work without rows") {
  std::size_t last = 0;
  const auto until_two = [&](std::size_t done, std::size_t, const std::string&) {
    last = done;
    return done < 2;
  };
  SweepOptions sweep;
  sweep.pairs = 4;
  sweep.runs = 1;
  sweep.on_step = until_two;
  CHECK(sweep_rows(sweep).empty());
  CHECK(last == 2);
  SkinningOptions skinning;
  skinning.gaussians = skinning.sampled = 2000;
  skinning.poses = 1;
  skinning.runs = 1;
  skinning.on_step = until_two;
  last = 0;
  CHECK(skinning_rows(skinning).value().empty());
  CHECK(last == 2);
}

TEST_CASE("skinning rows: more influences, less error; float32 within the budget") {
  SkinningOptions options;
  options.gaussians = options.sampled = 2000;
  options.poses = 2;
  options.runs = 1;
  const std::vector<Row> rows = skinning_rows(options).value();
  std::map<std::string, double> last;
  for (const Row& row : rows) {
    const bool position = row.get("name") == "position";
    const double error = *row.number("error_p99");
    if (!row.get("backend").empty()) {
      CHECK(*row.number("error_max") <= (position ? 2e-5 : 0.01));
      CHECK(*row.number("time_p50_ms") > 0);
      continue;
    }
    const std::string series = row.get("name") + row.get("knob_value");
    if (last.count(series) != 0) CHECK(error <= last[series]);
    last[series] = error;
  }
  CHECK(last.size() == 6);  // of two kinds of poses; covariance: shapes turned, then stretched
  CHECK(last["positionwalk"] < 1e-4);
}

TEST_CASE("ledger: every profile has entries with their error") {
  int exact = 0, fast = 0, lod = 0;
  for (const Row& row : ledger_rows()) {
    exact += row.get("profile") == "exact";
    fast += row.get("profile") == "fast";
    lod += row.get("profile") == "lod";
    CHECK(*row.number("error_max") > 0);
    CHECK_FALSE(row.get("note").empty());
  }
  CHECK(exact >= 3);
  CHECK(fast >= 1);
  CHECK(lod >= 1);
}
