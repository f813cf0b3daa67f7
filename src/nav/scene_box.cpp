// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "solid_gaussians.hpp"

namespace gsnav::detail::solids {

Aabb<double> scene_box(std::span<const GaussianSet> sets, const GaussianNavOptions& options) {
  constexpr double kCoarse = 1.0;   // Side of a coarse cell, metres.
  constexpr double kSparse = 0.02;  // Cells with less than this fraction of the median Gaussian's cell
                                    // are not part of the scene.
  constexpr double kFar = 1e7;
  using Cell = std::array<std::int64_t, 3>;
  std::map<Cell, double> mass;
  std::size_t faint = 0;
  for_each_opaque(sets, options.min_opacity, faint, [&](const Solid& s) {
    if (std::abs(s.mean.x) > kFar || std::abs(s.mean.y) > kFar || std::abs(s.mean.z) > kFar) return;
    if (options.crop && !inside(*options.crop, s.mean)) return;
    Cell c;
    for (int k = 0; k < 3; ++k) {
      c[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::floor(s.mean[k] / kCoarse));
    }
    mass[c] += s.opacity;
  });
  std::vector<double> filled;
  double total = 0;
  for (const auto& [cell, m] : mass) {
    filled.push_back(m);
    total += m;
  }
  std::sort(filled.begin(), filled.end());
  double least = 0, below = 0;
  for (std::size_t i = 0; i < filled.size() && below < 0.5 * total; ++i) {
    below += filled[i];
    least = kSparse * filled[i];
  }
  struct MassCluster {
    double mass = 0;
    Aabb<double> box;
  };
  std::vector<MassCluster> parts;
  std::map<Cell, bool> visited;
  for (const auto& [start, m] : mass) {
    if (m < least || visited[start]) continue;
    MassCluster part;
    std::vector<Cell> stack{start};
    visited[start] = true;
    while (!stack.empty()) {
      const Cell c = stack.back();
      stack.pop_back();
      part.mass += mass.at(c);
      const Vec3d low{static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])};
      part.box.add(low * kCoarse);
      part.box.add((low + Vec3d{1, 1, 1}) * kCoarse);
      for (std::int64_t i = 0; i < 27; ++i) {
        const Cell n{c[0] + i % 3 - 1, c[1] + i / 3 % 3 - 1, c[2] + i / 9 - 1};
        const auto it = mass.find(n);
        if (it == mass.end() || it->second < least || visited[n]) continue;
        visited[n] = true;
        stack.push_back(n);
      }
    }
    parts.push_back(part);
  }
  double most = 0;
  for (const MassCluster& p : parts) most = max(most, p.mass);
  Aabb<double> box;
  for (const MassCluster& p : parts) {
    if (p.mass >= 0.1 * most) box.add(p.box);
  }
  if (options.crop && !box.empty()) {
    for (int k = 0; k < 3; ++k) {
      box.low[k] = max(box.low[k], options.crop->low[k]);
      box.high[k] = min(box.high[k], options.crop->high[k]);
    }
  }
  return box;
}

}  // namespace gsnav::detail::solids
