// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "csv.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav_report {

struct SkinningOptions {
  int gaussians = 100000;  ///< of the embedded humanoid that is timed, about
  int sampled = 6000;      ///< of the one that errors are taken from
  int poses = 8;           ///< of walking, and as many random ones
  int threads = 0;         ///< of the openmp backend; 0: all
  int runs = 15;
};

/// What K influences a Gaussian cost in accuracy (float64, against weights of all joints), and what
/// float32 and each backend add, with the time for 100,000 Gaussians. Errors: what making the humanoid
/// reports.
gsnav::Result<std::vector<Row>> skinning_rows(const SkinningOptions& options);

}  // namespace gsnav_report
