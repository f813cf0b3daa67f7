// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// Settings of build_lod.
struct LodSettings {
  int sh_degree = kMaxShDegree;  ///< SH degree of merged Gaussians; the degree of the cloud is an upper
                                 ///< limit.
  int neighbours = 8;            ///< Nearest neighbours that each Gaussian is tried with for a merge, in
                                 ///< [1, 16].
  /// Called some hundred times with the share of the work that is done, in [0, 1], by the calling
  /// thread.
  std::function<void(double)> progress;
};

}  // namespace gsnav
