// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/kernels/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_convert {

/// The rows of a cloud in another order: row i of the result is row order[i].
gsnav::GaussianCloud in_order(const gsnav::GaussianCloud& cloud,
                              const std::vector<std::uint32_t>& order);

/// How far a cloud is from the one that it was made of, row by row: the largest of each field.
struct FieldErrors {
  double mean = 0;      ///< metres
  double scale = 0;     ///< ratio minus one, of scales above 0.1 mm
  double rotation = 0;  ///< angle between the quaternions, radians
  double opacity = 0;
  double colour = 0;  ///< of degree 0, as drawn, within [0, 1]
  double bands = 0;   ///< of a higher SH coefficient
};

/// Rows must be in the same order.
FieldErrors largest_field_errors(const gsnav::GaussianCloud& source, const gsnav::GaussianCloud& made);

/// Views around the middle of a scene, its outliers left out: y down, as in a PLY.
std::vector<gsnav::Camera> views_around(const gsnav::GaussianCloud& cloud, int count, int width,
                                        int height);

struct ImageErrors {
  double psnr = 0;   ///< over all images, dB; infinite where they are the same
  double worst = 0;  ///< of one image
};

/// Renders both from each camera.
gsnav::Result<ImageErrors> image_errors(const gsnav::GaussianCloud& source,
                                        const gsnav::GaussianCloud& made,
                                        const std::vector<gsnav::Camera>& cameras);

}  // namespace gsnav_convert
