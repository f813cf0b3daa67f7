// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "gsnav/frame/gaussians.hpp"

// Reading stored rows for the oracles, written from the description of the encodings (ShapeRows,
// ColorRows). Codes become float32 values, as in every renderer. All later steps are in long double.

namespace gsnav::eval::detail {

using Real = long double;

/// Three numbers. Arithmetic of its own, so that the oracles share none with the kernels.
template <class T>
struct Triple {
  T x{}, y{}, z{};

  friend Triple operator*(T s, const Triple& a) noexcept { return {s * a.x, s * a.y, s * a.z}; }
  friend Triple operator+(const Triple& a, const Triple& b) noexcept {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
};
using Real3 = Triple<Real>;
using Double3 = Triple<double>;

/// Value of an IEEE binary16.
inline float half_value(std::uint16_t bits) noexcept {
  const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
  float value = std::ldexp(static_cast<float>(exponent == 0 ? mantissa : 1024 + mantissa),
                           std::max(exponent, 1) - 25);
  if (exponent == 31) {
    value =
        mantissa == 0 ? std::numeric_limits<float>::infinity() : std::numeric_limits<float>::quiet_NaN();
  }
  return bits >> 15 == 0 ? value : -value;
}

/// Rows that share the constants of one PackedChunk.
inline constexpr std::size_t kStoredChunk = 256;

/// One row's shape as it is stored. Planes of codes: three of scales, three of the rotation, one of the
/// opacity, three of the mean.
struct StoredShape {
  const ShapeRows& rows;
  std::size_t row;

  const PackedChunk& chunk() const noexcept { return rows.chunks[row / kStoredChunk]; }
  int code(int plane) const noexcept {
    return rows.codes[static_cast<std::size_t>(plane) * rows.size + row];
  }
  /// Whether the shape is columns of M instead of a rotation and scales.
  bool has_columns() const noexcept { return rows.axes[0].size != 0; }
  /// Columns of M in the asset's frame, metres, if has_columns().
  std::array<Real3, 3> columns() const noexcept {
    std::array<Real3, 3> out;
    for (std::size_t k = 0; k < 3; ++k)
      out[k] = {rows.axes[k][row], rows.axes[3 + k][row], rows.axes[6 + k][row]};
    return out;
  }
  /// Offset from the row's origin, metres.
  Real3 mean() const noexcept {
    if (!rows.means.empty()) return {rows.means[0][row], rows.means[1][row], rows.means[2][row]};
    const Vec3<float>&low = chunk().low, &step = chunk().step;
    const auto at = [this](float base, float steps, int plane) {
      return std::fma(steps, static_cast<float>(code(plane)), base);
    };
    return {at(low.x, step.x, 7), at(low.y, step.y, 8), at(low.z, step.z, 9)};
  }
  /// Standard deviations, metres.
  std::array<Real, 3> scales() const noexcept {
    std::array<Real, 3> out;
    for (int k = 0; k < 3; ++k) {
      const std::size_t plane = static_cast<std::size_t>(k);
      if (rows.codes.empty()) {
        out[plane] = rows.scales[plane][row];
      } else {
        const float root = static_cast<float>(code(k)) * chunk().scale_step;
        out[plane] = root * root;
      }
    }
    return out;
  }
  /// Rotation w, x, y, z. Packed: three components of 15 bits, without the largest, whose index is in
  /// the lowest bits of the first two codes.
  std::array<Real, 4> quat() const noexcept {
    if (rows.codes.empty())
      return {rows.quats[0][row], rows.quats[1][row], rows.quats[2][row], rows.quats[3][row]};
    constexpr float kMiddle = 16383, kStep = 0.70710678118654752f / kMiddle;
    std::array<Real, 4> out;
    const std::size_t missing = static_cast<std::size_t>((code(3) & 1) + 2 * (code(4) & 1));
    float rest = 1;
    std::array<float, 3> stored;
    for (int k = 2; k >= 0; --k) {
      const float v = (static_cast<float>(code(3 + k) >> 1) - kMiddle) * kStep;
      stored[static_cast<std::size_t>(k)] = v;
      rest = std::fma(-v, v, rest);
    }
    for (std::size_t k = 0, next = 0; k < 4; ++k)
      out[k] = k == missing ? std::sqrt(std::max(rest, 0.0f)) : stored[next++];
    return out;
  }
  Real opacity() const noexcept {
    if (rows.codes.empty()) return rows.opacities[row];
    return static_cast<float>(code(6)) / 65535.0f;
  }
};

/// SH coefficient k of a row.
inline Real3 stored_coefficient(const ColorRows& rows, std::size_t row, int k) noexcept {
  const auto three = [](std::size_t at, const auto& value) {
    return Real3{value(at), value(at + 1), value(at + 2)};
  };
  const auto half_of = [](const View<const std::uint16_t>& from) {
    return [&from](std::size_t at) { return half_value(from[at]); };
  };
  if (k == 0) {
    if (!rows.sh0_half.empty()) return three(3 * row, half_of(rows.sh0_half));
    return three(3 * row, [&](std::size_t at) { return rows.sh0[at]; });
  }
  const std::size_t above = static_cast<std::size_t>((rows.degree + 1) * (rows.degree + 1) - 1);
  const std::size_t at = 3 * (above * row + static_cast<std::size_t>(k - 1));
  if (!rows.shN_codes.empty()) {
    const float step = rows.chunks[row / kStoredChunk].sh_steps[k < 4 ? 0 : k < 9 ? 1 : 2];
    return three(at, [&](std::size_t i) { return static_cast<float>(rows.shN_codes[i]) * step; });
  }
  if (!rows.shN_half.empty()) return three(at, half_of(rows.shN_half));
  return three(at, [&](std::size_t i) { return rows.shN[i]; });
}

}  // namespace gsnav::eval::detail
