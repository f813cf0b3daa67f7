// SPDX-License-Identifier: Apache-2.0
#include "gsnav/nav/gaussian_navmesh.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "gaussian_voxels.hpp"
#include "navmesh_impl.hpp"

namespace gsnav {
namespace {

using detail::VoxelGrid;

Status validate(const GaussianNavOptions& o) {
  struct Field {
    const char* name;
    double value, low, high;
  };
  const Field fields[] = {
      {"min_opacity", o.min_opacity, 0.0, 1.0},      {"sigmas", o.sigmas, 0.1, 10.0},
      {"solid_alpha", o.solid_alpha, 0.01, 0.999999}, {"max_hole", o.max_hole, 0.0, 100.0},
      {"floor_band", o.floor_band, 0.0, 1000.0},      {"min_island_area", o.min_island_area, 0.0, 1e9},
  };
  for (const Field& f : fields) {
    if (!(f.value >= f.low && f.value <= f.high)) {
      return {Errc::invalid_argument, std::string("GaussianNavOptions.") + f.name + " = " +
                                          std::to_string(f.value) + " is not in [" +
                                          std::to_string(f.low) + ", " + std::to_string(f.high) + "]"};
    }
  }
  return {};
}

/// Level of a voxel whose top is walkable, per column; kNone where there is none.
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// Levels free above (x, level, z) before the next solid voxel; `covered` tells whether there is one.
std::size_t free_above(const VoxelGrid& g, std::size_t x, std::size_t level, std::size_t z, bool& covered) {
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
Floor find_floor(const VoxelGrid& g, std::size_t clearance, std::size_t smooth) {
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
std::vector<std::size_t> floor_tops(const VoxelGrid& g, const FloorField& floor, std::size_t band) {
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
std::vector<int> distances(const std::vector<std::uint8_t>& set, std::size_t nx, std::size_t nz, int limit) {
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
void close_mask(std::vector<std::uint8_t>& mask, std::size_t nx, std::size_t nz, int width) {
  const int radius = width / 2;
  if (radius <= 0) return;
  const std::vector<int> to_set = distances(mask, nx, nz, radius);
  std::vector<std::uint8_t> empty(mask.size());
  for (std::size_t i = 0; i < mask.size(); ++i) empty[i] = to_set[i] > radius ? 1 : 0;
  const std::vector<int> to_empty = distances(empty, nx, nz, radius);
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = mask[i] != 0 || to_empty[i] > radius ? 1 : 0;
}

/// Gives small gaps in the floor the floor's level. What stands there keeps them from being walkable.
std::size_t close_holes(const VoxelGrid& g, std::vector<std::size_t>& tops, const FloorField& floor,
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
std::vector<std::uint8_t> covered_columns(const VoxelGrid& g, const std::vector<std::size_t>& tops,
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

/// Drops pieces of the floor that are too small to be a place.
struct Pruner {
  double min_area;
  GaussianNavReport& report;

  void operator()(rcCompactHeightfield& f) const {
    const auto count = static_cast<std::size_t>(f.spanCount);
    const double cell_area = static_cast<double>(f.cs) * static_cast<double>(f.cs);
    std::vector<int> column(count);
    for (int c = 0; c < f.width * f.height; ++c) {
      for (unsigned i = 0; i < f.cells[c].count; ++i) column[f.cells[c].index + i] = c;
    }
    std::vector<std::uint8_t> seen(count, 0);
    std::vector<std::size_t> piece;
    for (std::size_t start = 0; start < count; ++start) {
      if (f.areas[start] == RC_NULL_AREA || seen[start] != 0) continue;
      piece.assign(1, start);
      seen[start] = 1;
      for (std::size_t k = 0; k < piece.size(); ++k) {
        const std::size_t i = piece[k];
        const int x = column[i] % f.width, z = column[i] / f.width;
        for (int dir = 0; dir < 4; ++dir) {
          const int link = rcGetCon(f.spans[i], dir);
          if (link == RC_NOT_CONNECTED) continue;
          const int c = (x + rcGetDirOffsetX(dir)) + (z + rcGetDirOffsetY(dir)) * f.width;
          const std::size_t n = f.cells[c].index + static_cast<unsigned>(link);
          if (f.areas[n] == RC_NULL_AREA || seen[n] != 0) continue;
          seen[n] = 1;
          piece.push_back(n);
        }
      }
      const double area = static_cast<double>(piece.size()) * cell_area;
      if (area >= min_area) continue;
      for (const std::size_t i : piece) f.areas[i] = RC_NULL_AREA;
      report.dropped_small += area;
    }
  }
};

Status add_spans(detail::RecastLog& log, const VoxelGrid& g, const std::vector<std::size_t>& tops, int climb,
                 rcHeightfield& field) {
  for (std::size_t z = 0; z < g.nz; ++z) {
    for (std::size_t x = 0; x < g.nx; ++x) {
      const std::size_t top = tops[x + g.nx * z];
      const auto add = [&](std::size_t first, std::size_t end) {
        const unsigned char area = top != kNone && end == top + 1 ? RC_WALKABLE_AREA : RC_NULL_AREA;
        return rcAddSpan(&log, field, static_cast<int>(x), static_cast<int>(z),
                         static_cast<unsigned short>(first), static_cast<unsigned short>(end), area, climb);
      };
      const auto solid = [&](std::size_t y) { return g.solid[g.at(x, y, z)] != 0 || y == top; };
      for (std::size_t y = 0; y < g.ny;) {
        if (!solid(y)) {
          ++y;
          continue;
        }
        const std::size_t first = y;
        while (y < g.ny && solid(y)) ++y;
        if (!add(first, y)) return detail::stage("adding spans", log);
      }
    }
  }
  return {};
}

}  // namespace

Result<NavMeshFromGaussians> build_navmesh(const NavMeshSettings& settings,
                                           std::span<const GaussianSet> sets,
                                           const GaussianNavOptions& options) {
  if (Status s = settings.validate(); !s.ok()) return s;
  if (Status s = validate(options); !s.ok()) return s;
  GaussianNavReport report;
  auto voxels = detail::voxelise(settings, sets, options, report);
  if (!voxels.ok()) return voxels.status();
  const VoxelGrid& g = *voxels;
  const detail::VoxelSettings cells(settings);
  const auto levels = [&](double metres) { return static_cast<std::size_t>(std::floor(metres / g.level + 1e-6)); };

  const Floor floor = find_floor(g, static_cast<std::size_t>(cells.height), max<std::size_t>(1, levels(0.08)));
  const double least_area = max(options.min_island_area, g.cell * g.cell);
  if (!floor.found || floor.best_area < least_area) {
    return Status(Errc::nothing_navigable,
                  "NavMesh from Gaussians: no floor: at no height does solid ground with " +
                      std::to_string(settings.agent_height) + " m (agent_height) free above cover " +
                      std::to_string(least_area) + " m2; the most is " + std::to_string(floor.best_area) +
                      " m2, of " + std::to_string(report.solid_voxels) + " solid voxels");
  }
  // A floor's voxel holds its surface near the middle.
  report.floor_y = g.low.y + (static_cast<double>(floor.level) + 0.5) * g.level;
  const std::size_t band = levels(options.floor_band);
  const FloorField field_of_floor(g, floor.level, static_cast<std::size_t>(cells.height), band);
  std::vector<std::size_t> tops = floor_tops(g, field_of_floor, band);
  report.holes_filled = close_holes(g, tops, field_of_floor, static_cast<int>(options.max_hole / g.cell + 1e-6));
  const std::vector<std::uint8_t> covered =
      covered_columns(g, tops, static_cast<std::size_t>(cells.height), static_cast<int>(0.6 / g.cell));
  std::size_t on_floor = 0, below_ceiling = 0;
  for (std::size_t i = 0; i < tops.size(); ++i) {
    on_floor += tops[i] != kNone ? 1 : 0;
    below_ceiling += tops[i] != kNone && covered[i] != 0 ? 1 : 0;
  }
  report.ceiling_share = on_floor > 0 ? static_cast<double>(below_ceiling) / static_cast<double>(on_floor) : 0;
  if (options.drop_uncovered && report.ceiling_share > 0.5) {
    for (std::size_t i = 0; i < tops.size(); ++i) {
      if (tops[i] != kNone && covered[i] == 0) tops[i] = kNone;
    }
    report.dropped_uncovered = static_cast<double>(on_floor - below_ceiling) * g.cell * g.cell;
  }

  detail::RecastLog log;
  const Vec3d extent{static_cast<double>(g.nx) * g.cell, static_cast<double>(g.ny) * g.level,
                     static_cast<double>(g.nz) * g.cell};
  auto field = detail::make_heightfield(log, settings, {}, extent);
  if (!field.ok()) return field.status();
  if (Status s = add_spans(log, g, tops, cells.climb, **field); !s.ok()) return s;
  // Tops of voxels stand half a voxel above the surface in them.
  const Vec3d origin = g.low - Vec3d{0, 0.5 * g.level, 0};
  auto mesh = detail::finish_navmesh(log, settings, **field, origin,
                                     {Pruner{options.min_island_area, report}, {}});
  if (!mesh.ok()) {
    return Status(mesh.code(), mesh.message() + "; floor found at y = " + std::to_string(report.floor_y) +
                                   ", left out as too small " +
                                   std::to_string(report.dropped_small) + " m2, as outside " +
                                   std::to_string(report.dropped_uncovered) + " m2");
  }
  report.area = mesh->navigable_area();
  for (std::size_t i = 0; i < mesh->island_count(); ++i) report.island_areas.push_back(mesh->island_area(i));
  return NavMeshFromGaussians{std::move(*mesh), std::move(report)};
}

}  // namespace gsnav
