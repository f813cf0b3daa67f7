// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_bench {

/// What is rendered: the files that GSNAV_BENCH_SCENE and GSNAV_BENCH_CAMERAS name, or without them the
/// embedded flat from its four viewpoints.
struct Workload {
  gsnav::GaussianCloud cloud;
  std::vector<gsnav::Camera> cameras;  ///< at some size; `sized` gives the others
};

const Workload& workload();

/// Its cloud without the SH bands above degree 0.
const gsnav::GaussianCloud& base_color_cloud();

/// The cameras at another size: the same horizontal field of view, centred.
std::vector<gsnav::Camera> sized(int width, int height);

}  // namespace gsnav_bench
