// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table.hpp"

namespace gsnav_report {

/// A setting on one backend: its time and its error, over views.
struct ParetoPoint {
  std::string label, backend, threads, profile;
  double time = 0.0;   ///< ms per frame: `ratio` times the mean of `exact`'s medians over the views
  double ratio = 0.0;  ///< time divided by that of `exact`
  double error = 0.0;  ///< mean over the views, in the unit of the column
  double worst = 0.0;  ///< error of the worst view
  std::size_t views = 0;
  bool partial = false;  ///< measured on fewer views than others; such a point dominates no other
  /// Another setting of the same backend and number of threads is at least as fast and as accurate, and
  /// better in one of the two.
  bool dominated = false;
};

/// Sets `dominated` for all points, each compared with those of its backend and number of threads.
/// `higher_is_better`: true for measures such as PSNR.
void mark_dominated(std::vector<ParetoPoint>& points, bool higher_is_better);

/// The rows whose PSNR the fronts compare: those of the first sensor with colour, against the first of
/// the contract's orders that was measured.
RowRefs against_front_oracle(const RowRefs& rows);

/// One point per (backend, threads, setting) of `rows`, which must have the same resolution, sensor and
/// oracle. Settings whose images equal those of `exact` are left out.
std::vector<ParetoPoint> pareto_points(const RowRefs& rows, const std::string& column,
                                       bool higher_is_better);

/// Charts of speed against PSNR, FLIP and depth for each resolution, as HTML; empty if there is nothing
/// to draw.
std::string pareto_section(const Table& table);

/// Charts of error and time over the values of each knob, as HTML; empty if no knob was measured.
std::string knob_section(const Table& table);

}  // namespace gsnav_report
