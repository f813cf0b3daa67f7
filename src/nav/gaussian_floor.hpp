// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "gaussian_voxels.hpp"

// The floor among the solid voxels of a scene.

namespace gsnav::detail {

/// Level of a voxel whose top is walkable, per column; kNone where there is none.
inline constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// Levels free above (x, level, z) before the next solid voxel; `covered` tells whether there is one.
inline std::size_t free_above(const VoxelGrid& g, std::size_t x, std::size_t level, std::size_t z, bool& covered) {
  for (std::size_t y = level + 1; y < g.ny; ++y) {
    if (g.solid[g.at(x, y, z)] != 0) {
      covered = true;
      return y - level - 1;
    }
  }
  covered = false;
  return kNone;
}

struct Floor {
  bool found = false;
  std::size_t level = 0;  ///< whose top the floor is
  double best_area = 0;   ///< largest area at any height, square metres
};

/// The lowest height at which a good share of the columns that have room for the agent end. Columns below a
/// ceiling decide where the scene has one: a garden around a house is not its floor.
inline Floor find_floor(const VoxelGrid& g, std::size_t clearance, std::size_t smooth) {
  std::vector<double> open(g.ny, 0.0), roofed(g.ny, 0.0);
  for (std::size_t z = 0; z < g.nz; ++z) {
    for (std::size_t x = 0; x < g.nx; ++x) {
      for (std::size_t y = 0; y < g.ny; ++y) {
        if (g.solid[g.at(x, y, z)] == 0) continue;
        bool covered = false;
        const std::size_t room = free_above(g, x, y, z, covered);
        if (room < clearance) continue;
        open[y] += 1;
        if (covered) roofed[y] += 1;
      }
    }
  }
  const auto smoothed = [&](const std::vector<double>& h) {
    std::vector<double> s(h.size(), 0.0);
    for (std::size_t y = 0; y < h.size(); ++y) {
      for (std::size_t k = y - min(y, smooth); k <= min(y + smooth, h.size() - 1); ++k) s[y] += h[k];
    }
    return s;
  };
  const std::vector<double> all = smoothed(open), under = smoothed(roofed);
  const double most = *std::max_element(all.begin(), all.end());
  const double most_under = *std::max_element(under.begin(), under.end());
  const bool indoors = most_under >= 0.25 * most;
  const std::vector<double>& score = indoors ? under : all;
  const std::vector<double>& raw = indoors ? roofed : open;
  const double top = indoors ? most_under : most;
  Floor floor;
  floor.best_area = most * g.cell * g.cell;
  if (!(top > 0)) return floor;
  for (std::size_t y = 0; y < g.ny; ++y) {
    if (score[y] < 0.4 * top) continue;
    // The peak itself: the fullest level within twice the smoothing above.
    floor.level = y;
    for (std::size_t k = y; k <= min(y + 2 * smooth, g.ny - 1); ++k) {
      if (raw[k] > raw[floor.level]) floor.level = k;
    }
    floor.found = true;
    break;
  }
  return floor;
}

/// The floor's own level in each column: scans drift by decimetres over a flat and real floors slope. From
/// where the floor stands at the level found, patches of about a metre follow their neighbours' within
/// `band` levels; between patch centres the level is interpolated.
class FloorField {
 public:
  FloorField(const VoxelGrid& g, std::size_t level, std::size_t clearance, std::size_t band)
      : g_(g), side_(max<std::size_t>(1, static_cast<std::size_t>(1.0 / g.cell + 0.5))),
        px_((g.nx + side_ - 1) / side_), pz_((g.nz + side_ - 1) / side_) {
    std::vector<std::vector<float>> tops(px_ * pz_);
    for (std::size_t p = 0; p < tops.size(); ++p) tops[p] = histogram(p, clearance);
    levels_.assign(px_ * pz_, -1.0);
    std::vector<std::size_t> queue;
    for (std::size_t p = 0; p < tops.size(); ++p) {
      const double peak = peak_near(tops[p], static_cast<double>(level), 2);
      if (peak < 0) continue;
      levels_[p] = peak;
      queue.push_back(p);
    }
    for (std::size_t k = 0; k < queue.size(); ++k) {
      const std::size_t p = queue[k], x = p % px_, z = p / px_;
      const auto visit = [&](std::size_t n) {
        if (levels_[n] >= 0) return;
        const double peak = peak_near(tops[n], levels_[p], band);
        if (peak < 0) return;
        levels_[n] = peak;
        queue.push_back(n);
      };
      if (x > 0) visit(p - 1);
      if (x + 1 < px_) visit(p + 1);
      if (z > 0) visit(p - px_);
      if (z + 1 < pz_) visit(p + px_);
    }
  }

  /// Level of the floor in a column, or kNone away from every patch that has one.
  std::size_t at(std::size_t x, std::size_t z) const {
    const double side = static_cast<double>(side_);
    const double fx = (static_cast<double>(x) + 0.5) / side - 0.5, fz = (static_cast<double>(z) + 0.5) / side - 0.5;
    const double x0 = std::floor(fx), z0 = std::floor(fz);
    double sum = 0, weight = 0;
    for (int k = 0; k < 4; ++k) {
      const double cx = x0 + (k & 1), cz = z0 + (k >> 1);
      if (cx < 0 || cz < 0 || cx >= static_cast<double>(px_) || cz >= static_cast<double>(pz_)) continue;
      const double level = levels_[static_cast<std::size_t>(cx) + px_ * static_cast<std::size_t>(cz)];
      if (level < 0) continue;
      const double w = (1.0 - std::abs(fx - cx)) * (1.0 - std::abs(fz - cz));
      sum += w * level;
      weight += w;
    }
    return weight > 0 ? static_cast<std::size_t>(sum / weight + 0.5) : kNone;
  }

 private:
  std::vector<float> histogram(std::size_t patch, std::size_t clearance) const {
    std::vector<float> h(g_.ny, 0.0f);
    const std::size_t x0 = patch % px_ * side_, z0 = patch / px_ * side_;
    for (std::size_t z = z0; z < min(z0 + side_, g_.nz); ++z) {
      for (std::size_t x = x0; x < min(x0 + side_, g_.nx); ++x) {
        for (std::size_t y = 0; y < g_.ny; ++y) {
          bool covered = false;
          if (g_.solid[g_.at(x, y, z)] != 0 && free_above(g_, x, y, z, covered) >= clearance) h[y] += 1;
        }
      }
    }
    return h;
  }

  /// Mean level around the fullest one within `band` of `level`; -1 where fewer than a twentieth of the
  /// patch's columns end there.
  double peak_near(const std::vector<float>& h, double level, std::size_t band) const {
    const auto c = static_cast<std::size_t>(level + 0.5);
    const std::size_t low = c - min(c, band), high = min(c + band, h.size() - 1);
    std::size_t best = low;
    for (std::size_t y = low; y <= high; ++y) best = h[y] > h[best] ? y : best;
    double sum = 0, weight = 0;
    for (std::size_t y = best - min<std::size_t>(best, 1); y <= min(best + 1, h.size() - 1); ++y) {
      sum += static_cast<double>(h[y]) * static_cast<double>(y);
      weight += static_cast<double>(h[y]);
    }
    return weight >= 0.05 * static_cast<double>(side_ * side_) ? sum / weight : -1.0;
  }

  const VoxelGrid& g_;
  std::size_t side_, px_, pz_;
  std::vector<double> levels_;
};

/// Top level of the floor in each column: the highest solid run that ends within the band. Pits below the
/// floor's own level are noise and are levelled.
inline std::vector<std::size_t> floor_tops(const VoxelGrid& g, const FloorField& floor, std::size_t band) {
  std::vector<std::size_t> tops(g.nx * g.nz, kNone);
  for (std::size_t z = 0; z < g.nz; ++z) {
    for (std::size_t x = 0; x < g.nx; ++x) {
      const std::size_t level = floor.at(x, z);
      if (level == kNone) continue;
      for (std::size_t y = min(level + band, g.ny - 1) + 1; y-- > level - min(level, band);) {
        if (g.solid[g.at(x, y, z)] != 0 && (y + 1 == g.ny || g.solid[g.at(x, y + 1, z)] == 0)) {
          tops[x + g.nx * z] = max(y, level);
          break;
        }
      }
    }
  }
  return tops;
}

/// Distance from every cell to the nearest set one, in cells, chessboard metric, up to `limit`.
inline std::vector<int> distances(const std::vector<std::uint8_t>& set, std::size_t nx, std::size_t nz, int limit) {
  std::vector<int> d(set.size());
  for (std::size_t i = 0; i < set.size(); ++i) d[i] = set[i] != 0 ? 0 : limit + 1;
  const auto relax = [&](std::size_t i, std::size_t j) { d[i] = min(d[i], d[j] + 1); };
  for (std::size_t z = 0; z < nz; ++z) {
    for (std::size_t x = 0; x < nx; ++x) {
      const std::size_t i = x + nx * z;
      if (x > 0) relax(i, i - 1);
      if (z > 0) relax(i, i - nx);
      if (x > 0 && z > 0) relax(i, i - nx - 1);
      if (x + 1 < nx && z > 0) relax(i, i - nx + 1);
    }
  }
  for (std::size_t z = nz; z-- > 0;) {
    for (std::size_t x = nx; x-- > 0;) {
      const std::size_t i = x + nx * z;
      if (x + 1 < nx) relax(i, i + 1);
      if (z + 1 < nz) relax(i, i + nx);
      if (x + 1 < nx && z + 1 < nz) relax(i, i + nx + 1);
      if (x > 0 && z + 1 < nz) relax(i, i + nx - 1);
    }
  }
  return d;
}

/// Morphological closing: sets cells that no empty square of `width` cells fits over.
inline void close_mask(std::vector<std::uint8_t>& mask, std::size_t nx, std::size_t nz, int width) {
  const int radius = width / 2;
  if (radius <= 0) return;
  const std::vector<int> to_set = distances(mask, nx, nz, radius);
  std::vector<std::uint8_t> empty(mask.size());
  for (std::size_t i = 0; i < mask.size(); ++i) empty[i] = to_set[i] > radius ? 1 : 0;
  const std::vector<int> to_empty = distances(empty, nx, nz, radius);
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = mask[i] != 0 || to_empty[i] > radius ? 1 : 0;
}

/// Gives small gaps in the floor the floor's level. What stands there keeps them from being walkable.
inline std::size_t close_holes(const VoxelGrid& g, std::vector<std::size_t>& tops, const FloorField& floor,
                        int width) {
  std::vector<std::uint8_t> mask(tops.size());
  for (std::size_t i = 0; i < tops.size(); ++i) mask[i] = tops[i] != kNone ? 1 : 0;
  close_mask(mask, g.nx, g.nz, width);
  std::size_t filled = 0;
  for (std::size_t i = 0; i < tops.size(); ++i) {
    if (tops[i] != kNone || mask[i] == 0) continue;
    tops[i] = floor.at(i % g.nx, i / g.nx);
    filled += tops[i] != kNone ? 1 : 0;
  }
  return filled;
}

/// Which columns lie below a ceiling, holes in it of up to `width` cells closed.
inline std::vector<std::uint8_t> covered_columns(const VoxelGrid& g, const std::vector<std::size_t>& tops,
                                          std::size_t clearance, int width) {
  std::vector<std::uint8_t> mask(tops.size(), 0);
  for (std::size_t i = 0; i < tops.size(); ++i) {
    if (tops[i] == kNone) continue;
    for (std::size_t y = tops[i] + clearance; y < g.ny && mask[i] == 0; ++y) {
      mask[i] = g.solid[g.at(i % g.nx, y, i / g.nx)];
    }
  }
  close_mask(mask, g.nx, g.nz, width);
  return mask;
}

}  // namespace gsnav::detail
