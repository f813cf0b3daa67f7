// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/obstacles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "gsnav/detail/core/list_by_group.hpp"

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

}  // namespace

Result<CapsuleSet> CapsuleSet::create(std::vector<DynamicCapsule> capsules, double t0, double t1) {
  if (!is_finite(t0) || !is_finite(t1) || t1 < t0) {
    return Status(Errc::invalid_argument, "CapsuleSet: the interval [" + std::to_string(t0) + ", " +
                                              std::to_string(t1) + "] is not finite or runs backwards");
  }
  for (const DynamicCapsule& c : capsules) {
    if (Status s = check(c); !s.ok()) return s;
  }
  // Sort by content after the ids, so that the order is defined for equal ids too.
  const auto before = [](const DynamicCapsule& a, const DynamicCapsule& b) {
    if (a.avatar != b.avatar) return a.avatar < b.avatar;
    if (a.bone != b.bone) return a.bone < b.bone;
    return numbers_of(a) < numbers_of(b);
  };
  if (!std::is_sorted(capsules.begin(), capsules.end(), before))
    std::sort(capsules.begin(), capsules.end(), before);
  CapsuleSet set;
  set.t0_ = t0;
  set.t1_ = t1;
  set.capsules_ = std::move(capsules);
  for (std::size_t i = 0; i < set.capsules_.size(); ++i) {
    const DynamicCapsule& c = set.capsules_[i];
    if (i == 0 || c.avatar != set.capsules_[i - 1].avatar) set.groups_.push_back({i, 0, {}});
    Group& g = set.groups_.back();
    ++g.count;
    // Linear motion stays within the convex hull of both ends.
    add_capsule(g.swept, c.motion.begin);
    add_capsule(g.swept, c.motion.end);
  }
  set.make_grid();
  return set;
}

void CapsuleSet::make_grid() {
  Aabb<double> all;
  for (const Group& g : groups_) {
    all.add(g.swept.low);
    all.add(g.swept.high);
  }
  // About one cell per body. The limit keeps bodies that sweep the whole grid in few cells.
  constexpr double kMostCellsASide = 64;
  const double side = groups_.empty()
                          ? 1.0
                          : clamp(std::sqrt(static_cast<double>(groups_.size())), 1.0, kMostCellsASide);
  columns_ = rows_ = static_cast<std::uint32_t>(side);
  if (!groups_.empty()) {
    low_ = all.low;
    columns_per_metre_ = columns_ / max(all.high.x - all.low.x, 1e-3);
    rows_per_metre_ = rows_ / max(all.high.z - all.low.z, 1e-3);
  }
  cells_.clear();
  for (const Group& g : groups_) cells_.push_back(cells_of(g.swept));
  const std::size_t cells = std::size_t{columns_} * rows_;
  detail::list_by_group(cells_.size(), cells, first_, in_cell_, [&](std::size_t i, const auto& f) {
    const Cells& q = cells_[i];
    for (std::uint32_t r = q.r0; r <= q.r1; ++r) {
      for (std::uint32_t c = q.c0; c <= q.c1; ++c) f(std::size_t{r} * columns_ + c);
    }
  });
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
