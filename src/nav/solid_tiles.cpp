// SPDX-License-Identifier: Apache-2.0
// Voxels that opaque Gaussians fill, tile by tile.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

#include "gsnav/detail/core/list_by_group.hpp"
#include "gsnav/detail/core/run_guarded.hpp"
#include "solid_gaussians.hpp"

namespace gsnav::detail::solids {
namespace {

/// Contribution of one Gaussian to the voxels that it reaches. It is widened by the variance of a voxel,
/// so that a disc thinner than a voxel reaches the centre.
class SolidSplat {
 public:
  /// Prepares a Gaussian. Returns false if it reaches no voxel of the grid.
  bool set(const VoxelGrid& g, const Solid& s, double sigmas) {
    const double vc = g.cell * g.cell / 12.0, vl = g.level * g.level / 12.0;
    Mat3d cov = s.axes * transpose(s.axes);
    cov(0, 0) += vc;
    cov(1, 1) += vl;
    cov(2, 2) += vc;
    const double det = determinant(cov);
    if (!(det > 0) || !is_finite(det)) return false;
    inv_ = transpose(cofactors(cov)) * (1.0 / det);
    mean_ = s.mean;
    opacity_ = s.opacity;
    const std::size_t n[3] = {g.nx, g.ny, g.nz};
    const double size[3] = {g.cell, g.level, g.cell};
    for (int k = 0; k < 3; ++k) {
      const double reach = sigmas * std::sqrt(cov(k, k)), c = s.mean[k] - g.low[k];
      const double a = std::ceil((c - reach) / size[k] - 0.5),
                   b = std::floor((c + reach) / size[k] - 0.5);
      if (b < 0 || a > static_cast<double>(n[k] - 1) || a > b) return false;
      first[k] = static_cast<std::size_t>(max(a, 0.0));
      last[k] = static_cast<std::size_t>(min(b, static_cast<double>(n[k] - 1)));
    }
    return true;
  }

  /// Calls f(level, q) for the levels of a column whose squared Mahalanobis distance q is at most `cut`.
  template <class F>
  void column(const VoxelGrid& g, std::size_t x, std::size_t z, double cut, F&& f) const {
    const double dx = g.low.x + (static_cast<double>(x) + 0.5) * g.cell - mean_.x;
    const double dz = g.low.z + (static_cast<double>(z) + 0.5) * g.cell - mean_.z;
    // q is a parabola over the level. Solve it for the levels, with one more on each side for rounding.
    const double side = inv_(1, 0) * dx + inv_(1, 2) * dz, bend = inv_(1, 1);
    const double least =
        inv_(0, 0) * dx * dx + 2 * inv_(0, 2) * dx * dz + inv_(2, 2) * dz * dz - side * side / bend;
    if (least > cut + 1e-6 * (1 + cut)) return;
    const double half = std::sqrt(max(cut - least, 0.0) / bend) + g.level,
                 middle = mean_.y - side / bend - g.low.y;
    const double a = (middle - half) / g.level - 0.5, b = (middle + half) / g.level - 0.5;
    if (b < 0 || a > static_cast<double>(last[1])) return;
    const std::size_t y1 = min(last[1], static_cast<std::size_t>(b));
    for (std::size_t y = max(first[1], static_cast<std::size_t>(max(a, 0.0))); y <= y1; ++y) {
      const Vec3d d{dx, g.low.y + (static_cast<double>(y) + 0.5) * g.level - mean_.y, dz};
      const double q = dot(d, inv_ * d);
      if (q <= cut) f(y, q);
    }
  }

  double opacity() const noexcept { return opacity_; }
  std::size_t first[3] = {}, last[3] = {};  ///< Range of voxels that it may reach along each axis.

 private:
  Mat3d inv_{};
  Vec3d mean_{};
  double opacity_ = 0;
};

constexpr std::size_t kTile = 64;  // Side of the tile of columns that one thread rasterizes at a time.
constexpr std::size_t kBrick = 8;  // Side of the block of voxels that is allocated together.

/// Sum of -log(1 - alpha) over Gaussians, in bricks of 8 x 8 x 8 voxels that are allocated when first
/// touched.
class TileMass {
 public:
  explicit TileMass(std::size_t levels)
      : high_((levels + kBrick - 1) / kBrick),
        table_(kTile / kBrick * (kTile / kBrick) * high_, kNoBrick) {}

  void clear() {
    std::fill(table_.begin(), table_.end(), kNoBrick);
    mass_.clear();
  }
  /// Value of a voxel. `x` and `z` are within the tile.
  float& at(std::size_t x, std::size_t y, std::size_t z) {
    std::uint32_t& brick = table_[(z / kBrick * (kTile / kBrick) + x / kBrick) * high_ + y / kBrick];
    if (brick == kNoBrick) {
      brick = static_cast<std::uint32_t>(mass_.size() / kVoxels);
      mass_.resize(mass_.size() + kVoxels, 0.0f);
    }
    return mass_[brick * kVoxels + (z % kBrick * kBrick + x % kBrick) * kBrick + y % kBrick];
  }
  /// Appends the solid runs of a column and returns their number. A voxel is solid if its mass is at
  /// least `least`. If a thin sheet lies on the face between two voxels, the heavier one is solid too,
  /// provided that a voxel centred on that face would be.
  std::uint32_t runs(std::size_t x, std::size_t z, std::size_t levels, float least,
                     std::vector<SolidRun>& out) const {
    const std::size_t before = out.size();
    const std::uint32_t* bricks = table_.data() + (z / kBrick * (kTile / kBrick) + x / kBrick) * high_;
    const auto mass = [&](std::size_t y) {
      if (y >= levels || bricks[y / kBrick] == kNoBrick)
        return 0.0f;  // Indices below 0 wrap around and
                      // are caught too.
      return mass_[bricks[y / kBrick] * kVoxels + (z % kBrick * kBrick + x % kBrick) * kBrick +
                   y % kBrick];
    };
    // SolidSplat widens a thin sheet to a variance of level^2 / 12. On the face between two voxels its
    // mass is exp(1.5) times the geometric mean of their masses, and the next voxels have almost none.
    constexpr float kFace = 4.4816890703f;
    const auto sheet = [&](std::size_t y) {
      return mass(y) < least && mass(y + 1) < least &&
             kFace * (std::sqrt(mass(y) * mass(y + 1)) - mass(y - 1) - mass(y + 2)) >= least;
    };
    bool open = false;
    for (std::size_t y = 0; y < levels; ++y) {
      if (bricks[y / kBrick] == kNoBrick) {
        open = false;
        y |= kBrick - 1;
        continue;
      }
      const float m = mass(y);
      const bool thin =
          m > 0 && m < least && ((m > mass(y + 1) && sheet(y)) || (m >= mass(y - 1) && sheet(y - 1)));
      const bool solid = m >= least || thin;
      if (solid && !open) out.push_back({static_cast<std::uint16_t>(y), 0, false});
      if (solid) {
        out.back().end = static_cast<std::uint16_t>(y + 1);
        out.back().thin = thin;
      }
      open = solid;
    }
    return static_cast<std::uint32_t>(out.size() - before);
  }

 private:
  static constexpr std::uint32_t kNoBrick = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t kVoxels = kBrick * kBrick * kBrick;
  std::size_t high_;
  std::vector<std::uint32_t> table_;
  std::vector<float> mass_;
};

/// Gaussians that reach each tile of columns, in order.
struct TileLists {
  struct ColumnBox {
    std::uint16_t x0 = 1, x1 = 0, z0 = 1, z1 = 0;  // Empty if x0 > x1.
  };
  std::size_t nx, nz;
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> rows;  // Numbered through all sets.

  TileLists(const VoxelGrid& g, std::span<const GaussianSet> sets, const GaussianNavOptions& o,
            GaussianNavReport& report)
      : nx((g.nx + kTile - 1) / kTile), nz((g.nz + kTile - 1) / kTile) {
    std::vector<ColumnBox> reach;
    Solid s;
    SolidSplat splat;
    for (const GaussianSet& set : sets) {
      const PlacedSet placed(set);
      for (std::size_t i = 0; i < set.gaussians.size(); ++i) {
        reach.emplace_back();
        if (!placed.read(i, o.min_opacity, s)) {
          ++report.gaussians_faint;
        } else if (!splat.set(g, s, o.sigmas)) {
          ++report.gaussians_outside;
        } else {
          ++report.gaussians_used;
          const auto tile = [](std::size_t v) { return static_cast<std::uint16_t>(v / kTile); };
          reach.back() = {tile(splat.first[0]), tile(splat.last[0]), tile(splat.first[2]),
                          tile(splat.last[2])};
        }
      }
    }
    list_by_group(reach.size(), nx * nz, first, rows, [&](std::size_t i, const auto& f) {
      const ColumnBox& r = reach[i];
      if (r.x0 > r.x1) return;
      for (std::size_t z = r.z0; z <= r.z1; ++z) {
        for (std::size_t x = r.x0; x <= r.x1; ++x) f(x + nx * z);
      }
    });
  }
};

/// Runs of one tile, column by column.
struct TileRuns {
  std::vector<std::uint32_t> counts;
  std::vector<SolidRun> runs;
};

/// Joins the runs of all tiles, column by column.
Status join_tiles(VoxelGrid& g, const TileLists& lists, std::vector<TileRuns>& tiles) {
  g.first.assign(g.nx * g.nz + 1, 0);
  const auto columns = [&](std::size_t t, const auto& f) {
    const std::size_t x0 = t % lists.nx * kTile, z0 = t / lists.nx * kTile,
                      width = min(kTile, g.nx - x0);
    for (std::size_t i = 0, k = 0; i < tiles[t].counts.size(); k += tiles[t].counts[i++]) {
      f(x0 + i % width + g.nx * (z0 + i / width), tiles[t].counts[i], k);
    }
  };
  std::size_t all = 0;
  for (const TileRuns& t : tiles) all += t.runs.size();
  if (all >= std::numeric_limits<std::uint32_t>::max()) {
    return {Errc::out_of_memory,
            "NavMesh from Gaussians: more than 2^32 runs of solid voxels; use larger cells "
            "(cell_size, --cell-size) or crop the scene (GaussianNavOptions.crop, --crop)"};
  }
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    columns(t, [&](std::size_t c, std::uint32_t n, std::size_t) { g.first[c + 1] = n; });
  }
  for (std::size_t c = 1; c < g.first.size(); ++c) g.first[c] += g.first[c - 1];
  g.runs.resize(all);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    columns(t, [&](std::size_t c, std::uint32_t n, std::size_t k) {
      std::copy_n(tiles[t].runs.begin() + static_cast<std::ptrdiff_t>(k), n,
                  g.runs.begin() + static_cast<std::ptrdiff_t>(g.first[c]));
    });
    tiles[t] = {};
  }
  return {};
}

}  // namespace

Status rasterise_tiles(VoxelGrid& g, std::span<const GaussianSet> sets, const GaussianNavOptions& o,
                       ThreadPool& pool, GaussianNavReport& report) {
  const TileLists lists(g, sets, o, report);
  std::vector<PlacedSet> placed;
  std::vector<std::size_t> begins;
  std::size_t total = 0;
  for (const GaussianSet& set : sets) {
    placed.emplace_back(set);
    begins.push_back(total);
    total += set.gaussians.size();
  }
  const double cut = o.sigmas * o.sigmas;
  const float least = static_cast<float>(-std::log1p(-o.solid_alpha));
  std::vector<TileRuns> tiles(lists.nx * lists.nz);
  std::mutex lock;
  std::size_t done = 0;
  const auto tile = [&](std::size_t t) {
    TileRuns& out = tiles[t];
    const std::size_t x0 = t % lists.nx * kTile, z0 = t / lists.nx * kTile;
    const std::size_t x1 = min(x0 + kTile, g.nx), z1 = min(z0 + kTile, g.nz);
    out.counts.assign((x1 - x0) * (z1 - z0), 0);
    if (lists.first[t] == lists.first[t + 1]) return;
    TileMass mass(g.ny);
    Solid s;
    SolidSplat splat;
    for (std::size_t k = lists.first[t]; k < lists.first[t + 1]; ++k) {
      std::size_t set = 0;
      while (set + 1 < begins.size() && lists.rows[k] >= begins[set + 1]) ++set;
      if (!placed[set].read(lists.rows[k] - begins[set], o.min_opacity, s) || !splat.set(g, s, o.sigmas))
        continue;
      // Within this distance, the Gaussian alone makes a voxel solid.
      const double enough = o.solid_alpha < 0.99 && s.opacity > o.solid_alpha
                                ? 2 * std::log(s.opacity / o.solid_alpha) - 1e-6
                                : -1.0;
      for (std::size_t z = max(z0, splat.first[2]); z <= min(z1 - 1, splat.last[2]); ++z) {
        for (std::size_t x = max(x0, splat.first[0]); x <= min(x1 - 1, splat.last[0]); ++x) {
          splat.column(g, x, z, cut, [&](std::size_t y, double q) {
            float& m = mass.at(x - x0, y, z - z0);
            if (m >= least) return;
            if (q < enough) {
              m = least;
              return;
            }
            m -= static_cast<float>(std::log1p(-min(s.opacity * std::exp(-0.5 * q), 0.99)));
          });
        }
      }
    }
    for (std::size_t z = z0; z < z1; ++z) {
      for (std::size_t x = x0; x < x1; ++x) {
        out.counts[(z - z0) * (x1 - x0) + x - x0] = mass.runs(x - x0, z - z0, g.ny, least, out.runs);
      }
    }
    out.runs.shrink_to_fit();
  };
  std::atomic<bool> ended{false};  // The progress function threw: no tile is begun any more.
  const Status made = run_guarded(pool, static_cast<std::uint32_t>(tiles.size()), [&](std::uint32_t t) {
    if (ended) return Status();
    tile(t);
    if (!o.progress) return Status();
    const std::lock_guard held(lock);
    ++done;
    const Status told = guarded([&] {
      o.progress("voxels", static_cast<double>(done) / static_cast<double>(tiles.size()));
      return Status();
    });
    if (!told) ended = true;
    return told;
  });
  if (!made.ok()) return {made.code(), "NavMesh from Gaussians, solid voxels: " + made.message()};
  return join_tiles(g, lists, tiles);
}

}  // namespace gsnav::detail::solids
