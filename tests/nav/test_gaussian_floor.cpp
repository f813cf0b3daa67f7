// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "../../src/nav/gaussian_floor.hpp"

using namespace gsnav;

namespace {

constexpr std::size_t kFoot = 30, kSide = 10, kWidth = 26, kTread = 6;  // columns of the flight
constexpr std::size_t kSteps = 16, kLow = 4;

/// Two storeys, and a roof unless it was cut off, as voxels. A flight of kSteps - 1 treads of `rise`
/// levels leads up through an opening. Each riser stands two levels out of its tread, as Gaussians on
/// edge do.
detail::VoxelGrid house(double rise, double phase, bool roof = true) {
  detail::VoxelGrid g;
  const std::size_t head = kFoot + (kSteps - 1) * kTread;
  g.nx = head + 30;
  g.nz = 50;
  const auto level = [&](std::size_t step) {
    return static_cast<std::uint16_t>(static_cast<double>(kLow) + phase +
                                      static_cast<double>(step) * rise);
  };
  const std::uint16_t upper = level(kSteps);
  g.ny = 2 * std::size_t{upper};
  g.first.push_back(0);
  for (std::size_t c = 0; c < g.nx * g.nz; ++c) {
    const std::size_t x = c % g.nx, z = c / g.nx;
    const auto sheet = [&](std::uint16_t y, std::size_t out) {
      g.runs.push_back({y, static_cast<std::uint16_t>(y + out + 1)});
    };
    sheet(level(0), 0);
    const bool opening = x >= kFoot && x < head && z >= kSide && z < kSide + kWidth;
    if (opening) {
      const std::size_t step = (x - kFoot) / kTread + 1;
      sheet(level(step), (x - kFoot) % kTread == 0 ? 2 : 0);
    } else {
      sheet(upper, 0);
    }
    if (roof) sheet(static_cast<std::uint16_t>(2 * upper - kLow), 0);
    g.first.push_back(static_cast<std::uint32_t>(g.runs.size()));
  }
  return g;
}

struct Found {
  detail::FloorTops floors;
  GaussianNavReport report;
};

constexpr std::size_t kClimb = 4;

Found find(detail::VoxelGrid& g) {
  Found out;
  ThreadPool pool(1);
  double most_area = 0;
  const detail::FloorSettings look{30, kClimb, 4, 1.0};
  out.floors = find_floors(g, look, {}, pool, out.report, most_area);
  return out;
}

}  // namespace

TEST_CASE("gaussian floor: stairs are a ramp without steps from floor to floor") {
  for (const double rise : {3.0, 3.3, 3.5, 3.6, 3.9}) {
    for (const double phase : {0.0, 0.25, 0.5, 0.75}) {
      CAPTURE(rise);
      CAPTURE(phase);
      detail::VoxelGrid g = house(rise, phase);
      const std::size_t nx = g.nx, z = kSide + kWidth / 2;
      const auto upper = static_cast<int>(static_cast<double>(kLow) + phase + kSteps * rise);
      const Found f = find(g);
      REQUIRE(f.report.stairs == 1);
      REQUIRE(f.report.storeys.size() == 2);
      // Follow the ground along the flight: what stands on it and how high it is.
      int at = static_cast<int>(kLow), before = at;
      for (std::size_t x = kFoot - 10; x + 10 < nx; ++x) {
        const std::size_t c = x + nx * z;
        int next = 1000;
        for (std::uint32_t i = f.floors.first[c]; i < f.floors.first[c + 1]; ++i) {
          const int top = f.floors.tops[i];
          if (std::abs(top - at) < std::abs(next - at)) next = top;
        }
        CAPTURE(x);
        REQUIRE(std::abs(next - at) <= 2);
        // Recast takes ground away that rises by more than the climb from one side to the other.
        REQUIRE(std::abs(next - before) <= static_cast<int>(kClimb));
        for (const detail::SolidRun& r : g.runs_of(c)) {
          const bool in_the_way = r.end > next + 1 && r.low <= next + 8;
          REQUIRE_FALSE(in_the_way);
        }
        before = at;
        at = next;
      }
      CHECK(std::abs(at - upper) <= 1);
    }
  }
}

TEST_CASE("gaussian floor: an open storey that stairs lead to is kept, and the flight below it") {
  detail::VoxelGrid covered = house(3.5, 0.25), open = house(3.5, 0.25, false);
  const Found want = find(covered), got = find(open);
  REQUIRE(got.report.storeys.size() == 2);
  CHECK(got.report.stairs == 1);
  CHECK(got.report.storeys[1].area == want.report.storeys[1].area);
  // Some ground at the edge of the opening lies under the open sky.
  CHECK(static_cast<double>(got.floors.tops.size()) >
        0.98 * static_cast<double>(want.floors.tops.size()));
}

TEST_CASE("gaussian floor: steps above the climb are no stairs") {
  for (const double phase : {0.0, 0.25, 0.5, 0.75}) {
    detail::VoxelGrid g = house(4.3, phase);
    const Found f = find(g);
    CHECK(f.report.storeys.size() == 2);
    CHECK(f.report.stairs == 0);
  }
}
