// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <span>

#include "gsnav/math/functions.hpp"

namespace gsnav::detail {

/// Vector on the ground plane.
struct Ground {
  double x = 0, z = 0;
};
inline Ground operator+(const Ground& a, const Ground& b) noexcept { return {a.x + b.x, a.z + b.z}; }
inline Ground operator-(const Ground& a, const Ground& b) noexcept { return {a.x - b.x, a.z - b.z}; }
inline Ground operator*(const Ground& a, double s) noexcept { return {a.x * s, a.z * s}; }
inline double dot(const Ground& a, const Ground& b) noexcept { return a.x * b.x + a.z * b.z; }
inline double det(const Ground& a, const Ground& b) noexcept { return a.x * b.z - a.z * b.x; }
inline double length(const Ground& a) noexcept { return std::sqrt(dot(a, a)); }
inline Ground left_of(const Ground& a) noexcept { return {-a.z, a.x}; }

/// Half plane dot(normal, v) >= offset. For soft ones the offset is reduced by the slack.
struct HalfPlane {
  Ground normal;  ///< Unit vector.
  double offset = 0;
  bool soft = false;
};

/// Point nearest to `wanted` in the disc of radius `limit` and all half planes. Nothing if they have no
/// common point. Half planes are added one by one: if the point violates a new one, the new point lies
/// on its line.
inline std::optional<Ground> nearest_in(std::span<const HalfPlane> planes, const Ground& wanted,
                                        double limit, double slack = 0.0) noexcept {
  constexpr double kTiny = 1e-12;
  const auto offset = [&](const HalfPlane& h) { return h.offset - (h.soft ? slack : 0.0); };
  const double speed = length(wanted);
  Ground v = speed > limit ? wanted * (limit / speed) : wanted;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const double at = offset(planes[i]);
    if (dot(planes[i].normal, v) >= at - kTiny) continue;
    const double room = limit * limit - at * at;
    if (room < 0) return {};
    const Ground foot = planes[i].normal * at, along = left_of(planes[i].normal);
    double high = std::sqrt(room), low = -high;
    for (std::size_t j = 0; j < i; ++j) {
      const double rate = dot(planes[j].normal, along),
                   missing = offset(planes[j]) - dot(planes[j].normal, foot);
      if (std::abs(rate) < kTiny) {
        if (missing > kTiny) return {};
      } else if (rate > 0) {
        low = max(low, missing / rate);
      } else {
        high = min(high, missing / rate);
      }
    }
    if (low > high) return {};
    v = foot + along * clamp(dot(along, wanted), low, high);
  }
  return v;
}

}  // namespace gsnav::detail
