// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "cache.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_bench {

/// At most this many views of a workload are judged.
inline constexpr std::size_t kJudgedViews = 4;

/// Which: evenly spread.
std::vector<gsnav::Camera> judged_views(const std::vector<gsnav::Camera>& cameras);

/// Float64 images of a scene by the contract's oracle, view after view; kept in the folder that
/// GSNAV_BENCH_REFERENCES names, where it does. Throws gsnav::Error.
const std::vector<gsnav_report::Reference>& references(const gsnav::GaussianCloud& cloud,
                                                       const std::vector<gsnav::Camera>& cameras);

}  // namespace gsnav_bench
