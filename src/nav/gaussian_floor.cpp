// SPDX-License-Identifier: Apache-2.0
#include "gaussian_floor.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "floors.hpp"

namespace gsnav::detail {
namespace floors {
namespace {

/// Height of the main floor: the lowest at which a considerable fraction of the columns with free space
/// for the agent end. If the scene has a ceiling, only columns below it count, so that the garden around
/// a house is not its floor. Thin tops have a low weight, because noise under the ground is thin too.
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
  // Move to the peak: the most frequent level within twice the smoothing above.
  std::size_t level = y;
  for (std::size_t k = y; k <= min(y + 2 * smooth, g.ny - 1); ++k)
    level = raw[k] > raw[level] ? k : level;
  return level;
}

}  // namespace

FloorTops Floors::find(GaussianNavReport& report, double& most_area) {
  const std::size_t smooth =
      max<std::size_t>(1, static_cast<std::size_t>(std::floor(0.08 / g_.level + 1e-6)));
  const auto level = main_level(g_, s_.clearance, smooth, most_area);
  if (!level || most_area < max(o_.min_island_area, g_.cell * g_.cell)) return {};
  // The surface lies near the middle of a floor's voxel.
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
  for (StoreyCandidate& s : storeys_) {
    const bool above = s.level > storeys_[0].level - static_cast<double>(s_.band);
    s.kept = s.kept || (above && (o_.drop_uncovered ? indoors && s.covered > 0.5 : true));
    s.inside = s.kept;
  }
  std::vector<Mark> marks = find_stairs(report);
  progress(0.9);
  for (StoreyCandidate& s : storeys_) {
    if (!s.kept) continue;
    double area = 0;
    for (std::size_t i = 0; i < s.marks.size(); ++i) {
      Mark& m = s.marks[i];
      bool stairs = false;
      for (std::uint32_t r = g_.first[m.column]; r < g_.first[m.column + 1]; ++r) {
        const bool same = max(ramp_[r], m.top) - min(ramp_[r], m.top) < static_cast<int>(s_.clearance);
        if (ramp_[r] == kNoLevel || !same) continue;
        m.top = ramp_[r];
        stairs = true;
      }
      // Ground without a ceiling next to a building is outside. Stairs below an open storey are not.
      if (o_.drop_uncovered && indoors && s.inside && s.roofed[i] == 0 && !stairs) {
        report.dropped_uncovered += g_.cell * g_.cell;
        continue;
      }
      area += g_.cell * g_.cell;
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

}  // namespace floors

FloorTops find_floors(VoxelGrid& g, const FloorSettings& settings, const GaussianNavOptions& options,
                      ThreadPool& pool, GaussianNavReport& report, double& most_area) {
  return floors::Floors(g, settings, options, pool).find(report, most_area);
}

}  // namespace gsnav::detail
