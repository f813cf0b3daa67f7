// SPDX-License-Identifier: Apache-2.0
// Storeys: heights of floors in square patches of 1 m, and how far each floor extends.
#include <algorithm>
#include <cmath>

#include "floors.hpp"

namespace gsnav::detail::floors {
namespace {

constexpr std::size_t kBeside =
    3;  // Number of patches around a floor within which a level nearer than kApart is furniture.
constexpr double kLeastStorey = 4.0;  // Smallest area of a storey, m².

}  // namespace

void Floors::find_peaks() {
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

std::optional<PatchLevel> Floors::fit(std::size_t patch, const PatchLevel& expected, std::size_t band,
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
  // Slope of the points near that level, by least squares.
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

void Floors::grow(std::span<const Seed> seeds, std::size_t near) {
  const auto id = static_cast<std::int32_t>(storeys_.size());
  StoreyCandidate storey;
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

void Floors::find_storeys() {
  const double least = max(kLeastStorey, o_.min_island_area) / (g_.cell * g_.cell);
  for (const Peak& peak : peaks_) {
    if (2 * peak.columns < static_cast<double>(side_ * side_)) break;
    const double level = static_cast<double>(peak.level);
    if (taken(peak.patch, level) || is_furniture(peak.patch, level)) continue;
    const Seed seed{peak.patch, level};
    grow({&seed, 1}, 1);
    if (storeys_.back().columns >= least) continue;
    // Too small: release its patches.
    const auto id = static_cast<std::int32_t>(storeys_.size() - 1);
    for (const std::size_t p : storeys_.back().patches) {
      std::erase_if(patches_[p], [&](const PatchLevel& l) { return l.storey == id; });
    }
    storeys_.pop_back();
  }
}

bool Floors::is_furniture(std::size_t patch, double level) const {
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

std::size_t Floors::at(std::int32_t storey, std::size_t x, std::size_t z) const {
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

}  // namespace gsnav::detail::floors
