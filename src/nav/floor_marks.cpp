// SPDX-License-Identifier: Apache-2.0
// Floor of a storey in each column.
#include <algorithm>

#include "floors.hpp"

namespace gsnav::detail::floors {
namespace {

constexpr double kCoverGap = 0.6;  // Metres. Holes in a ceiling up to this width are closed.

/// Chessboard distance of each cell to the nearest set cell, in cells, up to `limit`.
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

}  // namespace

void close_mask(std::vector<std::uint8_t>& mask, std::size_t nx, std::size_t nz, int width) {
  const int radius = width / 2;
  if (radius <= 0) return;
  const std::vector<int> to_set = distances(mask, nx, nz, radius);
  std::vector<std::uint8_t> empty(mask.size());
  for (std::size_t i = 0; i < mask.size(); ++i) empty[i] = to_set[i] > radius ? 1 : 0;
  const std::vector<int> to_empty = distances(empty, nx, nz, radius);
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = mask[i] != 0 || to_empty[i] > radius ? 1 : 0;
}

void Floors::mark(std::int32_t id) {
  StoreyCandidate& s = storeys_[static_cast<std::size_t>(id)];
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
  const std::size_t near = g_.cells_in(0.1);
  for (std::size_t i = 0; i < tops.size(); ++i) {
    if (tops[i] != kNoLevel || mask[i] == 0) continue;
    const std::size_t level = at(id, x0 + i % nx, z0 + i / nx);
    if (level == kNone) continue;
    // Stay within the heights of the neighbouring floor.
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

void Floors::raise_pits(std::int32_t id, std::size_t x0, std::size_t z0, std::size_t nx,
                        std::vector<std::uint16_t>& tops) {
  const std::vector<std::uint16_t> raw = tops;
  const std::size_t nz = tops.size() / nx, near = g_.cells_in(0.1);
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

void Floors::weigh(GaussianNavReport& report) const {
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

}  // namespace gsnav::detail::floors
