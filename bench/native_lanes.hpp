// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

// Kernels over the processor's own lane pack, compiled with its own instruction set. They measure a
// kernel in lanes whatever the instruction set of the rest of the program.

namespace gsnav_bench {

/// Input and output of the SH kernel for N Gaussians, one array per coordinate.
struct ShPlanes {
  const float* coefficients;  ///< [K][3][N]
  const float* deltas[3];     ///< Gaussian - camera, any length, [N] each
  float* colors[3];           ///< [N] each
  std::size_t size;           ///< N
};

/// Floats in a pack.
int native_width() noexcept;

/// SH colours of the Gaussians [begin, end), with the same bits as gaussian_color. `begin` and `end` are
/// multiples of native_width().
void native_sh(const ShPlanes& planes, int degree, std::size_t begin, std::size_t end) noexcept;

/// Polar rotations of the matrices [begin, end), with the same bits as polar_rotation. `begin` and `end`
/// are multiples of native_width(). `in`, `out`: nine planes, row by row.
void native_polar(const float* const (&in)[9], float* const (&out)[9], std::size_t begin,
                  std::size_t end) noexcept;

}  // namespace gsnav_bench
