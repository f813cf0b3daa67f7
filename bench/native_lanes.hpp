// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

// Kernels over the lane pack that this processor has, compiled with its own instruction set: what an
// isolated kernel gives in lanes, whatever the instruction set of the rest.

namespace gsnav_bench {

/// Arrays of N Gaussians by planes.
struct ShPlanes {
  const float* coefficients;  ///< [K][3][N]
  const float* deltas[3];     ///< Gaussian - camera, any length, [N] each
  float* colors[3];           ///< [N] each
  std::size_t size;           ///< N
};

/// Floats in a pack.
int native_width() noexcept;

/// SH colours of the Gaussians [begin, end), both multiples of native_width(): the bits of
/// gaussian_color.
void native_sh(const ShPlanes& planes, int degree, std::size_t begin, std::size_t end) noexcept;

/// Polar rotations of the matrices [begin, end), both multiples of native_width(): the bits of
/// polar_rotation. `in`, `out`: nine planes, row by row.
void native_polar(const float* const (&in)[9], float* const (&out)[9], std::size_t begin,
                  std::size_t end) noexcept;

}  // namespace gsnav_bench
