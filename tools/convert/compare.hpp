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

/// How far a cloud is from the one that it was made of, row by row: the largest of each field. Nothing
/// is clamped.
struct FieldErrors {
  double mean = 0;          ///< metres
  double scale = 0;         ///< ratio minus one, of scales that are not zero
  double scale_metres = 0;  ///< of all
  double rotation = 0;      ///< angle between the quaternions, radians
  double opacity = 0;
  double colour = 0;  ///< of degree 0: 0.5 + kSh0 coefficient
  double bands = 0;   ///< of a higher SH coefficient
};

/// Row source_rows[i] of the source became row made_rows[i].
FieldErrors largest_field_errors(const gsnav::GaussianCloud& source,
                                 const std::vector<std::uint32_t>& source_rows,
                                 const gsnav::GaussianCloud& made,
                                 const std::vector<std::uint32_t>& made_rows);

struct ImageErrors {
  double psnr = 0;     ///< over all images, dB of 1; infinite where they are the same
  double worst = 0;    ///< of one image
  double largest = 0;  ///< difference of a value
};

/// Renders both from each camera as gsnav-render does: each in its own sort order, ties of depth in the
/// order in which it was read. Values above 1 are compared too.
gsnav::Result<ImageErrors> image_errors(const gsnav::GaussianCloud& source,
                                        const gsnav::GaussianCloud& made,
                                        const std::vector<gsnav::Camera>& cameras);

}  // namespace gsnav_convert
