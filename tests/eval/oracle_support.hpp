// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/eval/oracle_photo.hpp"
#include "gsnav/eval/oracle.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#if defined(_OPENMP)
#include "gsnav/backends/openmp.hpp"
#endif

namespace gsnav_test {

/// What oracles run on when nothing hangs on it.
#if defined(_OPENMP)
struct OracleBackend : gsnav::OpenMPBackend {
  OracleBackend() noexcept : OpenMPBackend(2) {}
};
#else
using OracleBackend = gsnav::SerialBackend;
#endif

/// The float64 image of `sets`, compiled once for all tests (oracle_support.cpp).
gsnav::eval::OracleFrames oracle(const std::vector<gsnav::GaussianSet>& sets,
                                 const gsnav::Camera& camera,
                                 const gsnav::eval::OracleConfig& config = {});

/// Every image and mask bit for bit.
inline bool same_images(const gsnav::eval::OracleFrames& a, const gsnav::eval::OracleFrames& b) {
  return a.width == b.width && a.height == b.height && a.rgb == b.rgb && a.alpha == b.alpha &&
         a.median_depth == b.median_depth && a.expected_depth == b.expected_depth &&
         a.accumulated_depth == b.accumulated_depth && a.first_hit_depth == b.first_hit_depth &&
         a.undecided == b.undecided && a.undecided_depth == b.undecided_depth &&
         a.order_flip == b.order_flip;
}

}  // namespace gsnav_test
