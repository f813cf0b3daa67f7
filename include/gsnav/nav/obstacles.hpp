// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/math/capsule.hpp"

namespace gsnav {

/// The bodies that agents meet during one tick [t0, t1]: capsules whose endpoints and radii move
/// linearly. Built once a tick and immutable, so that a step, its queries and any number of threads see
/// the same bodies over the same interval. The order in which capsules were given does not matter.
class CapsuleSet {
 public:
  /// Nobody there.
  CapsuleSet() = default;

  /// Validates and sorts `capsules` (world, Y up, metres). Errors (invalid_argument, naming avatar and
  /// bone): a NaN or infinite number, a negative radius, a coordinate beyond 1e9 m, t1 < t0.
  static Result<CapsuleSet> create(std::vector<DynamicCapsule> capsules, double t0 = 0.0,
                                   double t1 = 1.0);

  /// Bodies that stand still.
  static Result<CapsuleSet> standing(std::span<const Capsule<double>> capsules,
                                     std::uint32_t avatar = 0);

  double t0() const noexcept { return t0_; }
  double t1() const noexcept { return t1_; }
  bool empty() const noexcept { return capsules_.empty(); }
  std::size_t size() const noexcept { return capsules_.size(); }
  /// All capsules by (avatar, bone).
  std::span<const DynamicCapsule> capsules() const noexcept { return capsules_; }

  /// Fraction of the interval that time t (seconds) is at, in [0, 1].
  double fraction_at(double t) const noexcept {
    const double u = t1_ > t0_ ? (t - t0_) / (t1_ - t0_) : 0.0;
    return u > 0.0 ? (u < 1.0 ? u : 1.0) : 0.0;
  }

  /// Consecutive capsules of one avatar and the box that they sweep during the interval.
  struct Group {
    std::size_t first = 0, count = 0;
    Aabb<double> swept{};
  };
  std::span<const Group> groups() const noexcept { return groups_; }
  View<const DynamicCapsule> capsules_of(const Group& g) const noexcept {
    return {capsules_.data() + g.first, g.count};
  }

 private:
  std::vector<DynamicCapsule> capsules_;
  std::vector<Group> groups_;
  double t0_ = 0.0, t1_ = 1.0;
};

}  // namespace gsnav
