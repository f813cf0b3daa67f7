// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "csv.hpp"

namespace gsnav_report {

/// What each profile approximates beyond the contract, and by how much: a bound, or measured here. A
/// profile that changes what it approximates changes its entry.
std::vector<Row> ledger_rows();

}  // namespace gsnav_report
