// SPDX-License-Identifier: Apache-2.0
#pragma once

// Measuring errors: float64 oracles, and metrics of images and depths. Link gsnav::eval for SSIM and
// FLIP.

#include "gsnav/detail/eval/depth_error.hpp"
#include "gsnav/detail/eval/flip.hpp"
#include "gsnav/detail/eval/oracle_blend.hpp"
#include "gsnav/detail/eval/oracle_config.hpp"
#include "gsnav/detail/eval/oracle_gaussian.hpp"
#include "gsnav/detail/eval/oracle_photo.hpp"
#include "gsnav/detail/eval/oracle_project.hpp"
#include "gsnav/detail/eval/oracle_ray.hpp"
#include "gsnav/detail/eval/samples.hpp"
#include "gsnav/detail/eval/ssim.hpp"
#include "gsnav/eval/image_error.hpp"
#include "gsnav/eval/oracle.hpp"
