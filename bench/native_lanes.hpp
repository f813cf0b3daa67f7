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

/// SH colours of the Gaussians [begin, end), both multiples of native_width(): the bits of gaussian_color.
void native_sh(const ShPlanes& planes, int degree, std::size_t begin, std::size_t end) noexcept;

/// Polar rotations of the matrices [begin, end), both multiples of native_width(): the bits of
/// polar_rotation. `in`, `out`: nine planes, row by row.
void native_polar(const float* const (&in)[9], float* const (&out)[9], std::size_t begin,
                  std::size_t end) noexcept;

/// Pairs of moving capsules by planes: agent then body, each begin then end, each p0, p1 (x, y, z) and radius.
inline constexpr std::size_t kCapsulePlanes = 28;

/// Gaps at the begin of the pairs [begin, end), both multiples of native_width(): the bits of capsule_gap.
void native_gap(const float* const (&planes)[kCapsulePlanes], float* gaps, std::size_t begin,
                std::size_t end) noexcept;

/// Times at which the agents rest: the bits of sweep.
void native_sweep(const float* const (&planes)[kCapsulePlanes], float* times, std::size_t begin,
                  std::size_t end) noexcept;

}  // namespace gsnav_bench
