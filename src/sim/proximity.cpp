// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/proximity.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "gsnav/detail/nav/position_at.hpp"
#include "gsnav/sim/metrics.hpp"

namespace gsnav {
namespace {

constexpr double kRounding = 1e-9;

/// Lower bound of the distance between objects in two boxes. If the boxes overlap, -infinity.
double least_distance(const Aabb<double>& a, const Aabb<double>& b) {
  const double square = distance2(a, b);
  return square > 0 ? sqrt(square) - kRounding : -std::numeric_limits<double>::infinity();
}

/// Largest speed of any point of a body, metres per tick. It occurs at an end of the segment.
double speed_of(const MovingCapsule<double>& m) {
  return max(norm(m.end.p0 - m.begin.p0), norm(m.end.p1 - m.begin.p1)) +
         abs(m.end.radius - m.begin.radius);
}

/// Largest speed of an agent on `path`, metres per tick. Infinity if the path jumps.
double speed_of(std::span<const WalkPoint> path) {
  double speed = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double length = norm(path[i].position - path[i - 1].position);
    const double time = path[i].fraction - path[i - 1].fraction;
    if (length > 0)
      speed = time > 0 ? max(speed, length / time) : std::numeric_limits<double>::infinity();
  }
  return speed;
}

/// Length of the path, metres.
double length_of(std::span<const WalkPoint> path) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) length += norm(path[i].position - path[i - 1].position);
  return length;
}

/// A capsule near the agent: the largest speed at which the two approach each other (metres per tick),
/// and their gap (metres) at the start of the tick, at its end and at the last evaluation.
struct Near {
  const DynamicCapsule* body;
  double speed, first, last, gap;
};

struct Scratch {
  std::vector<Near> near;
  std::vector<double> bounds;  // One per capsule of an avatar.
  std::vector<std::size_t> order;
};

/// Computes the smallest distance to one avatar during the tick. A gap changes no faster than both move,
/// so capsules that cannot come nearer than the best distance so far are skipped.
class Approach {
 public:
  Approach(std::span<const WalkPoint> path, double agent_speed, double agent_length, double radius,
           double height, Scratch& scratch)
      : path_(path),
        agent_speed_(agent_speed),
        agent_length_(agent_length),
        radius_(radius),
        height_(height),
        scratch_(scratch),
        near_(scratch.near) {}

  /// Bounds the distance by boxes: `reach` is the box that the agent sweeps. Returns a lower bound of
  /// find().
  double look(const Aabb<double>& reach, View<const DynamicCapsule> avatar) {
    avatar_ = avatar;
    scratch_.bounds.resize(avatar.size);
    nearest_ = 0;
    for (std::size_t c = 0; c < avatar.size; ++c) {
      Aabb<double> box;
      add_capsule(box, avatar[c].motion.begin);
      add_capsule(box, avatar[c].motion.end);
      scratch_.bounds[c] = least_distance(reach, box);
      if (scratch_.bounds[c] < scratch_.bounds[nearest_]) nearest_ = c;
    }
    return scratch_.bounds[nearest_];
  }

  /// Computes the smallest distance. Call after look(). It samples a few times for a good candidate,
  /// then proves for each leg that nothing is nearer or finds how near it is.
  double find() {
    double best = sampled();
    for (std::size_t c = 0; c < avatar_.size; ++c) {
      if (scratch_.bounds[c] <= best) best = pass(avatar_[c].motion, best);
    }
    return best;
  }

 private:
  /// Distance at one of several sampled times, almost always the smallest.
  double sampled() {
    // Skip capsules whose bound exceeds the distance of the nearest one at the start.
    const auto take = [this](std::size_t c) {
      const double speed = agent_speed_ + speed_of(avatar_[c].motion);
      near_.push_back({&avatar_[c], speed * (1 + kRounding) + kRounding, 0.0, 0.0, 0.0});
    };
    near_.clear();
    take(nearest_);
    const double most = gap(0.0);
    near_.clear();
    for (std::size_t c = 0; c < avatar_.size; ++c) {
      if (scratch_.bounds[c] <= most) take(c);
    }
    constexpr int kSamples = 8;
    offer(0.0);
    for (Near& n : near_) n.first = n.gap;
    offer(1.0);
    for (Near& n : near_) n.last = n.gap;
    drop([](const Near& n) { return 0.5 * (n.first + n.last - n.speed); });
    offer(0.5);
    drop([](const Near& n) { return 0.5 * (min(n.first, n.last) + n.gap - 0.5 * n.speed); });
    for (int i = 1; i < kSamples; ++i) {
      if (2 * i != kSamples) offer(static_cast<double>(i) / kSamples);
    }
    for (const WalkPoint& p : path_) offer(clamp(p.fraction, 0.0, 1.0));
    // Golden-section search around the best sample.
    constexpr double kGolden = 0.6180339887498949;
    double low = max(best_at_ - 1.0 / kSamples, 0.0), high = min(best_at_ + 1.0 / kSamples, 1.0);
    gap(best_at_);
    drop([](const Near& n) { return n.gap - n.speed / kSamples; });
    double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    double at_a = gap(a), at_b = gap(b);
    for (int i = 0; i < 13; ++i) {
      best_ = min(best_, min(at_a, at_b));
      // The last evaluation was between low and high.
      if (i == 3) drop([&](const Near& n) { return n.gap - n.speed * (high - low); });
      if (at_a < at_b) {
        high = b;
        b = a;
        at_b = at_a;
        a = high - kGolden * (high - low);
        at_a = gap(a);
      } else {
        low = a;
        a = b;
        at_a = at_b;
        b = low + kGolden * (high - low);
        at_b = gap(b);
      }
    }
    return min(best_, min(at_a, at_b));
  }

  double gap(double u) {
    const Capsule<double> agent = agent_capsule(detail::position_at(path_, u), radius_, height_);
    const Capsule<double> here{{}, agent.p1 - agent.p0, agent.radius};
    double least = std::numeric_limits<double>::infinity();
    for (Near& n : near_) {
      Capsule<double> body = lerp(n.body->motion.begin, n.body->motion.end, u);
      body.p0 -= agent.p0;
      body.p1 -= agent.p0;
      n.gap = capsule_gap(here, body).gap;
      least = min(least, n.gap);
    }
    return least;
  }
  void offer(double u) {
    const double d = gap(u);
    if (d < best_) {
      best_ = d;
      best_at_ = u;
    }
  }
  /// Removes capsules whose gap is, by a lower bound, above the best distance.
  template <class Bound>
  void drop(const Bound& bound) {
    std::erase_if(near_, [&](const Near& n) { return bound(n) > best_; });
  }

  /// Minimum of `best` and the gap to one capsule, leg by leg.
  double pass(const MovingCapsule<double>& body, double best) const {
    const double tolerance = kTolerance + kShare * (agent_length_ + speed_of(body));
    const WalkPoint start{path_.empty() ? Vec3d{} : path_.front().position, kNoPoly, 0.0};
    WalkPoint from = start;
    for (std::size_t i = 0; i <= path_.size(); ++i) {
      // After the last point the agent stands still.
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

  static constexpr double kTolerance = 1e-6;  // Absolute error of distances, metres.
  static constexpr double kShare = 1e-4;      // Fraction of the motion of both during a tick.

  std::span<const WalkPoint> path_;
  double agent_speed_, agent_length_, radius_, height_;
  Scratch& scratch_;
  std::vector<Near>& near_;
  View<const DynamicCapsule> avatar_;
  std::size_t nearest_ = 0;  // Index of the capsule with the smallest bound.
  double best_ = std::numeric_limits<double>::infinity(), best_at_ = 0.0;
};

}  // namespace

void closest_approach(std::span<const WalkPoint> path, double radius, double height,
                      const CapsuleSet& bodies, std::vector<double>& out) {
  const std::span<const CapsuleSet::Group> groups = bodies.groups();
  out.resize(groups.size());
  if (groups.empty()) return;
  Aabb<double> reach;
  for (const WalkPoint& p : path) add_capsule(reach, agent_capsule(p.position, radius, height));
  if (path.empty()) add_capsule(reach, agent_capsule({}, radius, height));
  for (std::size_t g = 0; g < groups.size(); ++g) out[g] = least_distance(reach, groups[g].swept);
  // Start with the avatar that may be nearest, so that the others can be skipped.
  thread_local Scratch scratch;
  std::vector<std::size_t>& order = scratch.order;
  order.resize(groups.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return out[a] < out[b]; });
  const double speed = speed_of(path), length = length_of(path);
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t g : order) {
    if (out[g] > max(least, kPersonalSpace)) break;
    Approach approach(path, speed, length, radius, height, scratch);
    out[g] = max(out[g], approach.look(reach, bodies.capsules_of(groups[g])));
    if (out[g] > max(least, kPersonalSpace)) continue;
    out[g] = approach.find();
    least = min(least, out[g]);
  }
}

void merge_distances(std::span<const double> approach, const CapsuleSet& bodies,
                     std::vector<std::uint32_t>& avatars, std::vector<double>& distances) {
  for (std::size_t g = 0; g < approach.size(); ++g) {
    const std::uint32_t avatar = bodies.capsules_of(bodies.groups()[g])[0].avatar;
    const auto at = std::lower_bound(avatars.begin(), avatars.end(), avatar);
    const auto i = at - avatars.begin();
    if (at != avatars.end() && *at == avatar) {
      double& least = distances[static_cast<std::size_t>(i)];
      least = min(least, approach[g]);
    } else {
      avatars.insert(at, avatar);
      distances.insert(distances.begin() + i, approach[g]);
    }
  }
}

}  // namespace gsnav
