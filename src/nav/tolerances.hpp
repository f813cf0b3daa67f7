// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <numbers>

namespace gsnav::detail {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kPi = std::numbers::pi;
/// Tolerance for rounding, in metres, m², radians or relative. What only touches counts.
inline constexpr double kRounding = 1e-9;
/// Points closer than this are equal, metres.
inline constexpr double kSame = 1e-9;

}  // namespace gsnav::detail
