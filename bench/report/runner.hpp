// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/status.hpp"
#include "options.hpp"

namespace gsnav_report {

/// Makes all rows that the options ask for, then the pages. An interrupted run succeeds with the rows so
/// far.
gsnav::Status run_report(const Options& options);

}  // namespace gsnav_report
