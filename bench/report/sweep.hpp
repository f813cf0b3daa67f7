// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include "csv.hpp"
#include "gsnav/math/capsule.hpp"
#include "runner_system.hpp"

namespace gsnav_report {

/// Distance between two segments in long double, metres.
long double segment_distance_truth(const gsnav::Vec3<long double>& a0,
                                   const gsnav::Vec3<long double>& a1,
                                   const gsnav::Vec3<long double>& b0,
                                   const gsnav::Vec3<long double>& b1);

/// Least gap of two moving capsules over [0, end] in long double, within 1e-8 m. It uses branch and
/// bound, so that no contact between samples is missed. Gaps above `ceiling` all give the same result. A
/// gap below `enough` ends the search, and the result then only says that the gap is below it.
long double least_gap(const gsnav::MovingCapsule<double>& a, const gsnav::MovingCapsule<double>& b,
                      long double end,
                      long double ceiling = std::numeric_limits<long double>::infinity(),
                      long double enough = -std::numeric_limits<long double>::infinity());

struct SweepOptions {
  int pairs = 1000;  ///< random pairs per row
  int runs = 15;     ///< timed passes over them
  OnStep on_step;    ///< may be empty
};

/// Rows of capsule distances and sweeps in float32 and float64 against long double; sweeps by speed of
/// motion. No rows if `on_step` returns false.
std::vector<Row> sweep_rows(const SweepOptions& options);

}  // namespace gsnav_report
