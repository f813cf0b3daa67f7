// SPDX-License-Identifier: Apache-2.0
#include "gsnav/nav/obstacles.hpp"

#include <algorithm>
#include <array>
#include <string>

namespace gsnav {
namespace {

constexpr double kMaxCoordinate = 1e9;

std::array<double, 14> numbers_of(const DynamicCapsule& c) noexcept {
  const auto& b = c.motion.begin;
  const auto& e = c.motion.end;
  return {b.p0.x, b.p0.y, b.p0.z, b.p1.x, b.p1.y, b.p1.z, b.radius,
          e.p0.x, e.p0.y, e.p0.z, e.p1.x, e.p1.y, e.p1.z, e.radius};
}

Status check(const DynamicCapsule& c) {
  const auto fail = [&](const char* what) {
    return Status(Errc::invalid_argument, "capsule of avatar " + std::to_string(c.avatar) + ", bone " +
                                              std::to_string(c.bone) + ": " + what);
  };
  for (const double v : numbers_of(c)) {
    if (!is_finite(v)) return fail("a coordinate or radius is not finite");
    if (std::abs(v) > kMaxCoordinate) return fail("a coordinate or radius is beyond 1e9 m");
  }
  if (c.motion.begin.radius < 0 || c.motion.end.radius < 0) return fail("the radius is negative");
  return {};
}

void add_swept(Aabb<double>& box, const Capsule<double>& c) noexcept {
  const Vec3d r{c.radius, c.radius, c.radius};
  for (const Vec3d& p : {c.p0, c.p1}) {
    box.add(p - r);
    box.add(p + r);
  }
}

}  // namespace

Result<CapsuleSet> CapsuleSet::create(std::vector<DynamicCapsule> capsules, double t0, double t1) {
  if (!is_finite(t0) || !is_finite(t1) || t1 < t0) {
    return Status(Errc::invalid_argument, "CapsuleSet: the interval [" + std::to_string(t0) + ", " +
                                              std::to_string(t1) + "] is not finite or runs backwards");
  }
  for (const DynamicCapsule& c : capsules) {
    if (Status s = check(c); !s.ok()) return s;
  }
  // By content after the ids, so that capsules with equal ids have an order of their own too.
  std::sort(capsules.begin(), capsules.end(), [](const DynamicCapsule& a, const DynamicCapsule& b) {
    if (a.avatar != b.avatar) return a.avatar < b.avatar;
    if (a.bone != b.bone) return a.bone < b.bone;
    return numbers_of(a) < numbers_of(b);
  });
  CapsuleSet set;
  set.t0_ = t0;
  set.t1_ = t1;
  set.capsules_ = std::move(capsules);
  for (std::size_t i = 0; i < set.capsules_.size(); ++i) {
    const DynamicCapsule& c = set.capsules_[i];
    if (i == 0 || c.avatar != set.capsules_[i - 1].avatar) set.groups_.push_back({i, 0, {}});
    Group& g = set.groups_.back();
    ++g.count;
    // Linear motion stays within the hull of both ends.
    add_swept(g.swept, c.motion.begin);
    add_swept(g.swept, c.motion.end);
  }
  return set;
}

Result<CapsuleSet> CapsuleSet::standing(std::span<const Capsule<double>> capsules,
                                        std::uint32_t avatar) {
  std::vector<DynamicCapsule> list;
  list.reserve(capsules.size());
  for (const Capsule<double>& c : capsules) {
    list.push_back({{c, c}, avatar, static_cast<std::uint32_t>(list.size())});
  }
  return create(std::move(list));
}

}  // namespace gsnav
