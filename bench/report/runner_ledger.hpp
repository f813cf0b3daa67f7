// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "csv.hpp"

namespace gsnav_report {

/// Rows of the approximations that each profile makes beyond the contract, each with its size: a bound,
/// or measured here. A change to a profile's approximations must change its entry.
std::vector<Row> ledger_rows();

}  // namespace gsnav_report
