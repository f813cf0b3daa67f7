// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/capsule_volume.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "../avatar/nearest_points.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

CapsuleVolume measure_capsule_volume(const std::vector<Vec3d>& surface,
                                     const std::vector<Capsule<double>>& capsules) {
  CapsuleVolume out;
  if (surface.empty()) return out;
  Vec3d low = surface[0], high = surface[0];
  const auto take = [&](const Vec3d& p, double r) {
    for (int k = 0; k < 3; ++k) low[k] = min(low[k], p[k] - r), high[k] = max(high[k], p[k] + r);
  };
  for (const Vec3d& p : surface) take(p, 0.0);
  for (const auto& c : capsules) take(c.p0, c.radius), take(c.p1, c.radius);
  // A body that is scattered about is not cut any finer.
  const double cell = max(max(0.01, 3 * detail::typical_spacing(surface)), norm(high - low) / 400);
  std::array<std::size_t, 3> n{};
  for (int k = 0; k < 3; ++k) {
    low[k] -= 1.5 * cell;  // a layer all around is outside
    n[static_cast<std::size_t>(k)] = static_cast<std::size_t>((high[k] - low[k]) / cell) + 3;
  }
  enum : std::uint8_t { kUnknown, kSurface, kOutside };
  std::vector<std::uint8_t> kind(n[0] * n[1] * n[2], kUnknown), covered(kind.size(), 0);
  const auto index = [&](std::size_t x, std::size_t y, std::size_t z) {
    return (z * n[1] + y) * n[0] + x;
  };
  const auto at = [&](double v, int k) { return static_cast<std::size_t>((v - low[k]) / cell); };
  // The points of each cell, one cell after another.
  std::vector<std::uint32_t> first(kind.size() + 1, 0), order(surface.size()), held(kind.size(), 0);
  std::vector<std::uint8_t> inside(surface.size(), 0);
  const auto cell_of = [&](const Vec3d& p) { return index(at(p.x, 0), at(p.y, 1), at(p.z, 2)); };
  for (const Vec3d& p : surface) {
    kind[cell_of(p)] = kSurface;
    ++first[cell_of(p) + 1];
  }
  for (std::size_t i = 0; i < kind.size(); ++i) first[i + 1] += first[i];
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const std::size_t c = cell_of(surface[i]);
    order[first[c] + held[c]++] = static_cast<std::uint32_t>(i);
  }
  std::vector<std::array<std::size_t, 3>> open{{0, 0, 0}};
  kind[0] = kOutside;
  while (!open.empty()) {
    const auto c = open.back();
    open.pop_back();
    for (std::size_t k = 0; k < 3; ++k) {
      for (const bool up : {false, true}) {
        if (up ? c[k] + 1 >= n[k] : c[k] == 0) continue;
        auto next = c;
        next[k] += up ? 1 : static_cast<std::size_t>(-1);
        std::uint8_t& there = kind[index(next[0], next[1], next[2])];
        if (there != kUnknown) continue;
        there = kOutside;
        open.push_back(next);
      }
    }
  }
  const auto middle = [&](std::size_t i, int k) {
    return low[k] + (static_cast<double>(i) + 0.5) * cell;
  };
  for (const auto& c : capsules) {
    std::array<std::size_t, 3> a{}, b{};
    for (int k = 0; k < 3; ++k) {
      a[static_cast<std::size_t>(k)] = at(min(c.p0[k], c.p1[k]) - c.radius, k);
      b[static_cast<std::size_t>(k)] = at(max(c.p0[k], c.p1[k]) + c.radius, k);
    }
    const Vec3d axis = c.p1 - c.p0;
    const double length2 = dot(axis, axis), radius2 = c.radius * c.radius;
    for (std::size_t z = a[2]; z <= b[2]; ++z) {
      for (std::size_t y = a[1]; y <= b[1]; ++y) {
        for (std::size_t x = a[0]; x <= b[0]; ++x) {
          const auto holds = [&](const Vec3d& p) {
            const Vec3d d = p - c.p0,
                        off = d - axis * (length2 > 0 ? clamp(dot(d, axis) / length2, 0.0, 1.0) : 0.0);
            return dot(off, off) <= radius2;
          };
          const std::size_t here = index(x, y, z);
          if (holds({middle(x, 0), middle(y, 1), middle(z, 2)})) covered[here] = 1;
          for (std::uint32_t k = first[here]; k < first[here + 1]; ++k) {
            if (inside[order[k]] == 0 && holds(surface[order[k]])) inside[order[k]] = 1;
          }
        }
      }
    }
  }
  for (std::size_t i = 0; i < kind.size(); ++i) {
    const double share = kind[i] == kOutside ? 0.0 : kind[i] == kSurface ? 0.5 : 1.0;
    double left = covered[i] == 0 ? 1.0 : 0.0;
    if (kind[i] == kSurface) {
      std::size_t out_of_all = 0;
      for (std::uint32_t k = first[i]; k < first[i + 1]; ++k)
        out_of_all += inside[order[k]] == 0 ? 1 : 0;
      left = static_cast<double>(out_of_all) / static_cast<double>(first[i + 1] - first[i]);
    }
    out.body += share;
    out.uncovered += share * left;
    if (covered[i] != 0) out.over += 1 - share;
  }
  const double volume = cell * cell * cell;
  out.body *= volume;
  out.uncovered *= volume;
  out.over *= volume;
  return out;
}

}  // namespace gsnav
