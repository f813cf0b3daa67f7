// SPDX-License-Identifier: Apache-2.0
#include "nearest_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace gsnav::detail {

double typical_spacing(const std::vector<Vec3d>& points) {
  std::vector<double> apart;
  for (std::size_t i = 0; points.size() > 1 && i < points.size(); i += points.size() / 64 + 1) {
    double least = std::numeric_limits<double>::max();
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Vec3d d = points[k] - points[i];
      if (k != i) least = min(least, dot(d, d));
    }
    apart.push_back(std::sqrt(least));
  }
  std::sort(apart.begin(), apart.end());
  return apart.empty() ? 0.0 : apart[apart.size() / 2];
}

NearestPoints::NearestPoints(std::vector<Vec3d> points) : points_(std::move(points)) {
  cell_ = max(2 * typical_spacing(points_), 1e-6);
  for (std::size_t i = 0; i < points_.size(); ++i) cells_[key(cell_of(points_[i]))].push_back(i);
}

std::vector<std::pair<double, std::size_t>> NearestPoints::near(std::size_t i, std::size_t count) const {
  constexpr std::int64_t kRings = 5;
  std::vector<std::pair<double, std::size_t>> out;
  const GridCell c = cell_of(points_[i]);
  for (std::int64_t ring = 0; ring <= kRings; ++ring) {
    for_each_cell_in_ring(c, ring, [&](const GridCell& cell) {
      const auto found = cells_.find(key(cell));
      if (found == cells_.end()) return;
      for (const std::size_t k : found->second) {
        const Vec3d d = points_[k] - points_[i];
        // Cells that share a key are visited more than once.
        if (k != i && cell_of(points_[k]) == cell) out.emplace_back(dot(d, d), k);
      }
    });
    // All points within `ring` cells are in `out` now.
    const double reach = static_cast<double>(ring) * cell_;
    if (out.size() < count) continue;
    std::nth_element(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count - 1), out.end());
    if (out[count - 1].first <= reach * reach) break;
  }
  std::sort(out.begin(), out.end());
  if (out.size() > count) out.resize(count);
  return out;
}

GridCell NearestPoints::cell_of(const Vec3d& p) const {
  GridCell c{};
  for (int k = 0; k < 3; ++k)
    c[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::floor(p[k] / cell_));
  return c;
}

std::uint64_t NearestPoints::key(const GridCell& c) noexcept {
  std::uint64_t h = 0;
  for (const std::int64_t v : c) h = (h ^ static_cast<std::uint64_t>(v)) * 0x9e3779b97f4a7c15ull;
  return h;
}

}  // namespace gsnav::detail
