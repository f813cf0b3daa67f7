// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "cache.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "workload.hpp"

namespace gsnav_bench {

/// Float64 images of a scene by the contract's oracle, one per view of judged_views(cameras).
/// GSNAV_BENCH_REFERENCES, if set, names a folder that caches them. Throws gsnav::Error.
const std::vector<gsnav_report::Reference>& references(const gsnav::GaussianCloud& cloud,
                                                       const std::vector<gsnav::Camera>& cameras);

}  // namespace gsnav_bench
