// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/foot_lock.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/detail/math/easing.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

namespace {

/// The smallest rotation that takes direction a to direction b; none if they are opposite.
Quatd turn_between(const Vec3d& a, const Vec3d& b) noexcept {
  const Vec3d u = normalized(a), v = normalized(b), axis = cross(u, v);
  Quatd q{1 + dot(u, v), axis.x, axis.y, axis.z};
  return normalize(q) ? q : Quatd{};
}

/// Moves the ankle by `offset` by rotating thigh and shin in the plane of the leg. The foot keeps its
/// orientation. Returns the distance by which the leg was too short.
double reach(const LegJoints& leg, const Vec3d& offset, std::vector<Affine3<double>>& joints) {
  const Vec3d hip = joints[leg.hip].translation, knee = joints[leg.knee].translation,
              ankle = joints[leg.ankle].translation;
  const double thigh = norm(knee - hip), shin = norm(ankle - knee);
  Vec3d goal = ankle + offset;
  const double longest = 0.9995 * (thigh + shin), wanted = norm(goal - hip);
  const double distance =
      clamp(wanted, abs(thigh - shin) * 1.001 + 1e-6, max(longest, norm(ankle - hip)));
  goal = hip + (goal - hip) * (distance / max(wanted, 1e-9));
  // Keep the knee on its side of the line from hip to ankle.
  const Quatd swing = turn_between(ankle - hip, goal - hip);
  const Vec3d line = normalized(goal - hip);
  Vec3d side = rotate(swing, knee - hip);
  side -= line * dot(side, line);
  if (norm(side) < 1e-4)
    side = Vec3d{-joints[leg.knee].linear(0, 2), -joints[leg.knee].linear(1, 2),
                 -joints[leg.knee].linear(2, 2)};
  side -= line * dot(side, line);
  const double along = (thigh * thigh - shin * shin + distance * distance) / (2 * distance);
  const Vec3d bent =
      hip + line * along + normalized(side) * std::sqrt(max(0.0, thigh * thigh - along * along));
  const Mat3d upper = rotation_matrix(turn_between(knee - hip, bent - hip)),
              lower = rotation_matrix(turn_between(ankle - knee, goal - bent));
  for (const std::size_t j : leg.thigh)
    joints[j] = {upper * joints[j].linear, hip + upper * (joints[j].translation - hip)};
  for (const std::size_t j : leg.shin)
    joints[j] = {lower * joints[j].linear, bent + lower * (joints[j].translation - knee)};
  for (const std::size_t j : leg.foot) joints[j].translation += goal - ankle;
  return max(0.0, wanted - distance);
}

}  // namespace

Result<std::vector<LegJoints>> find_legs(const Skeleton& skeleton, const std::vector<Foot>& feet) {
  const BadArgument bad{"find_legs: "};
  if (feet.size() != 2) return bad(std::to_string(feet.size()) + " feet, must be 2");
  const auto rest = skeleton.rest_globals();
  const auto above = [&](std::size_t j) {  // j first, then its ancestors
    std::vector<std::size_t> out{j};
    while (skeleton.parents[out.back()] >= 0)
      out.push_back(static_cast<std::size_t>(skeleton.parents[out.back()]));
    return out;
  };
  std::vector<LegJoints> legs;
  for (std::size_t f = 0; f < 2; ++f) {
    const std::vector<std::size_t> chain = above(feet[f].joints[0]),
                                   other = above(feet[1 - f].joints[0]);
    LegJoints leg;
    leg.ankle = chain[0];
    std::size_t top = 0;  // the highest joint that does not carry the other foot too
    while (top + 1 < chain.size() &&
           std::find(other.begin(), other.end(), chain[top + 1]) == other.end())
      ++top;
    leg.hip = chain[top];
    // Take the joint nearest to half of the leg's length as the knee.
    double length = 0.0;
    std::vector<double> at{0.0};
    for (std::size_t k = 1; k <= top; ++k) {
      at.push_back(length += norm(rest[chain[k]].translation - rest[chain[k - 1]].translation));
    }
    std::size_t knee = 0;
    for (std::size_t k = 1; k < top; ++k) {
      if (knee == 0 || abs(at[k] - 0.5 * length) < abs(at[knee] - 0.5 * length)) knee = k;
    }
    if (knee == 0) return bad("joint \"" + skeleton.names[leg.hip] + "\" has no knee below it");
    leg.knee = chain[knee];
    for (std::size_t j = leg.hip; j < skeleton.size(); ++j) {
      const std::vector<std::size_t> up = above(j);
      const auto carried_by = [&](std::size_t k) {
        return std::find(up.begin(), up.end(), k) != up.end();
      };
      if (!carried_by(leg.hip)) continue;
      (carried_by(leg.ankle) ? leg.foot : carried_by(leg.knee) ? leg.shin : leg.thigh).push_back(j);
    }
    legs.push_back(std::move(leg));
  }
  return legs;
}

Result<FootLockReport> lock_feet(const Skeleton& skeleton, const std::vector<Foot>& feet,
                                 double frame_rate, const std::vector<Vec3d>& bodies,
                                 std::vector<std::vector<Affine3<double>>>& frames,
                                 const FootLockOptions& options) {
  const auto legs = find_legs(skeleton, feet);
  if (!legs) return legs.status();
  const std::size_t count = frames.size();
  if (bodies.size() != count) {
    return {Errc::invalid_argument, "lock_feet: " + std::to_string(bodies.size()) + " bodies for " +
                                        std::to_string(count) + " frames"};
  }
  FootLockReport report;
  if (count < 2) return report;
  const auto least = static_cast<std::size_t>(max(1.0, options.shortest * frame_rate));
  for (std::size_t f = 0; f < feet.size(); ++f) {
    const std::vector<FootMove> moves = foot_moves(feet[f], frames, bodies, options.clearance);
    // Spans of frames in which the foot is down. Short gaps and short spans are noise.
    std::vector<std::pair<std::size_t, std::size_t>> spans;
    for (std::size_t t = 0; t + 1 < count; ++t) {
      if (!moves[t].down) continue;
      if (!spans.empty() && t - spans.back().second < least) {
        spans.back().second = t + 1;
      } else {
        spans.emplace_back(t, t + 1);
      }
    }
    std::erase_if(spans, [&](const auto& s) { return s.second - s.first < least; });
    if (spans.empty()) continue;
    std::vector<Vec3d> offsets(count);
    for (const auto& [first, last] : spans) {
      for (std::size_t t = first; t < last; ++t) {
        offsets[t + 1] = offsets[t] - moves[t].way;
      }
      // Centre the offsets, so that the foot moves equally far to both sides.
      Vec3d low = offsets[first], high = low;
      for (std::size_t t = first; t <= last; ++t) {
        for (int k = 0; k < 3; ++k)
          low[k] = min(low[k], offsets[t][k]), high[k] = max(high[k], offsets[t][k]);
      }
      for (std::size_t t = first; t <= last; ++t) {
        offsets[t] -= (low + high) * 0.5;
        const double size = norm(offsets[t]);
        if (size > options.furthest) offsets[t] = offsets[t] * (options.furthest / size);
      }
    }
    for (std::size_t s = 0; s <= spans.size(); ++s) {
      const std::size_t from = s == 0 ? 0 : spans[s - 1].second,
                        to = s == spans.size() ? count - 1 : spans[s].first;
      const Vec3d a = offsets[s == 0 ? to : from], b = offsets[s == spans.size() ? from : to];
      for (std::size_t t = from; t <= to && to > from; ++t) {
        const double u = static_cast<double>(t - from) / static_cast<double>(to - from);
        offsets[t] = lerp(a, b, smoothstep(u));
      }
    }
    for (std::size_t t = 0; t < count; ++t) {
      report.moved = max(report.moved, norm(offsets[t]));
      report.out_of_reach = max(report.out_of_reach, reach((*legs)[f], offsets[t], frames[t]));
    }
  }
  return report;
}

}  // namespace gsnav
