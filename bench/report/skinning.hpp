// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "csv.hpp"
#include "gsnav/core/status.hpp"
#include "runner_system.hpp"

namespace gsnav_report {

struct SkinningOptions {
  int gaussians = 100000;  ///< of the embedded humanoid that is timed, about
  int sampled = 6000;      ///< Gaussians of the humanoid that errors are measured on
  int poses = 8;           ///< poses of walking, and the same number of random poses
  int threads = 0;         ///< of the openmp backend; 0: all
  int runs = 15;           ///< timed calls
  OnStep on_step;          ///< may be empty
};

/// Rows of the accuracy of K influences per Gaussian (float64, against the weights of all joints), and
/// of the errors that float32 and each backend add, with the time for 100,000 Gaussians. No rows if
/// `on_step` returns false. Errors: those of making the humanoid.
gsnav::Result<std::vector<Row>> skinning_rows(const SkinningOptions& options);

}  // namespace gsnav_report
