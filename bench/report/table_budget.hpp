// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table.hpp"

namespace gsnav_report {

/// One budget of the contract against the worst row that it applies to.
struct BudgetCheck {
  std::string profile, backend;
  std::string measure;    ///< "PSNR, dB"
  std::string oracle;     ///< of the worst row
  double limit = 0.0;     ///< in the unit that `measure` names
  double worst = 0.0;     ///< in that unit
  bool at_least = false;  ///< the limit is a lower one
  std::string where;      ///< scene, view and resolution of the worst row
  std::size_t rows = 0;   ///< that were judged

  bool met() const noexcept { return at_least ? worst >= limit : worst <= limit; }
};

/// Every budget that the table has rows for: profiles by backend, skinning, capsules.
std::vector<BudgetCheck> check_budgets(const Table& table);

}  // namespace gsnav_report
