// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/status.hpp"
#include "options.hpp"

namespace gsnav_report {

/// Makes all rows that the options ask for, then the pages. After Ctrl-C it does so with the rows so
/// far.
/// @return true if the rows are complete, false after Ctrl-C
gsnav::Result<bool> run_report(const Options& options);

}  // namespace gsnav_report
