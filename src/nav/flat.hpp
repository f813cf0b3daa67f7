// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

// Vectors in a plane. Without fused multiply-add, which is a function call if the processor may lack it.

namespace gsnav::detail {

/// Vector in the plane of a face, or on the ground with (x, z) as (x, y).
struct Flat {
  double x = 0, y = 0;
};
inline Flat operator-(const Flat& a, const Flat& b) noexcept { return {a.x - b.x, a.y - b.y}; }
inline Flat operator+(const Flat& a, const Flat& b) noexcept { return {a.x + b.x, a.y + b.y}; }
inline Flat operator*(const Flat& a, double s) noexcept { return {a.x * s, a.y * s}; }
inline double cross(const Flat& a, const Flat& b) noexcept { return a.x * b.y - a.y * b.x; }
inline double dot(const Flat& a, const Flat& b) noexcept { return a.x * b.x + a.y * b.y; }
inline double length(const Flat& a) noexcept { return std::sqrt(dot(a, a)); }

}  // namespace gsnav::detail
