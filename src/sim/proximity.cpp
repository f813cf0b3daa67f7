// SPDX-License-Identifier: Apache-2.0
#include "gsnav/sim/proximity.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "gsnav/sim/metrics.hpp"

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

/// One avatar's least distance during the tick. Bodies whose boxes stay farther away than what was already found are
/// not looked at again.
class Approach {
 public:
  Approach(std::span<const WalkPoint> path, double radius, double height, const Aabb<double>& reach,
           View<const DynamicCapsule> avatar, std::vector<DynamicCapsule>& near)
      : path_(path), radius_(radius), height_(height), reach_(reach), avatar_(avatar), near_(near) {}

  double find() {
    constexpr int kSamples = 8;
    near_.assign(avatar_.begin(), avatar_.end());
    offer(0.0);
    offer(1.0);
    drop_far();
    for (int i = 1; i < kSamples; ++i) offer(static_cast<double>(i) / kSamples);
    for (const WalkPoint& p : path_) offer(clamp(p.fraction, 0.0, 1.0));
    drop_far();
    // Golden sections around the best sample.
    constexpr double kGolden = 0.6180339887498949;
    double low = max(best_at_ - 1.0 / kSamples, 0.0), high = min(best_at_ + 1.0 / kSamples, 1.0);
    double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    double at_a = gap(a), at_b = gap(b);
    for (int i = 0; i < 13; ++i) {
      best_ = min(best_, min(at_a, at_b));
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

 private:
  double gap(double u) const {
    Clearance c;
    nearest_body(agent_capsule(position_at(path_, u), radius_, height_), {near_.data(), near_.size()}, u, c);
    return c.distance;
  }
  void offer(double u) {
    const double d = gap(u);
    if (d < best_) {
      best_ = d;
      best_at_ = u;
    }
  }
  void drop_far() {
    std::erase_if(near_, [&](const DynamicCapsule& c) {
      Aabb<double> box;
      add_capsule(box, c.motion.begin);
      add_capsule(box, c.motion.end);
      return least_distance(reach_, box) > best_;
    });
  }

  std::span<const WalkPoint> path_;
  double radius_, height_;
  const Aabb<double>& reach_;
  View<const DynamicCapsule> avatar_;
  std::vector<DynamicCapsule>& near_;
  double best_ = std::numeric_limits<double>::infinity(), best_at_ = 0.0;
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
  std::vector<std::size_t> order(groups.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return out[a] < out[b]; });
  std::vector<DynamicCapsule> near;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t g : order) {
    if (out[g] > max(least, kPersonalSpace)) break;
    out[g] = Approach(path, radius, height, reach, bodies.capsules_of(groups[g]), near).find();
    least = min(least, out[g]);
  }
}

}  // namespace gsnav
