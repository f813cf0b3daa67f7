// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav::detail {

/// A k-d tree over points, stored as an order of their indices: a range [first, last) is split at its
/// middle along its longest axis. Points that are not finite are left out. The points must outlive the
/// tree.
class PointTree {
 public:
  explicit PointTree(std::span<const Vec3d> points) : points_(points), axes_(points.size()) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (is_finite(points[i])) order_.push_back(static_cast<std::uint32_t>(i));
    }
    split(0, order_.size());
  }
  /// Indices of the points; neighbours mostly lie together.
  const std::vector<std::uint32_t>& order() const noexcept { return order_; }

  /// Calls best.add(index, squared distance) for every point nearer to `from` than sqrt(best.worst()),
  /// and for some others. best.worst() may shrink during the search.
  template <class Best>
  void search(const Vec3d& from, Best& best) const {
    search(0, order_.size(), from, best);
  }
  /// Squared distance to the nearest point; infinity if there is none.
  double nearest_squared(const Vec3d& from) const {
    struct Least {
      double least = std::numeric_limits<double>::infinity();
      double worst() const noexcept { return least; }
      void add(std::uint32_t, double d) noexcept { least = std::min(least, d); }
    } best;
    search(from, best);
    return best.least;
  }

 private:
  static constexpr std::size_t kLeaf = 8;

  void split(std::size_t first, std::size_t last) {
    if (last - first <= kLeaf) return;
    Vec3d low = points_[order_[first]], high = low;
    for (std::size_t i = first; i < last; ++i) {
      const Vec3d& p = points_[order_[i]];
      for (int k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
    const Vec3d size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = first + (last - first) / 2;
    const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(first), at(middle), at(last), [&](std::uint32_t a, std::uint32_t b) {
      return points_[a][axis] < points_[b][axis];
    });
    axes_[middle] = static_cast<std::uint8_t>(axis);
    split(first, middle);
    split(middle + 1, last);
  }

  template <class Best>
  void look(std::uint32_t i, const Vec3d& from, Best& best) const {
    const Vec3d d = points_[i] - from;
    best.add(i, dot(d, d));
  }
  template <class Best>
  void search(std::size_t first, std::size_t last, const Vec3d& from, Best& best) const {
    if (last - first <= kLeaf) {
      for (std::size_t k = first; k < last; ++k) look(order_[k], from, best);
      return;
    }
    const std::size_t middle = first + (last - first) / 2;
    const int axis = axes_[middle];
    const double beyond = from[axis] - points_[order_[middle]][axis];
    look(order_[middle], from, best);
    search(beyond < 0 ? first : middle + 1, beyond < 0 ? middle : last, from, best);
    if (beyond * beyond < best.worst()) {
      search(beyond < 0 ? middle + 1 : first, beyond < 0 ? last : middle, from, best);
    }
  }

  std::span<const Vec3d> points_;
  std::vector<std::uint32_t> order_;
  std::vector<std::uint8_t> axes_;
};

}  // namespace gsnav::detail
