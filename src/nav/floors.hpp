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

// The search for floors in its steps: storeys (storeys.cpp), their marks in each column
// (floor_marks.cpp), the stairs between them (stairs.cpp).

namespace gsnav::detail::floors {

inline constexpr double kPatch = 1.0;  // metres: side of the squares that a floor is followed by
inline constexpr double kApart = 2.0;  // metres between storeys
inline constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
inline constexpr std::uint16_t kNoLevel = std::numeric_limits<std::uint16_t>::max();
inline constexpr std::int32_t kNotWalkable = -1, kFree = -2;  // labels of runs; storeys from 0

/// Levels free above run k of a column; all where nothing is above.
inline std::size_t room_above(std::span<const SolidRun> runs, std::size_t k) noexcept {
  return k + 1 < runs.size() ? std::size_t{runs[k + 1].low} - runs[k].end : kNone;
}

/// Morphological closing: sets cells that no empty square of `width` cells fits over.
void close_mask(std::vector<std::uint8_t>& mask, std::size_t nx, std::size_t nz, int width);

/// Where a storey stands in one patch: scans drift by decimetres over a flat and real floors slope.
struct PatchLevel {
  std::int32_t storey = 0;
  double level = 0;       // at the patch's centre
  double gx = 0, gz = 0;  // levels a patch
};

/// A column and the level of the floor in it.
struct Mark {
  std::uint32_t column = 0;
  std::uint16_t top = 0;
  friend auto operator<=>(const Mark&, const Mark&) = default;
};

/// Ground beside the storeys, connected by the agent's climb.
struct Piece {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> runs;    // column, run
  std::vector<std::pair<std::uint32_t, std::uint32_t>> beside;  // of the storeys next to it
  std::vector<std::int32_t> storeys;
};

struct Storey {
  std::vector<std::size_t> patches;
  double level = 0;    // mean of the patches
  double columns = 0;  // that have room for the agent
  double covered = 0;  // share of the marks that have something solid above head height
  bool kept = false;
  bool inside = false;  // kept because it is the main one or lies under a ceiling, not for stairs alone
  std::size_t holes = 0;
  std::vector<Mark> marks;
  std::vector<std::uint8_t> roofed;  // of each mark
};

/// The search for the floors of one scene.
class Floors {
 public:
  Floors(VoxelGrid& g, const FloorSettings& s, const GaussianNavOptions& o, ThreadPool& pool)
      : g_(g),
        s_(s),
        o_(o),
        pool_(pool),
        side_(max<std::size_t>(1, static_cast<std::size_t>(kPatch / g.cell + 0.5))),
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
  /// The heights at which columns of each patch end with room above, the fullest first, an agent's
  /// height apart.
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
  /// Where the floor stands in a patch, `band` levels around the plane that a neighbour expects: the
  /// mean level around the fullest. None where fewer than a twentieth of the patch's columns end there.
  std::optional<PatchLevel> fit(std::size_t patch, const PatchLevel& expected, std::size_t band,
                                double& columns) const;
  /// A storey from where it stands within `near` levels of the seeds: patches follow their neighbours'
  /// planes.
  void grow(std::span<const Seed> seeds, std::size_t near);
  /// Further storeys: from the fullest heights that are as far from every floor beside them as storeys
  /// are apart.
  void find_storeys();
  bool is_furniture(std::size_t patch, double level) const;
  /// Level of a storey in a column, interpolated between the patches' centres; kNone away from all of
  /// its patches.
  std::size_t at(std::int32_t storey, std::size_t x, std::size_t z) const;

  // ---- floor_marks.cpp
  /// The floor of a storey in each column: the highest run that ends within the band. Pits below the
  /// floor's own level are noise and are levelled; small gaps get the floor's level (what stands there
  /// keeps them from being walkable).
  void mark(std::int32_t id);
  /// Gives pits below a floor its own level, or the height of most ground within 0.1 m where that is
  /// lower: a tread of stairs at the floor's edge is no pit.
  void raise_pits(std::int32_t id, std::size_t x0, std::size_t z0, std::size_t nx,
                  std::vector<std::uint16_t>& tops);
  /// Solid voxels above and below the main floor in its columns and those up to a patch beside it (what
  /// stands on a floor covers it), beyond its band.
  void weigh(GaussianNavReport& report) const;

  // ---- stairs.cpp
  /// Whether the ground around a run of a column goes on, no steeper than the agent walks, in three of
  /// four directions: stairs do, the side of a bush does not.
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
  /// Stairs and ramps: ground beside the floors, connected by the agent's climb, that reaches two of
  /// them. Keeps the storeys that they lead to.
  std::vector<Mark> find_stairs(GaussianNavReport& report);
  /// The height of each walkable run without the noise of Gaussians that stand on edge: the median of
  /// the ground within 0.1 m that two steps can reach. A step of more than the agent's climb stays one.
  void find_heights();
  /// Gives stairs, and the floors within kStairHead of them, the mean height of the ground within
  /// kRampRadius that a step reaches. That is a ramp without steps, whatever the grid's offset: no step
  /// is too high for Recast, and erosion widens none. Takes off the voxels that stand out of it.
  void level_ramps(std::span<const Piece> pieces, std::vector<Mark>& out);
  /// Closes small gaps in stairs.
  void fill_stairs(const Piece& p, std::vector<Mark>& out, GaussianNavReport& report);

  VoxelGrid& g_;
  const FloorSettings& s_;
  const GaussianNavOptions& o_;
  ThreadPool& pool_;
  std::size_t side_, px_, pz_;
  std::vector<std::vector<PatchLevel>> patches_;
  double apart_;
  std::vector<Peak> peaks_;
  std::vector<Storey> storeys_;
  std::vector<std::int32_t> label_;    // of each run: a storey, kNotWalkable or kFree
  std::vector<std::uint16_t> height_;  // of each walkable run
  std::vector<std::uint16_t> ramp_;    // level of each run that is or leads to stairs, or kNoLevel
};

}  // namespace gsnav::detail::floors
