// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "cache.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_bench {

/// Most views of a workload that are judged.
inline constexpr std::size_t kJudgedViews = 4;

/// The judged views of `cameras`, evenly spread.
std::vector<gsnav::Camera> judged_views(const std::vector<gsnav::Camera>& cameras);

/// Float64 images of a scene by the contract's oracle, one per view. GSNAV_BENCH_REFERENCES, if set,
/// names a folder that caches them. Throws gsnav::Error.
const std::vector<gsnav_report::Reference>& references(const gsnav::GaussianCloud& cloud,
                                                       const std::vector<gsnav::Camera>& cameras);

}  // namespace gsnav_bench
