// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "gaussian_floor.hpp"

// Search for floors: storeys (storeys.cpp), the floor of a storey in each column (floor_marks.cpp), and
// stairs between storeys (stairs.cpp).

namespace gsnav::detail::floors {

inline constexpr double kPatch = 1.0;  // Side of the square patches that a floor consists of, metres.
inline constexpr double kApart = 2.0;  // Smallest height difference of storeys, metres.
inline constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
inline constexpr std::uint16_t kNoLevel = std::numeric_limits<std::uint16_t>::max();
/// Labels of runs. Storeys are numbered from 0.
inline constexpr std::int32_t kNotWalkable = -1, kFree = -2;

/// Free levels above run k of a column. kNone if nothing is above.
inline std::size_t room_above(std::span<const SolidRun> runs, std::size_t k) noexcept {
  return k + 1 < runs.size() ? std::size_t{runs[k + 1].low} - runs[k].end : kNone;
}

/// Morphological closing: sets all cells that no empty square of `width` cells covers.
void close_mask(std::vector<std::uint8_t>& mask, std::size_t nx, std::size_t nz, int width);

/// Height of a storey in one patch. It varies, because scans drift by decimetres over a flat and real
/// floors slope.
struct PatchLevel {
  std::int32_t storey = 0;
  double level = 0;       // At the centre of the patch.
  double gx = 0, gz = 0;  // Slope in levels per patch.
};

/// Level of the floor in a column.
struct Mark {
  std::uint32_t column = 0;
  std::uint16_t top = 0;
  friend auto operator<=>(const Mark&, const Mark&) = default;
};

/// Connected ground outside the storeys. Neighbouring cells differ by at most the agent's climb height.
struct GroundPiece {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> runs;  // Pairs (column, run).
  // Pairs (column, run) of adjacent storeys.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> beside;
  std::vector<std::int32_t> storeys;
};

/// Patches of ground at about one height. They become a storey if `kept`.
struct StoreyCandidate {
  std::vector<std::size_t> patches;
  double level = 0;    // Mean over the patches.
  double columns = 0;  // Number of columns with enough free height for the agent.
  double covered = 0;  // Fraction of the marks with something solid above head height.
  bool kept = false;
  bool inside = false;  // Kept because it is the main storey or has a ceiling, not only because stairs
                        // lead to it.
  std::size_t holes = 0;
  std::vector<Mark> marks;
  std::vector<std::uint8_t> roofed;  // One per mark.
};

/// Search for the floors of one scene.
class Floors {
 public:
  Floors(VoxelGrid& g, const FloorSettings& s, const GaussianNavOptions& o, ThreadPool& pool)
      : g_(g),
        s_(s),
        o_(o),
        pool_(pool),
        side_(g.cells_in(kPatch)),
        px_((g.nx + side_ - 1) / side_),
        pz_((g.nz + side_ - 1) / side_),
        patches_(px_ * pz_),
        apart_(max(static_cast<double>(s.clearance), kApart / g.level)) {}

  FloorTops find(GaussianNavReport& report, double& most_area);

 private:
  struct Seed {
    std::size_t patch = 0;
    double level = 0;
  };
  struct Peak {
    std::size_t patch = 0, level = 0;
    double columns = 0;
  };

  void progress(double share) const {
    if (o_.progress) o_.progress("floors", share);
  }

  template <class F>
  void each_column(std::size_t patch, F&& f) const {
    const std::size_t x0 = patch % px_ * side_, z0 = patch / px_ * side_;
    for (std::size_t z = z0; z < min(z0 + side_, g_.nz); ++z) {
      for (std::size_t x = x0; x < min(x0 + side_, g_.nx); ++x) f(x, z, g_.runs_of(x + g_.nx * z));
    }
  }
  double least_columns() const noexcept { return 0.05 * static_cast<double>(side_ * side_); }

  // ---- storeys.cpp
  /// Finds the heights in each patch at which most columns end with free space above. They are at least
  /// an agent's height apart, and sorted by number of columns.
  void find_peaks();
  const PatchLevel* level_of(std::size_t patch, std::int32_t storey) const noexcept {
    for (const PatchLevel& l : patches_[patch]) {
      if (l.storey == storey) return &l;
    }
    return nullptr;
  }
  bool taken(std::size_t patch, double level) const noexcept {
    return std::any_of(patches_[patch].begin(), patches_[patch].end(),
                       [&](const PatchLevel& l) { return std::abs(l.level - level) < apart_; });
  }
  /// Fits the floor in a patch: the mean level around the most frequent level within `band` levels of
  /// the plane that a neighbour predicts. Nothing if fewer than a twentieth of the columns end there.
  std::optional<PatchLevel> fit(std::size_t patch, const PatchLevel& expected, std::size_t band,
                                double& columns) const;
  /// Grows a storey from seeds, which may be off by `near` levels. Each patch follows the planes of its
  /// neighbours.
  void grow(std::span<const Seed> seeds, std::size_t near);
  /// Finds further storeys, starting at the most frequent heights that are far enough from every
  /// adjacent floor.
  void find_storeys();
  bool is_furniture(std::size_t patch, double level) const;
  /// Level of a storey in a column, interpolated between centres of patches. kNone away from its
  /// patches.
  std::size_t at(std::int32_t storey, std::size_t x, std::size_t z) const;

  // ---- floor_marks.cpp
  /// Finds the floor of a storey in each column: the highest run that ends within the band. Pits below
  /// the level of the floor are noise and are filled. Small gaps get the floor's level; objects that
  /// stand there keep them from being walkable.
  void mark(std::int32_t id);
  /// Raises pits below a floor to its level, or to the height of most ground within 0.1 m if that is
  /// lower. The latter keeps treads of stairs at the edge of a floor.
  void raise_pits(std::int32_t id, std::size_t x0, std::size_t z0, std::size_t nx,
                  std::vector<std::uint16_t>& tops);
  /// Counts solid voxels above and below the band of the main floor, in its columns and up to one patch
  /// around them.
  void weigh(GaussianNavReport& report) const;

  // ---- stairs.cpp
  /// Returns true if the ground around a run continues in at least three of four directions and is no
  /// steeper than the agent can walk. This holds for stairs, but not for the side of a bush.
  bool goes_on(std::size_t c, std::size_t top) const noexcept;
  template <class F>
  void each_neighbour(std::size_t c, std::uint32_t run, F&& f) const {
    const std::size_t x = c % g_.nx, z = c / g_.nx, top = height_[run];
    const auto visit = [&](std::size_t n) {
      for (std::uint32_t r = g_.first[n]; r < g_.first[n + 1]; ++r) {
        if (label_[r] == kNotWalkable) continue;
        const std::size_t other = height_[r];
        if (max(other, top) - min(other, top) <= s_.climb) f(n, r);
      }
    };
    if (x > 0) visit(c - 1);
    if (x + 1 < g_.nx) visit(c + 1);
    if (z > 0) visit(c - g_.nx);
    if (z + 1 < g_.nz) visit(c + g_.nx);
  }
  /// Finds stairs and ramps: ground outside the floors, connected by the agent's climb height, that
  /// reaches two of them. Marks the storeys they lead to as kept.
  std::vector<Mark> find_stairs(GaussianNavReport& report);
  /// Computes the height of each walkable run without the noise of Gaussians that stand on edge: the
  /// median of the ground within 0.1 m that two steps can reach. Steps above the agent's climb height
  /// are preserved.
  void find_heights();
  /// Turns stairs into ramps: replaces the height of stairs, and of floors within kStairHead of them, by
  /// the mean of the ground within kRampRadius that one step reaches. No step is then too high for
  /// Recast and erosion widens none, whatever the offset of the grid. Removes voxels that stick out.
  void level_ramps(std::span<const GroundPiece> pieces, std::vector<Mark>& out);
  /// Closes small gaps in stairs.
  void fill_stairs(const GroundPiece& p, std::vector<Mark>& out, GaussianNavReport& report);

  VoxelGrid& g_;
  const FloorSettings& s_;
  const GaussianNavOptions& o_;
  ThreadPool& pool_;
  std::size_t side_, px_, pz_;
  std::vector<std::vector<PatchLevel>> patches_;
  double apart_;
  std::vector<Peak> peaks_;
  std::vector<StoreyCandidate> storeys_;
  std::vector<std::int32_t> label_;    // One per run: a storey, kNotWalkable or kFree.
  std::vector<std::uint16_t> height_;  // One per walkable run.
  std::vector<std::uint16_t> ramp_;    // Level of each run that is part of stairs or leads to them, or
                                       // kNoLevel.
};

}  // namespace gsnav::detail::floors
