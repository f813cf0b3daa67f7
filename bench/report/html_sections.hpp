// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table.hpp"

namespace gsnav_report {

/// A table of cells that are HTML already. The first `names` columns are left-aligned names.
std::string html_table(const std::vector<std::string>& header,
                       const std::vector<std::vector<std::string>>& rows, std::size_t names = 1);

// Sections of the page as HTML; empty if the table has no rows for them.
std::string budget_section(const Table& table);
std::string target_section(const Table& table);    ///< pairs of settings compared
std::string settings_section(const Table& table);  ///< all numbers of all settings
std::string image_section(const Table& table);     ///< difference images, embedded
std::string ledger_section(const Table& table);
std::string skinning_section(const Table& table);
std::string sweep_section(const Table& table);
std::string kernel_section(const Table& table);

}  // namespace gsnav_report
