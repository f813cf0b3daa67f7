// SPDX-License-Identifier: Apache-2.0
#include "gsnav/sim/proximity.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "gsnav/sim/metrics.hpp"

namespace gsnav {
namespace {

constexpr double kRounding = 1e-9;

void add_capsule(Aabb<double>& box, const Capsule<double>& c) {
  for (const Vec3d& p : {c.p0, c.p1}) {
    box.add(p - Vec3d{c.radius, c.radius, c.radius});
    box.add(p + Vec3d{c.radius, c.radius, c.radius});
  }
}

/// Nothing in one box is nearer to anything in the other than this; overlap has no bound.
double least_distance(const Aabb<double>& a, const Aabb<double>& b) {
  double square = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double gap = max(max(b.low[k] - a.high[k], a.low[k] - b.high[k]), 0.0);
    square += gap * gap;
  }
  return square > 0 ? sqrt(square) - kRounding : -std::numeric_limits<double>::infinity();
}

/// How fast a point of a body moves at most, metres a tick: points between the ends are no faster than those.
double speed_of(const MovingCapsule<double>& m) {
  return max(norm(m.end.p0 - m.begin.p0), norm(m.end.p1 - m.begin.p1)) + abs(m.end.radius - m.begin.radius);
}

/// How far whoever walks along `path` goes.
double length_of(std::span<const WalkPoint> path) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length += norm(path[i].position - path[i - 1].position);
  return length;
}

struct Scratch {
  std::vector<double> bounds;  // of each of an avatar's capsules
  std::vector<std::size_t> order;
};

/// One avatar's least distance during the tick.
class Approach {
 public:
  Approach(std::span<const WalkPoint> path, double agent_length, double radius, double height,
           Scratch& scratch)
      : path_(path),
        agent_length_(agent_length),
        radius_(radius),
        height_(height),
        bounds_(scratch.bounds) {}

  /// Looks at the boxes that the agent (`reach`) and the avatar's capsules sweep; returns a lower bound of find().
  double look(const Aabb<double>& reach, View<const DynamicCapsule> avatar) {
    avatar_ = avatar;
    bounds_.resize(avatar.size);
    nearest_ = 0;
    for (std::size_t c = 0; c < avatar.size; ++c) {
      Aabb<double> box;
      add_capsule(box, avatar[c].motion.begin);
      add_capsule(box, avatar[c].motion.end);
      bounds_[c] = least_distance(reach, box);
      if (bounds_[c] < bounds_[nearest_]) nearest_ = c;
    }
    return bounds_[nearest_];
  }

  /// After look(): the least distance. Capsules that stay farther away than what was found are not
  /// looked at.
  double find() const {
    double best = pass(avatar_[nearest_].motion, std::numeric_limits<double>::infinity());
    for (std::size_t c = 0; c < avatar_.size; ++c) {
      if (c != nearest_ && bounds_[c] <= best) best = pass(avatar_[c].motion, best);
    }
    return best;
  }

 private:
  /// The least of `best` and the gap to one capsule, leg by leg.
  double pass(const MovingCapsule<double>& body, double best) const {
    const double tolerance = kTolerance + kShare * (agent_length_ + speed_of(body));
    const WalkPoint start{path_.empty() ? Vec3d{} : path_.front().position, kNoPoly, 0.0};
    WalkPoint from = start;
    for (std::size_t i = 0; i <= path_.size(); ++i) {
      // It stands still after the last point.
      const WalkPoint to = i < path_.size() ? path_[i] : WalkPoint{from.position, kNoPoly, 1.0};
      if (to.fraction > from.fraction || i == path_.size()) {
        const double u0 = clamp(from.fraction, 0.0, 1.0), u1 = clamp(to.fraction, 0.0, 1.0);
        const Vec3d origin = from.position;
        const auto local = [&](Capsule<double> c) {
          c.p0 -= origin;
          c.p1 -= origin;
          return c;
        };
        const MovingCapsule<double> agent{local(agent_capsule(from.position, radius_, height_)),
                                          local(agent_capsule(to.position, radius_, height_))};
        best = least_gap<double>(
            agent, {local(lerp(body.begin, body.end, u0)), local(lerp(body.begin, body.end, u1))}, best,
            tolerance);
      }
      from = to;
    }
    return best;
  }

  static constexpr double kTolerance = 1e-6;  // metres
  static constexpr double kShare = 1e-4;      // of what both move in a tick

  std::span<const WalkPoint> path_;
  double agent_length_, radius_, height_;
  std::vector<double>& bounds_;
  View<const DynamicCapsule> avatar_;
  std::size_t nearest_ = 0;  // by bounds
};

}  // namespace

void closest_approach(std::span<const WalkPoint> path, double radius, double height, const CapsuleSet& bodies,
                      std::vector<double>& out) {
  const std::span<const CapsuleSet::Group> groups = bodies.groups();
  out.resize(groups.size());
  if (groups.empty()) return;
  Aabb<double> reach;
  for (const WalkPoint& p : path) add_capsule(reach, agent_capsule(p.position, radius, height));
  if (path.empty()) add_capsule(reach, agent_capsule({}, radius, height));
  for (std::size_t g = 0; g < groups.size(); ++g) out[g] = least_distance(reach, groups[g].swept);
  // Whoever may be nearest first: the others are then known to be farther.
  thread_local Scratch scratch;
  std::vector<std::size_t>& order = scratch.order;
  order.resize(groups.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return out[a] < out[b]; });
  const double length = length_of(path);
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t g : order) {
    if (out[g] > max(least, kPersonalSpace)) break;
    Approach approach(path, length, radius, height, scratch);
    out[g] = max(out[g], approach.look(reach, bodies.capsules_of(groups[g])));
    if (out[g] > max(least, kPersonalSpace)) continue;
    out[g] = approach.find();
    least = min(least, out[g]);
  }
}

}  // namespace gsnav
