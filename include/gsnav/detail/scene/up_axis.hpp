// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gsnav/core/status.hpp"
#include "gsnav/math/similarity.hpp"

namespace gsnav {

/// The rotation about the origin that takes an axis ("x", "y" or "z", with an optional sign) to +Y.
/// Error: invalid_argument for another name.
inline Result<Similarity> upright(std::string_view axis) {
  const bool negative = axis.starts_with('-');
  const std::string_view letter = negative || axis.starts_with('+') ? axis.substr(1) : axis;
  constexpr double kQuarter = 0.70710678118654752;  // sine and cosine of 45 degrees
  Similarity out;
  if (letter == "y") {
    out.rotation = negative ? Quatd{0, 1, 0, 0} : Quatd{};
  } else if (letter == "z") {
    out.rotation = {kQuarter, negative ? kQuarter : -kQuarter, 0, 0};
  } else if (letter == "x") {
    out.rotation = {kQuarter, 0, 0, negative ? -kQuarter : kQuarter};
  } else {
    return {Errc::invalid_argument,
            "axis '" + std::string(axis) + "': must be x, y or z, with an optional sign"};
  }
  return out;
}

/// The name of a unit axis, as upright() takes it; "y" for a zero vector.
inline std::string axis_name(const Vec3d& axis) {
  for (int k = 0; k < 3; ++k) {
    if (axis[k] != 0) return std::string(axis[k] < 0 ? "-" : "") + "xyz"[k];
  }
  return "y";
}

}  // namespace gsnav
