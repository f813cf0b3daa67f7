// SPDX-License-Identifier: Apache-2.0
#include "gaussian_floor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace gsnav::detail {
namespace {

constexpr double kPatch = 1.0;  // metres: side of the squares that a floor is followed by
constexpr double kApart = 2.0;  // metres between storeys
constexpr std::size_t kBeside =
    3;  // patches around a floor in which what is nearer than kApart is furniture
constexpr double kLeastStorey = 4.0;  // square metres
constexpr double kStairHead = 1.0;    // metres: floor around stairs that is levelled with them
constexpr double kRampRadius = 0.15;  // metres that heights of stairs are averaged over
constexpr double kCoverGap = 0.6;     // metres: holes in a ceiling up to this wide are closed
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
constexpr std::uint16_t kNoLevel = std::numeric_limits<std::uint16_t>::max();
constexpr std::int32_t kNotWalkable = -1, kFree = -2;  // labels of runs; storeys from 0

/// Levels free above run k of a column; all where nothing is above.
std::size_t room_above(std::span<const SolidRun> runs, std::size_t k) noexcept {
  return k + 1 < runs.size() ? std::size_t{runs[k + 1].low} - runs[k].end : kNone;
}

/// The height at which the scene's main floor lies: the lowest at which a good share of the columns that
/// have room for the agent end. Columns below a ceiling decide where the scene has one: a garden around
/// a house is not its floor. Thin tops count little: noise under the ground is one too.
std::optional<std::size_t> main_level(const VoxelGrid& g, std::size_t clearance, std::size_t smooth,
                                      double& most_area) {
  std::vector<double> open(g.ny, 0.0), roofed(g.ny, 0.0);
  for (std::size_t c = 0; c < g.nx * g.nz; ++c) {
    const auto runs = g.runs_of(c);
    for (std::size_t k = 0; k < runs.size(); ++k) {
      if (room_above(runs, k) < clearance) continue;
      const double weight = runs[k].thin ? 0.125 : 1.0;
      open[runs[k].top()] += weight;
      if (k + 1 < runs.size()) roofed[runs[k].top()] += weight;
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
  most_area = most * g.cell * g.cell;
  if (!(top > 0)) return std::nullopt;
  std::size_t y = 0;
  while (score[y] < 0.4 * top) ++y;
  // The peak itself: the fullest level within twice the smoothing above.
  std::size_t level = y;
  for (std::size_t k = y; k <= min(y + 2 * smooth, g.ny - 1); ++k)
    level = raw[k] > raw[level] ? k : level;
  return level;
}

/// Distance from every cell to the nearest set one, in cells, chessboard metric, up to `limit`.
std::vector<int> distances(const std::vector<std::uint8_t>& set, std::size_t nx, std::size_t nz,
                           int limit) {
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
  std::size_t holes = 0;
  std::vector<Mark> marks;
  std::vector<std::uint8_t> roofed;  // of each mark
};

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

  FloorTops find(GaussianNavReport& report, double& most_area) {
    const std::size_t smooth =
        max<std::size_t>(1, static_cast<std::size_t>(std::floor(0.08 / g_.level + 1e-6)));
    const auto level = main_level(g_, s_.clearance, smooth, most_area);
    if (!level || most_area < max(o_.min_island_area, g_.cell * g_.cell)) return {};
    // A floor's voxel holds its surface near the middle.
    report.floor_y = g_.low.y + (static_cast<double>(*level) + 0.5) * g_.level;
    find_peaks();
    std::vector<Seed> seeds;
    for (std::size_t p = 0; p < patches_.size(); ++p) seeds.push_back({p, static_cast<double>(*level)});
    grow(seeds, 2);
    progress(0.2);
    find_storeys();
    label_.assign(g_.runs.size(), kNotWalkable);
    for (std::size_t i = 0; i < storeys_.size(); ++i) {
      mark(static_cast<std::int32_t>(i));
      if (i == 0) progress(0.5);
    }
    progress(0.7);
    const bool indoors = storeys_[0].covered > 0.5;
    report.ceiling_share = storeys_[0].covered;
    storeys_[0].kept = true;
    for (Storey& s : storeys_) {
      const bool above = s.level > storeys_[0].level - static_cast<double>(s_.band);
      s.kept = s.kept || (above && (o_.drop_uncovered ? indoors && s.covered > 0.5 : true));
    }
    std::vector<Mark> marks = find_stairs(report);
    progress(0.9);
    for (Storey& s : storeys_) {
      if (!s.kept) continue;
      double area = 0;
      for (std::size_t i = 0; i < s.marks.size(); ++i) {
        if (o_.drop_uncovered && indoors && s.roofed[i] == 0) {
          report.dropped_uncovered += g_.cell * g_.cell;
          continue;
        }
        area += g_.cell * g_.cell;
        Mark& m = s.marks[i];
        for (std::uint32_t r = g_.first[m.column]; r < g_.first[m.column + 1]; ++r) {
          const bool same = max(ramp_[r], m.top) - min(ramp_[r], m.top) < static_cast<int>(s_.clearance);
          if (ramp_[r] != kNoLevel && same) m.top = ramp_[r];
        }
        marks.push_back(m);
      }
      report.holes_filled += s.holes;
      report.storeys.push_back({g_.low.y + (s.level + 0.5) * g_.level, area});
    }
    std::sort(report.storeys.begin(), report.storeys.end(),
              [](const GaussianNavReport::Storey& a, const GaussianNavReport::Storey& b) {
                return a.height < b.height;
              });
    std::sort(marks.begin(), marks.end());
    marks.erase(std::unique(marks.begin(), marks.end()), marks.end());
    FloorTops out;
    out.first.assign(g_.nx * g_.nz + 1, 0);
    out.tops.reserve(marks.size());
    for (const Mark& m : marks) {
      ++out.first[m.column + 1];
      out.tops.push_back(m.top);
    }
    for (std::size_t c = 1; c < out.first.size(); ++c) out.first[c] += out.first[c - 1];
    weigh(report);
    return out;
  }

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

  /// The heights at which columns of each patch end with room above, the fullest first, an agent's
  /// height apart.
  void find_peaks() {
    std::vector<std::vector<Peak>> peaks(patches_.size());
    pool_.run(static_cast<std::uint32_t>(patches_.size()), [&](std::uint32_t p) noexcept {
      std::vector<std::uint16_t> tops;
      each_column(p, [&](std::size_t, std::size_t, std::span<const SolidRun> runs) {
        for (std::size_t k = 0; k < runs.size(); ++k) {
          if (room_above(runs, k) >= s_.clearance)
            tops.push_back(static_cast<std::uint16_t>(runs[k].top()));
        }
      });
      std::sort(tops.begin(), tops.end());
      while (true) {
        Peak best{p, 0, 0};
        for (std::size_t i = 0, low = 0, high = 0; i < tops.size(); ++i) {
          while (tops[low] + 1 < tops[i]) ++low;
          while (high < tops.size() && tops[high] <= tops[i] + 1) ++high;
          if (static_cast<double>(high - low) > best.columns)
            best = {p, tops[i], static_cast<double>(high - low)};
        }
        if (best.columns < least_columns()) break;
        peaks[p].push_back(best);
        std::erase_if(tops, [&](std::uint16_t y) {
          return y + s_.clearance > best.level && y < best.level + s_.clearance;
        });
      }
    });
    for (const auto& of_patch : peaks) peaks_.insert(peaks_.end(), of_patch.begin(), of_patch.end());
    std::stable_sort(peaks_.begin(), peaks_.end(),
                     [](const Peak& a, const Peak& b) { return a.columns > b.columns; });
  }

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
                                double& columns) const {
    const auto reach = static_cast<std::ptrdiff_t>(band) + 1;
    const bool flat = expected.gx == 0 && expected.gz == 0;
    const double base = flat ? std::floor(expected.level + 0.5) : expected.level;
    const double half = 0.5 * static_cast<double>(side_), side = static_cast<double>(side_);
    const double cx = static_cast<double>(patch % px_ * side_) + half,
                 cz = static_cast<double>(patch / px_ * side_) + half;
    std::vector<double> bins(static_cast<std::size_t>(2 * reach + 1), 0.0);
    struct Top {
      double u, v, y;
      std::ptrdiff_t off;
    };
    std::vector<Top> tops;
    each_column(patch, [&](std::size_t x, std::size_t z, std::span<const SolidRun> runs) {
      const double u = (static_cast<double>(x) + 0.5 - cx) / side,
                   v = (static_cast<double>(z) + 0.5 - cz) / side;
      const auto plane =
          static_cast<std::ptrdiff_t>(std::floor(base + expected.gx * u + expected.gz * v + 0.5));
      for (std::size_t k = 0; k < runs.size(); ++k) {
        const std::ptrdiff_t off = static_cast<std::ptrdiff_t>(runs[k].top()) - plane;
        if (off < -reach || off > reach || room_above(runs, k) < s_.clearance) continue;
        bins[static_cast<std::size_t>(off + reach)] += 1;
        tops.push_back({u, v, static_cast<double>(runs[k].top()), off});
      }
    });
    std::size_t best = 1;
    for (std::size_t b = 1; b + 1 < bins.size(); ++b) best = bins[b] > bins[best] ? b : best;
    double sum = 0, weight = 0;
    for (std::size_t b = best - 1; b <= best + 1; ++b) {
      sum += bins[b] * static_cast<double>(static_cast<std::ptrdiff_t>(b) - reach);
      weight += bins[b];
    }
    if (weight < least_columns()) return std::nullopt;
    columns = weight;
    PatchLevel out{expected.storey, max(base + sum / weight, 0.0), expected.gx, expected.gz};
    // The slope of what lies near that level, by least squares.
    double n = 0, mu = 0, mv = 0, my = 0;
    const auto near = [&](const Top& t) {
      return std::abs(t.off - (static_cast<std::ptrdiff_t>(best) - reach)) <= 2;
    };
    for (const Top& t : tops) {
      if (!near(t)) continue;
      n += 1;
      mu += t.u;
      mv += t.v;
      my += t.y;
    }
    double uu = 0, uv = 0, vv = 0, uy = 0, vy = 0;
    for (const Top& t : tops) {
      if (!near(t)) continue;
      const double u = t.u - mu / n, v = t.v - mv / n, y = t.y - my / n;
      uu += u * u;
      uv += u * v;
      vv += v * v;
      uy += u * y;
      vy += v * y;
    }
    const double det = uu * vv - uv * uv;
    if (n >= 8 * least_columns() && det > 1e-3 * n * n) {
      out.gx = (uy * vv - vy * uv) / det;
      out.gz = (vy * uu - uy * uv) / det;
      const double slope = std::hypot(out.gx, out.gz) * g_.level / (side * g_.cell);
      const double keep = slope < 0.1 ? 0.0 : min(1.0, s_.max_slope / slope);
      out.gx *= keep;
      out.gz *= keep;
    }
    return out;
  }

  /// A storey from where it stands within `near` levels of the seeds: patches follow their neighbours'
  /// planes.
  void grow(std::span<const Seed> seeds, std::size_t near) {
    const auto id = static_cast<std::int32_t>(storeys_.size());
    Storey storey;
    const auto add = [&](std::size_t p, const PatchLevel& expected, std::size_t band) {
      if (level_of(p, id) != nullptr || taken(p, expected.level)) return;
      double columns = 0;
      const auto found = fit(p, expected, band, columns);
      if (!found || taken(p, found->level)) return;
      patches_[p].push_back(*found);
      storey.patches.push_back(p);
      storey.columns += columns;
      storey.level += found->level;
    };
    for (const Seed& s : seeds) add(s.patch, {id, s.level, 0, 0}, near);
    for (std::size_t k = 0; k < storey.patches.size(); ++k) {
      const std::size_t p = storey.patches[k], x = p % px_, z = p / px_;
      const PatchLevel here = *level_of(p, id);
      const auto visit = [&](std::size_t n, double du, double dv) {
        add(n, {id, here.level + here.gx * du + here.gz * dv, here.gx, here.gz}, s_.band);
      };
      if (x > 0) visit(p - 1, -1, 0);
      if (x + 1 < px_) visit(p + 1, 1, 0);
      if (z > 0) visit(p - px_, 0, -1);
      if (z + 1 < pz_) visit(p + px_, 0, 1);
    }
    if (!storey.patches.empty()) storey.level /= static_cast<double>(storey.patches.size());
    storeys_.push_back(std::move(storey));
  }

  /// Further storeys: from the fullest heights that are as far from every floor beside them as storeys
  /// are apart.
  void find_storeys() {
    const double least = max(kLeastStorey, o_.min_island_area) / (g_.cell * g_.cell);
    for (const Peak& peak : peaks_) {
      if (2 * peak.columns < static_cast<double>(side_ * side_)) break;
      const double level = static_cast<double>(peak.level);
      if (taken(peak.patch, level) || is_furniture(peak.patch, level)) continue;
      const Seed seed{peak.patch, level};
      grow({&seed, 1}, 1);
      if (storeys_.back().columns >= least) continue;
      // Too small: what it took is free again.
      const auto id = static_cast<std::int32_t>(storeys_.size() - 1);
      for (const std::size_t p : storeys_.back().patches) {
        std::erase_if(patches_[p], [&](const PatchLevel& l) { return l.storey == id; });
      }
      storeys_.pop_back();
    }
  }
  bool is_furniture(std::size_t patch, double level) const {
    const std::size_t px = patch % px_, pz = patch / px_;
    for (std::size_t z = pz - min(pz, kBeside); z <= min(pz + kBeside, pz_ - 1); ++z) {
      for (std::size_t x = px - min(px, kBeside); x <= min(px + kBeside, px_ - 1); ++x) {
        for (const PatchLevel& l : patches_[x + px_ * z]) {
          const double d = std::abs(l.level - level);
          if (d > static_cast<double>(s_.band) && d < apart_) return true;
        }
      }
    }
    return false;
  }

  /// Level of a storey in a column, interpolated between the patches' centres; kNone away from all of
  /// its patches.
  std::size_t at(std::int32_t storey, std::size_t x, std::size_t z) const {
    const double side = static_cast<double>(side_);
    const double fx = (static_cast<double>(x) + 0.5) / side - 0.5,
                 fz = (static_cast<double>(z) + 0.5) / side - 0.5;
    const double x0 = std::floor(fx), z0 = std::floor(fz);
    double sum = 0, weight = 0;
    for (int k = 0; k < 4; ++k) {
      const double cx = x0 + (k & 1), cz = z0 + (k >> 1);
      if (cx < 0 || cz < 0 || cx >= static_cast<double>(px_) || cz >= static_cast<double>(pz_)) continue;
      const PatchLevel* l =
          level_of(static_cast<std::size_t>(cx) + px_ * static_cast<std::size_t>(cz), storey);
      if (l == nullptr) continue;
      const double w = (1.0 - std::abs(fx - cx)) * (1.0 - std::abs(fz - cz));
      sum += w * (l->level + l->gx * (fx - cx) + l->gz * (fz - cz));
      weight += w;
    }
    return weight > 0
               ? static_cast<std::size_t>(clamp(sum / weight + 0.5, 0.0, static_cast<double>(g_.ny - 1)))
               : kNone;
  }

  /// The floor of a storey in each column: the highest run that ends within the band. Pits below the
  /// floor's own level are noise and are levelled; small gaps get the floor's level (what stands there
  /// keeps them from being walkable).
  void mark(std::int32_t id) {
    Storey& s = storeys_[static_cast<std::size_t>(id)];
    if (s.patches.empty()) return;
    std::size_t x0 = px_, x1 = 0, z0 = pz_, z1 = 0;
    for (const std::size_t p : s.patches) {
      x0 = min(x0, p % px_);
      x1 = max(x1, p % px_);
      z0 = min(z0, p / px_);
      z1 = max(z1, p / px_);
    }
    x0 = (x0 - min<std::size_t>(x0, 1)) * side_;
    z0 = (z0 - min<std::size_t>(z0, 1)) * side_;
    const std::size_t nx = min((x1 + 2) * side_, g_.nx) - x0, nz = min((z1 + 2) * side_, g_.nz) - z0;
    std::vector<std::uint16_t> tops(nx * nz, kNoLevel);
    std::vector<std::uint8_t> mask(nx * nz, 0);
    pool_.run(static_cast<std::uint32_t>(nz), [&](std::uint32_t row) noexcept {
      for (std::size_t x = 0; x < nx; ++x) {
        const std::size_t level = at(id, x0 + x, z0 + row), c = x0 + x + g_.nx * (z0 + row);
        if (level == kNone) continue;
        const auto runs = g_.runs_of(c);
        for (std::size_t k = runs.size(); k-- > 0;) {
          const std::size_t top = runs[k].top();
          if (top > level + s_.band) continue;
          if (top + s_.band < level) break;
          tops[x + nx * row] = static_cast<std::uint16_t>(top);
          mask[x + nx * row] = 1;
          if (room_above(runs, k) >= s_.clearance) label_[g_.first[c] + k] = id;
          break;
        }
      }
    });
    raise_pits(id, x0, z0, nx, tops);
    close_mask(mask, nx, nz, static_cast<int>(o_.max_hole / g_.cell + 1e-6));
    const std::vector<std::uint16_t> around = tops;
    const std::size_t near = max<std::size_t>(1, static_cast<std::size_t>(0.1 / g_.cell + 0.5));
    for (std::size_t i = 0; i < tops.size(); ++i) {
      if (tops[i] != kNoLevel || mask[i] == 0) continue;
      const std::size_t level = at(id, x0 + i % nx, z0 + i / nx);
      if (level == kNone) continue;
      // No higher and no lower than the floor beside it.
      std::uint16_t low = kNoLevel, high = 0;
      for (std::size_t z = i / nx - min(i / nx, near); z <= min(i / nx + near, nz - 1); ++z) {
        for (std::size_t x = i % nx - min(i % nx, near); x <= min(i % nx + near, nx - 1); ++x) {
          if (around[x + nx * z] == kNoLevel) continue;
          low = min(low, around[x + nx * z]);
          high = max(high, around[x + nx * z]);
        }
      }
      tops[i] = static_cast<std::uint16_t>(low > high ? level : clamp<std::size_t>(level, low, high));
      ++s.holes;
    }
    for (std::size_t i = 0; i < tops.size(); ++i) {
      const auto runs = g_.runs_of(x0 + i % nx + g_.nx * (z0 + i / nx));
      mask[i] =
          tops[i] != kNoLevel && !runs.empty() && runs.back().top() >= tops[i] + s_.clearance ? 1 : 0;
    }
    close_mask(mask, nx, nz, static_cast<int>(kCoverGap / g_.cell));
    double roofed = 0;
    for (std::size_t i = 0; i < tops.size(); ++i) {
      if (tops[i] == kNoLevel) continue;
      s.marks.push_back({static_cast<std::uint32_t>(x0 + i % nx + g_.nx * (z0 + i / nx)), tops[i]});
      s.roofed.push_back(mask[i]);
      roofed += mask[i];
    }
    s.covered = s.marks.empty() ? 0.0 : roofed / static_cast<double>(s.marks.size());
  }

  /// Gives pits below a floor its own level, or the height of most ground within 0.1 m where that is
  /// lower: a tread of stairs at the floor's edge is no pit.
  void raise_pits(std::int32_t id, std::size_t x0, std::size_t z0, std::size_t nx,
                  std::vector<std::uint16_t>& tops) {
    const std::vector<std::uint16_t> raw = tops;
    const std::size_t nz = tops.size() / nx,
                      near = max<std::size_t>(1, static_cast<std::size_t>(0.1 / g_.cell + 0.5));
    pool_.run(static_cast<std::uint32_t>(nz), [&](std::uint32_t row) noexcept {
      std::vector<std::uint16_t> around;
      for (std::size_t x = 0; x < nx; ++x) {
        std::uint16_t& top = tops[x + nx * row];
        if (top == kNoLevel) continue;
        const std::size_t level = at(id, x0 + x, z0 + row);
        if (top >= level) continue;
        std::size_t to = level;
        if (top + std::size_t{1} < level) {
          around.clear();
          for (std::size_t z = row - min<std::size_t>(row, near); z <= min(row + near, nz - 1); ++z) {
            for (std::size_t i = x - min(x, near); i <= min(x + near, nx - 1); ++i) {
              if (raw[i + nx * z] != kNoLevel) around.push_back(raw[i + nx * z]);
            }
          }
          const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
          std::nth_element(around.begin(), middle, around.end());
          to = min<std::size_t>(level, max(top, *middle));
        }
        top = static_cast<std::uint16_t>(to);
      }
    });
  }

  /// Whether the ground around a run of a column goes on, no steeper than the agent walks, in three of
  /// four directions: stairs do, the side of a bush does not.
  bool goes_on(std::size_t c, std::size_t top) const noexcept {
    const auto far = max<std::size_t>(1, static_cast<std::size_t>(0.4 / g_.cell + 0.5));
    const double rise =
        s_.max_slope * static_cast<double>(far) * g_.cell / g_.level + static_cast<double>(s_.climb);
    const std::size_t x = c % g_.nx, z = c / g_.nx;
    const auto near = [&](std::size_t n) {
      const auto runs = g_.runs_of(n);
      return std::any_of(runs.begin(), runs.end(), [&](const SolidRun& r) {
        return std::abs(static_cast<double>(r.top()) - static_cast<double>(top)) <= rise;
      });
    };
    int on = 0;
    on += x >= far && near(c - far) ? 1 : 0;
    on += x + far < g_.nx && near(c + far) ? 1 : 0;
    on += z >= far && near(c - far * g_.nx) ? 1 : 0;
    on += z + far < g_.nz && near(c + far * g_.nx) ? 1 : 0;
    return on >= 3;
  }

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
  std::vector<Mark> find_stairs(GaussianNavReport& report) {
    for (std::size_t c = 0; c < g_.nx * g_.nz; ++c) {
      const auto runs = g_.runs_of(c);
      for (std::size_t k = 0; k < runs.size(); ++k) {
        std::int32_t& l = label_[g_.first[c] + k];
        if (l == kNotWalkable && room_above(runs, k) >= s_.clearance && goes_on(c, runs[k].top()))
          l = kFree;
      }
    }
    find_heights();
    std::vector<Piece> pieces;
    std::vector<std::vector<std::int32_t>> direct(storeys_.size());
    const auto note = [](std::vector<std::int32_t>& list, std::int32_t id) {
      if (std::find(list.begin(), list.end(), id) == list.end()) list.push_back(id);
    };
    constexpr std::int32_t kSeen = -3;
    Piece piece;
    for (std::size_t c = 0; c < g_.nx * g_.nz; ++c) {
      for (std::uint32_t r = g_.first[c]; r < g_.first[c + 1]; ++r) {
        if (label_[r] >= 0) {
          each_neighbour(c, r, [&](std::size_t, std::uint32_t n) {
            if (label_[n] >= 0 && label_[n] != label_[r])
              note(direct[static_cast<std::size_t>(label_[r])], label_[n]);
          });
        }
        if (label_[r] != kFree) continue;
        piece.runs.assign(1, {static_cast<std::uint32_t>(c), r});
        piece.storeys.clear();
        piece.beside.clear();
        label_[r] = kSeen;
        for (std::size_t k = 0; k < piece.runs.size(); ++k) {
          const auto [column, run] = piece.runs[k];
          each_neighbour(column, run, [&](std::size_t nc, std::uint32_t n) {
            if (label_[n] >= 0) {
              note(piece.storeys, label_[n]);
              piece.beside.push_back({static_cast<std::uint32_t>(nc), n});
            }
            if (label_[n] != kFree) return;
            label_[n] = kSeen;
            piece.runs.push_back({static_cast<std::uint32_t>(nc), n});
          });
        }
        if (piece.storeys.size() > 1) pieces.push_back(piece);
      }
    }
    const auto kept = [&](std::int32_t id) { return storeys_[static_cast<std::size_t>(id)].kept; };
    for (bool changed = true; changed;) {
      changed = false;
      const auto keep = [&](std::int32_t id) {
        changed = changed || !kept(id);
        storeys_[static_cast<std::size_t>(id)].kept = true;
      };
      for (const Piece& p : pieces) {
        if (std::any_of(p.storeys.begin(), p.storeys.end(), kept))
          std::for_each(p.storeys.begin(), p.storeys.end(), keep);
      }
      for (std::size_t i = 0; i < direct.size(); ++i) {
        if (storeys_[i].kept) std::for_each(direct[i].begin(), direct[i].end(), keep);
      }
    }
    std::vector<Mark> out;
    std::erase_if(pieces, [&](const Piece& p) { return !kept(p.storeys.front()); });
    report.stairs = pieces.size();
    level_ramps(pieces, out);
    for (const Piece& p : pieces) fill_stairs(p, out, report);
    return out;
  }

  /// The height of each walkable run without the noise of Gaussians that stand on edge: the median of
  /// the ground within 0.1 m that two steps can reach. A step of more than the agent's climb stays one.
  void find_heights() {
    height_.assign(g_.runs.size(), 0);
    const std::size_t near = max<std::size_t>(1, static_cast<std::size_t>(0.1 / g_.cell + 0.5));
    pool_.run(static_cast<std::uint32_t>(g_.nz), [&](std::uint32_t z) noexcept {
      std::vector<std::uint16_t> tops;
      for (std::size_t x = 0; x < g_.nx; ++x) {
        const std::size_t c = x + g_.nx * z;
        for (std::uint32_t r = g_.first[c]; r < g_.first[c + 1]; ++r) {
          if (label_[r] == kNotWalkable) continue;
          // A floor's own runs are near its plane already; what is farther is seen through a gap.
          const std::size_t top = g_.runs[r].top(), reach = (label_[r] >= 0 ? 1 : 2) * s_.climb;
          tops.clear();
          for (std::size_t k = z - min<std::size_t>(z, near); k <= min(z + near, g_.nz - 1); ++k) {
            for (std::size_t i = x - min(x, near); i <= min(x + near, g_.nx - 1); ++i) {
              const std::size_t at = i + g_.nx * k;
              std::size_t best = kNone, off = reach + 1;
              for (std::uint32_t n = g_.first[at]; n < g_.first[at + 1]; ++n) {
                const std::size_t other = g_.runs[n].top(), d = max(other, top) - min(other, top);
                if (label_[n] == kNotWalkable || d >= off) continue;
                best = other;
                off = d;
              }
              if (best != kNone) tops.push_back(static_cast<std::uint16_t>(best));
            }
          }
          const auto middle = tops.begin() + static_cast<std::ptrdiff_t>(tops.size() / 2);
          std::nth_element(tops.begin(), middle, tops.end());
          height_[r] = *middle;
        }
      }
    });
  }

  /// Gives stairs, and the floors within kStairHead of them, the mean height of the ground within
  /// kRampRadius that a step reaches. That is a ramp without steps, whatever the grid's offset: no step
  /// is too high for Recast, and erosion widens none. Takes off the voxels that stand out of it.
  void level_ramps(std::span<const Piece> pieces, std::vector<Mark>& out) {
    ramp_.assign(g_.runs.size(), kNoLevel);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> ground;
    for (const Piece& p : pieces) {
      for (const auto& [c, run] : p.runs) ramp_[run] = height_[run];
      ground.insert(ground.end(), p.runs.begin(), p.runs.end());
    }
    // Treads near a floor's own height are marked as that floor, and the risers between them as no
    // floor.
    std::size_t next = ground.size();
    const auto add = [&](std::size_t c, std::uint32_t run) {
      if (ramp_[run] != kNoLevel) return;
      if (label_[run] < 0 && g_.runs[run].top() > height_[run] + s_.climb) return;
      ramp_[run] = height_[run];
      ground.push_back({static_cast<std::uint32_t>(c), run});
    };
    for (const Piece& p : pieces) {
      for (const auto& [c, run] : p.beside) add(c, run);
    }
    const auto reach = static_cast<std::size_t>(kStairHead / g_.cell + 0.5);
    for (std::size_t k = 0; k < reach; ++k) {
      for (const std::size_t end = ground.size(); next < end; ++next) {
        const auto [c, run] = ground[next];
        each_neighbour(c, run, add);
      }
    }
    const auto far = max<std::size_t>(1, static_cast<std::size_t>(kRampRadius / g_.cell + 0.5));
    std::vector<std::uint16_t> tops(ground.size());
    pool_.run(static_cast<std::uint32_t>(tops.size()), [&](std::uint32_t i) noexcept {
      const auto [c, run] = ground[i];
      const std::size_t x = c % g_.nx, z = c / g_.nx, top = height_[run];
      double sum = 0, n = 0;
      for (std::size_t k = z - min(z, far); k <= min(z + far, g_.nz - 1); ++k) {
        for (std::size_t j = x - min(x, far); j <= min(x + far, g_.nx - 1); ++j) {
          for (std::uint32_t r = g_.first[j + g_.nx * k]; r < g_.first[j + g_.nx * k + 1]; ++r) {
            const std::size_t h = height_[r];
            if (ramp_[r] == kNoLevel || max(h, top) - min(h, top) > s_.climb) continue;
            sum += static_cast<double>(h);
            n += 1;
          }
        }
      }
      tops[i] = static_cast<std::uint16_t>(sum / n + 0.5);
    });
    for (std::size_t i = 0; i < tops.size(); ++i) {
      const auto [c, run] = ground[i];
      SolidRun& r = g_.runs[run];
      // What stands out may hang above the run below, which it then rests on.
      r.low = min(r.low, run > g_.first[c] ? max(tops[i], g_.runs[run - 1].end) : tops[i]);
      ramp_[run] = max(r.low, tops[i]);
      r.end = min(r.end, static_cast<std::uint16_t>(ramp_[run] + 1));
      if (label_[run] < 0) out.push_back({c, ramp_[run]});
    }
  }

  /// Closes small gaps in stairs.
  void fill_stairs(const Piece& p, std::vector<Mark>& out, GaussianNavReport& report) {
    const auto far = max<std::size_t>(1, static_cast<std::size_t>(kRampRadius / g_.cell + 0.5));
    std::size_t x0 = g_.nx, x1 = 0, z0 = g_.nz, z1 = 0;
    for (const auto& [c, run] : p.runs) {
      x0 = min(x0, c % g_.nx);
      x1 = max(x1, c % g_.nx);
      z0 = min(z0, c / g_.nx);
      z1 = max(z1, c / g_.nx);
    }
    x0 -= min(x0, far);
    z0 -= min(z0, far);
    const std::size_t nx = min(x1 + far + 1, g_.nx) - x0, nz = min(z1 + far + 1, g_.nz) - z0;
    std::vector<std::uint8_t> mask(nx * nz, 0), own(nx * nz, 0);
    std::vector<std::uint16_t> heights(nx * nz, 0);
    const auto index = [&](std::uint32_t c) { return c % g_.nx - x0 + nx * (c / g_.nx - z0); };
    for (const auto& [c, run] : p.beside) mask[index(c)] = 1;
    for (const auto& [c, run] : p.runs) {
      mask[index(c)] = own[index(c)] = 1;
      heights[index(c)] = height_[run];
    }
    const auto mean = [&](std::size_t i) {
      double sum = 0, n = 0;
      for (std::size_t z = i / nx - min(i / nx, far); z <= min(i / nx + far, nz - 1); ++z) {
        for (std::size_t x = i % nx - min(i % nx, far); x <= min(i % nx + far, nx - 1); ++x) {
          if (own[x + nx * z] == 0) continue;
          sum += static_cast<double>(heights[x + nx * z]);
          n += 1;
        }
      }
      return n > 0 ? static_cast<std::size_t>(sum / n + 0.5) : kNone;
    };
    close_mask(mask, nx, nz, static_cast<int>(o_.max_hole / g_.cell + 1e-6));
    for (const auto& [c, run] : p.beside) mask[index(c)] = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
      if (mask[i] == 0 || own[i] != 0) continue;
      std::size_t top = mean(i);
      const std::size_t c = x0 + i % nx + g_.nx * (z0 + i / nx);
      if (top == kNone) continue;
      bool floor = false;
      for (std::uint32_t r = g_.first[c]; r < g_.first[c + 1]; ++r) {
        const std::size_t y = g_.runs[r].top();
        floor = floor || (label_[r] >= 0 && max(y, top) - min(y, top) <= s_.climb);
      }
      if (floor) continue;
      for (std::uint32_t r = g_.first[c]; r < g_.first[c + 1]; ++r) {
        SolidRun& run = g_.runs[r];
        const bool bump = run.low <= top + 1 && run.end > top && run.top() <= top + s_.climb;
        if (!bump || room_above(g_.runs_of(c), r - g_.first[c]) < s_.clearance) continue;
        top = max<std::size_t>(top, run.low);
        run.end = static_cast<std::uint16_t>(top + 1);
        break;
      }
      out.push_back({static_cast<std::uint32_t>(c), static_cast<std::uint16_t>(top)});
      ++report.holes_filled;
    }
  }

  /// Solid voxels above and below the main floor in its columns and those up to a patch beside it (what
  /// stands on a floor covers it), beyond its band.
  void weigh(GaussianNavReport& report) const {
    for (std::size_t c = 0; c < g_.nx * g_.nz; ++c) {
      if (g_.first[c] == g_.first[c + 1]) continue;
      const std::size_t level = at(0, c % g_.nx, c / g_.nx);
      if (level == kNone) continue;
      const std::size_t low = level - min(level, 2 * s_.band), high = level + 2 * s_.band;
      for (const SolidRun& r : g_.runs_of(c)) {
        report.solid_below += min<std::size_t>(r.end, low) - min<std::size_t>(r.low, low);
        report.solid_above += max<std::size_t>(r.end, high) - max<std::size_t>(r.low, high);
      }
    }
  }

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

}  // namespace

FloorTops find_floors(VoxelGrid& g, const FloorSettings& settings, const GaussianNavOptions& options,
                      ThreadPool& pool, GaussianNavReport& report, double& most_area) {
  return Floors(g, settings, options, pool).find(report, most_area);
}

}  // namespace gsnav::detail
