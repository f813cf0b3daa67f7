// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Spacing of the lattice of origins, metres.
inline constexpr double kOriginLattice = 64.0;

/// Assigns ids to the lattice points nearest to means, in the order in which they occur. Id 0 is the
/// point zero.
class OriginLattice {
 public:
  /// Id of the lattice point nearest to `mean`.
  std::uint32_t id_of(const Vec3d& mean) {
    Vec3d origin;
    for (int k = 0; k < 3; ++k) origin[k] = kOriginLattice * std::nearbyint(mean[k] / kOriginLattice);
    if (origin == origins_[last_]) return last_;
    return last_ = id_of_point(origin);
  }
  /// Id of a lattice point.
  std::uint32_t id_of_point(const Vec3d& origin) {
    if (2 * origins_.size() >= table_.size()) grow();
    std::uint32_t& id = slot_of(origin);
    if (id == kFree) {
      id = static_cast<std::uint32_t>(origins_.size());
      origins_.push_back(origin);
    }
    return id;
  }
  /// [ids in use] the lattice points.
  const std::vector<Vec3d>& origins() const noexcept { return origins_; }

 private:
  static constexpr std::uint32_t kFree = 0xffffffffu;

  /// The place of a point in the table: that with its id, or the free one where it belongs.
  std::uint32_t& slot_of(const Vec3d& point) noexcept {
    std::uint64_t hash = 0;
    for (int k = 0; k < 3; ++k) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(point[k] + 0.0)) * 0x9e3779b97f4a7c15u;  // -0 is 0
      hash ^= hash >> 32;
    }
    std::size_t at = hash & (table_.size() - 1);
    while (table_[at] != kFree && !(origins_[table_[at]] == point)) at = (at + 1) & (table_.size() - 1);
    return table_[at];
  }
  void grow() {
    table_.assign(2 * table_.size(), kFree);
    for (std::size_t i = 0; i < origins_.size(); ++i) {
      slot_of(origins_[i]) = static_cast<std::uint32_t>(i);
    }
  }

  std::vector<Vec3d> origins_{Vec3d{}};
  std::vector<std::uint32_t> table_{0, kFree};  // [a power of two] ids by hash; point zero has hash 0
  std::uint32_t last_ = 0;
};

}  // namespace gsnav
