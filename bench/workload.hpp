// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_bench {

/// The rendered scene: the files that GSNAV_BENCH_SCENE and GSNAV_BENCH_CAMERAS name, or without them
/// the embedded flat from its four viewpoints.
struct Workload {
  gsnav::GaussianCloud cloud;
  std::vector<gsnav::Camera> cameras;  ///< at some size; sized() gives other sizes
};

const Workload& workload();

/// The workload's cloud without the SH bands above degree 0.
const gsnav::GaussianCloud& base_color_cloud();

/// The cameras at another size, centred, with the same horizontal field of view.
std::vector<gsnav::Camera> sized(int width, int height);

/// Most views of a workload whose images are compared with float64.
inline constexpr std::size_t kJudgedViews = 4;

/// The views of `cameras` that every program compares with float64, evenly spread: 0, 16, 32 and 48
/// of 64.
std::vector<gsnav::Camera> judged_views(const std::vector<gsnav::Camera>& cameras);

}  // namespace gsnav_bench
