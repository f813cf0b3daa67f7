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

  /// Begin of the interval, seconds.
  double t0() const noexcept { return t0_; }
  /// End of the interval, seconds.
  double t1() const noexcept { return t1_; }
  /// Whether there are no capsules.
  bool empty() const noexcept { return capsules_.empty(); }
  /// Number of capsules.
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
    std::size_t first = 0, count = 0;  ///< Range of the capsules.
    Aabb<double> swept{};              ///< Box of their motion, metres.
  };
  /// All groups.
  std::span<const Group> groups() const noexcept { return groups_; }
  /// Calls f(group), once each, for the groups whose swept box meets `box`: by a grid on the ground
  /// plane.
  template <class F>
  void groups_in(const Aabb<double>& box, F&& f) const {
    const Cells q = cells_of(box);
    for (std::uint32_t r = q.r0; r <= q.r1; ++r) {
      for (std::uint32_t c = q.c0; c <= q.c1; ++c) {
        const std::size_t cell = std::size_t{r} * columns_ + c;
        for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
          const std::uint32_t g = in_cell_[i];
          // A group in many cells belongs to the first of those looked at.
          if (c != max(q.c0, cells_[g].c0) || r != max(q.r0, cells_[g].r0)) continue;
          if (!apart(box, groups_[g].swept)) f(groups_[g]);
        }
      }
    }
  }
  /// Whether there is a group whose swept box meets `box`.
  bool meets(const Aabb<double>& box) const {
    bool any = false;
    if (!empty()) groups_in(box, [&](const Group&) { any = true; });
    return any;
  }
  /// The capsules of a group.
  View<const DynamicCapsule> capsules_of(const Group& g) const noexcept {
    return {capsules_.data() + g.first, g.count};
  }

 private:
  /// Cells that a box reaches into, both ends included.
  struct Cells {
    std::uint32_t c0 = 0, c1 = 0, r0 = 0, r1 = 0;
  };
  static bool apart(const Aabb<double>& a, const Aabb<double>& b) noexcept {
    return a.high.x < b.low.x || b.high.x < a.low.x || a.high.y < b.low.y || b.high.y < a.low.y ||
           a.high.z < b.low.z || b.high.z < a.low.z;
  }
  Cells cells_of(const Aabb<double>& box) const noexcept {
    const auto cell = [](double v, double low, double per_metre, std::uint32_t n) {
      return static_cast<std::uint32_t>(clamp((v - low) * per_metre, 0.0, static_cast<double>(n - 1)));
    };
    return {cell(box.low.x, low_.x, columns_per_metre_, columns_),
            cell(box.high.x, low_.x, columns_per_metre_, columns_),
            cell(box.low.z, low_.z, rows_per_metre_, rows_),
            cell(box.high.z, low_.z, rows_per_metre_, rows_)};
  }
  void make_grid();

  std::vector<DynamicCapsule> capsules_;
  std::vector<Group> groups_;
  double t0_ = 0.0, t1_ = 1.0;
  Vec3d low_{};  ///< of the grid
  double columns_per_metre_ = 0.0, rows_per_metre_ = 0.0;
  std::uint32_t columns_ = 1, rows_ = 1;
  std::vector<std::uint32_t> first_{0, 0}, in_cell_;  ///< groups by cell
  std::vector<Cells> cells_;                          ///< of each group
};

}  // namespace gsnav
