// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table.hpp"

namespace gsnav_report {

/// A setting on one backend: what it costs and what it errs, over views.
struct ParetoPoint {
  std::string label, backend, profile;
  double time = 0.0;   ///< ms per frame, mean of the views' medians
  double error = 0.0;  ///< mean over the views, in the unit of the column
  double worst = 0.0;  ///< of the worst view
  std::size_t views = 0;
  bool partial = false;  ///< measured on fewer views than others: it dominates nobody
  bool dominated =
      false;  ///< another setting there is as fast and as right, and better in one of the two
};

/// Marks as dominated what is, among the points of one backend; `higher_is_better` as for PSNR.
void mark_dominated(std::vector<ParetoPoint>& points, bool higher_is_better);

/// One point a (backend, setting) of `rows`, which are of one resolution, sensor and oracle; settings
/// whose images are those of `exact` are left out.
std::vector<ParetoPoint> pareto_points(const RowRefs& rows, const std::string& column,
                                       bool higher_is_better);

/// Speed against PSNR, FLIP and depth for each resolution, as HTML; empty where nothing can be drawn.
std::string pareto_section(const Table& table);

/// Error and time of each value of each knob, as HTML; empty where no knob was turned.
std::string knob_section(const Table& table);

}  // namespace gsnav_report
