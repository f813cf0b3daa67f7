// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/math/vec.hpp"

namespace gsnav::detail {

/// Points that keep a least distance from each other (dart throwing), in a hash of cells.
class PointGrid {
 public:
  /// `cell` must be at least the greatest spacing; about `expected` points will be kept.
  PointGrid(double cell, std::size_t expected) : cell_(cell) {
    std::size_t buckets = 64;
    while (buckets < 2 * expected) buckets *= 2;
    heads_.assign(buckets, -1);
  }

  /// Keeps p, unless a kept point with `counts(index)` true is nearer than `spacing`. Returns whether it
  /// was kept.
  template <class Counts>
  bool add(const Vec3d& p, double spacing, const Counts& counts) {
    std::int64_t c[3];
    for (int k = 0; k < 3; ++k) c[k] = static_cast<std::int64_t>(std::floor(p[k] / cell_));
    const double limit = spacing * spacing;
    for (std::int64_t z = -1; z <= 1; ++z) {
      for (std::int64_t y = -1; y <= 1; ++y) {
        for (std::int64_t x = -1; x <= 1; ++x) {
          // Cells may share a bucket; that only costs some more distances.
          for (int i = heads_[bucket(c[0] + x, c[1] + y, c[2] + z)]; i >= 0;
               i = next_[static_cast<std::size_t>(i)]) {
            const Vec3d d = points_[static_cast<std::size_t>(i)] - p;
            if (dot(d, d) < limit && counts(static_cast<std::size_t>(i))) return false;
          }
        }
      }
    }
    int& head = heads_[bucket(c[0], c[1], c[2])];
    next_.push_back(head);
    head = static_cast<int>(points_.size());
    points_.push_back(p);
    return true;
  }
  bool add(const Vec3d& p, double spacing) {
    return add(p, spacing, [](std::size_t) { return true; });
  }

 private:
  std::size_t bucket(std::int64_t x, std::int64_t y, std::int64_t z) const noexcept {
    std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ull;
    h = (h ^ (h >> 29)) + static_cast<std::uint64_t>(y) * 0xbf58476d1ce4e5b9ull;
    h = (h ^ (h >> 31)) + static_cast<std::uint64_t>(z) * 0x94d049bb133111ebull;
    return static_cast<std::size_t>(h ^ (h >> 32)) & (heads_.size() - 1);
  }
  double cell_;
  std::vector<int> heads_, next_;
  std::vector<Vec3d> points_;
};

}  // namespace gsnav::detail
