// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table.hpp"

namespace gsnav_report {

/// A budget of the contract compared with the worst row that it applies to.
struct BudgetCheck {
  std::string profile, backend;
  std::string measure;    ///< "PSNR, dB"
  std::string oracle;     ///< of the worst row
  double limit = 0.0;     ///< in the unit that `measure` names
  double worst = 0.0;     ///< in the same unit
  bool at_least = false;  ///< `limit` is a lower limit
  std::string where;      ///< scene, view and resolution of the worst row
  std::size_t rows = 0;   ///< number of rows that were judged

  bool met() const noexcept { return at_least ? worst >= limit : worst <= limit; }
};

/// Checks of all budgets that the table has rows for: profiles by backend, skinning, capsules.
std::vector<BudgetCheck> check_budgets(const Table& table);

}  // namespace gsnav_report
