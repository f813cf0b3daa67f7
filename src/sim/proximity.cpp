// SPDX-License-Identifier: Apache-2.0
#include "gsnav/sim/proximity.hpp"

#include <array>
#include <limits>

namespace gsnav {
namespace {

Vec3d position_at(std::span<const WalkPoint> path, double u) {
  if (path.empty()) return {};
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (u < path[i].fraction) {
      const double length = path[i].fraction - path[i - 1].fraction;
      const double k = length > 0 ? (u - path[i - 1].fraction) / length : 1.0;
      return lerp(path[i - 1].position, path[i].position, clamp(k, 0.0, 1.0));
    }
  }
  return path.back().position;
}

}  // namespace

void closest_approach(std::span<const WalkPoint> path, double radius, double height,
                      const CapsuleSet& bodies, std::vector<double>& out) {
  constexpr int kSamples = 8;
  out.assign(bodies.groups().size(), std::numeric_limits<double>::infinity());
  for (std::size_t g = 0; g < out.size(); ++g) {
    const View<const DynamicCapsule> avatar = bodies.capsules_of(bodies.groups()[g]);
    const auto gap = [&](double u) {
      Clearance c;
      nearest_body(agent_capsule(position_at(path, u), radius, height), avatar, u, c);
      return c.distance;
    };
    double best = std::numeric_limits<double>::infinity(), best_u = 0.0;
    const auto offer = [&](double u) {
      const double d = gap(u);
      if (d < best) {
        best = d;
        best_u = u;
      }
    };
    for (int i = 0; i <= kSamples; ++i) offer(static_cast<double>(i) / kSamples);
    for (const WalkPoint& p : path) offer(clamp(p.fraction, 0.0, 1.0));
    // Golden sections around the best sample.
    double low = max(best_u - 1.0 / kSamples, 0.0), high = min(best_u + 1.0 / kSamples, 1.0);
    for (int i = 0; i < 13; ++i) {
      const double a = high - 0.6180339887498949 * (high - low), b = low + high - a;
      const double da = gap(a), db = gap(b);
      best = min(best, min(da, db));
      (da < db ? high : low) = da < db ? b : a;
    }
    out[g] = best;
  }
}

}  // namespace gsnav
