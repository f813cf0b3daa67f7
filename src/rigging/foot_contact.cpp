// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/foot_contact.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace gsnav {

std::vector<Foot> find_feet(const Skeleton& skeleton, double floor) {
  const auto rest = skeleton.rest_globals();
  const std::size_t n = skeleton.size();
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const auto& m : rest) low = min(low, m.translation.y), high = max(high, m.translation.y);
  const double limit = low + 0.1 * (high - low);
  std::vector<bool> is_low(n, false);
  for (std::size_t j = n; j-- > 0;) is_low[j] = rest[j].translation.y < limit;
  for (std::size_t j = n; j-- > 0;) {
    if (!is_low[j] && skeleton.parents[j] >= 0)
      is_low[static_cast<std::size_t>(skeleton.parents[j])] = false;
  }
  std::vector<Foot> feet;
  std::vector<std::size_t> foot_of(n, n);
  for (std::size_t j = 0; j < n; ++j) {
    if (!is_low[j]) continue;
    const std::int32_t parent = skeleton.parents[j];
    if (parent >= 0 && is_low[static_cast<std::size_t>(parent)]) {
      foot_of[j] = foot_of[static_cast<std::size_t>(parent)];
      feet[foot_of[j]].joints.push_back(j);
    } else {
      foot_of[j] = feet.size();
      feet.push_back({{j}, {}});
    }
  }
  for (Foot& foot : feet) {
    // Use the joint of the toes nearest to the ankle, if there are any.
    const std::size_t ankle = foot.joints[0];
    std::size_t ball = ankle;
    Vec3d ahead{0, 0, -0.08 * (high - low)};
    double nearest = std::numeric_limits<double>::max();
    for (const std::size_t j : foot.joints) {
      const Vec3d d = rest[j].translation - rest[ankle].translation;
      const double length = std::hypot(d.x, d.z);
      if (length > 0.02 * (high - low) && length < nearest)
        nearest = length, ball = j, ahead = {d.x, 0, d.z};
    }
    const auto add = [&](std::size_t joint, const Vec3d& place) {
      foot.sole.push_back({joint, rigid_inverse(rest[joint]) * Vec3d{place.x, floor, place.z}});
    };
    add(ankle, rest[ankle].translation - ahead * 0.4);
    add(ball, rest[ankle].translation + ahead);
    add(ball, rest[ankle].translation + ahead * 1.4);
  }
  return feet;
}

std::vector<FootMove> foot_moves(const Foot& foot,
                                 const std::vector<std::vector<Affine3<double>>>& frames,
                                 const std::vector<Vec3d>& bodies, double clearance) {
  const std::size_t points = foot.sole.size();
  std::vector<double> lowest(points, std::numeric_limits<double>::max());
  std::vector<Vec3d> at(points * frames.size());
  for (std::size_t t = 0; t < frames.size(); ++t) {
    for (std::size_t k = 0; k < points; ++k) {
      const SolePoint& p = foot.sole[k];
      at[t * points + k] = frames[t][p.joint] * p.local - Vec3d{0, bodies[t].y, 0};
      lowest[k] = min(lowest[k], at[t * points + k].y);
    }
  }
  std::vector<FootMove> out(frames.size());
  for (std::size_t t = 0; t + 1 < frames.size(); ++t) {
    for (std::size_t k = 0; k < points; ++k) {
      const Vec3d &a = at[t * points + k], &b = at[(t + 1) * points + k];
      if (max(a.y, b.y) > lowest[k] + clearance) continue;
      const Vec3d body = bodies[t + 1] - bodies[t], moved{b.x - a.x, 0, b.z - a.z};
      if (dot(moved - body, body) > 1e-9) continue;
      if (!out[t].down || norm(moved) < norm(out[t].way)) out[t] = {true, moved};
    }
  }
  return out;
}

void FootSlideMeter::add(const std::vector<Affine3<double>>& joints, const Vec3d& body) {
  bodies_.push_back(body);
  frames_.push_back(joints);
}

FootSlide FootSlideMeter::measure(std::size_t first, std::size_t last) const {
  FootSlide out;
  last = std::min(last, frames_.size());
  for (const Foot& foot : feet_) {
    const std::vector<FootMove> moves = foot_moves(foot, frames_, bodies_, clearance_);
    bool down = false;
    double slid = 0.0;
    const auto lift = [&] {
      if (!down) return;
      ++out.contacts;
      out.total += slid;
      out.greatest = max(out.greatest, slid);
      down = false;
      slid = 0.0;
    };
    for (std::size_t t = first; t + 1 < last; ++t) {
      if (!moves[t].down) {
        lift();
      } else {
        down = true;
        slid += norm(moves[t].way);
      }
    }
    lift();
  }
  out.mean = out.contacts == 0 ? 0.0 : out.total / static_cast<double>(out.contacts);
  return out;
}

}  // namespace gsnav
