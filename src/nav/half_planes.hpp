// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <span>

#include "flat.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav::detail {

inline Flat left_of(const Flat& a) noexcept { return {-a.y, a.x}; }

/// Half plane dot(normal, v) >= offset on the ground. For soft ones the offset is reduced by the slack.
struct HalfPlane {
  Flat normal;  ///< Unit vector.
  double offset = 0;
  bool soft = false;
};

/// Point nearest to `wanted` in the disc of radius `limit` and all half planes. Nothing if they have no
/// common point. Half planes are added one by one: if the point violates a new one, the new point lies
/// on its line.
inline std::optional<Flat> nearest_in(std::span<const HalfPlane> planes, const Flat& wanted,
                                      double limit, double slack = 0.0) noexcept {
  constexpr double kTiny = 1e-12;
  const auto offset = [&](const HalfPlane& h) { return h.offset - (h.soft ? slack : 0.0); };
  const double speed = length(wanted);
  Flat v = speed > limit ? wanted * (limit / speed) : wanted;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const double at = offset(planes[i]);
    if (dot(planes[i].normal, v) >= at - kTiny) continue;
    const double room = limit * limit - at * at;
    if (room < 0) return {};
    const Flat foot = planes[i].normal * at, along = left_of(planes[i].normal);
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
