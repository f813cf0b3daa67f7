// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_convert {

/// Largest difference per field between a cloud and its source, row by row. Values are not clamped.
struct FieldErrors {
  double mean = 0;          ///< Metres.
  double scale = 0;         ///< Ratio minus one, over scales that are not zero.
  double scale_metres = 0;  ///< Metres, over all scales.
  double rotation = 0;      ///< Angle between the quaternions, radians.
  double opacity = 0;
  double colour = 0;  ///< Degree 0: 0.5 + kSh0 coefficient.
  double bands = 0;   ///< Higher SH coefficients.
};

/// Compares row source_rows[i] of the source with row made_rows[i] of the result.
FieldErrors largest_field_errors(const gsnav::GaussianCloud& source,
                                 const std::vector<std::uint32_t>& source_rows,
                                 const gsnav::GaussianCloud& made,
                                 const std::vector<std::uint32_t>& made_rows);

struct ImageErrors {
  double psnr = 0;     ///< Over all images, dB for peak 1. Infinity if they are equal.
  double worst = 0;    ///< Smallest PSNR of an image, dB.
  double largest = 0;  ///< Largest difference of a value.
};

/// Renders both clouds from each camera as gsnav-render does: in the cloud's own sort order, with ties
/// of depth in reading order. Values above 1 are compared too.
gsnav::Result<ImageErrors> image_errors(const gsnav::GaussianCloud& source,
                                        const gsnav::GaussianCloud& made,
                                        const std::vector<gsnav::Camera>& cameras);

}  // namespace gsnav_convert
