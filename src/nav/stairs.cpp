// SPDX-License-Identifier: Apache-2.0
// Stairs and ramps between storeys.
#include <algorithm>
#include <cmath>

#include "floors.hpp"

namespace gsnav::detail::floors {
namespace {

constexpr double kStairHead = 1.0;    // Distance up to which the floor around stairs is levelled with
                                      // them, metres.
constexpr double kRampRadius = 0.15;  // Radius for averaging heights of stairs, metres.

}  // namespace

bool Floors::goes_on(std::size_t c, std::size_t top) const noexcept {
  const auto far = g_.cells_in(0.4);
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

std::vector<Mark> Floors::find_stairs(GaussianNavReport& report) {
  for (std::size_t c = 0; c < g_.nx * g_.nz; ++c) {
    const auto runs = g_.runs_of(c);
    for (std::size_t k = 0; k < runs.size(); ++k) {
      std::int32_t& l = label_[g_.first[c] + k];
      if (l == kNotWalkable && room_above(runs, k) >= s_.clearance && goes_on(c, runs[k].top()))
        l = kFree;
    }
  }
  find_heights();
  std::vector<GroundPiece> pieces;
  std::vector<std::vector<std::int32_t>> direct(storeys_.size());
  const auto note = [](std::vector<std::int32_t>& list, std::int32_t id) {
    if (std::find(list.begin(), list.end(), id) == list.end()) list.push_back(id);
  };
  constexpr std::int32_t kSeen = -3;
  GroundPiece piece;
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
    for (const GroundPiece& p : pieces) {
      if (std::any_of(p.storeys.begin(), p.storeys.end(), kept))
        std::for_each(p.storeys.begin(), p.storeys.end(), keep);
    }
    for (std::size_t i = 0; i < direct.size(); ++i) {
      if (storeys_[i].kept) std::for_each(direct[i].begin(), direct[i].end(), keep);
    }
  }
  std::vector<Mark> out;
  std::erase_if(pieces, [&](const GroundPiece& p) { return !kept(p.storeys.front()); });
  report.stairs = pieces.size();
  level_ramps(pieces, out);
  for (const GroundPiece& p : pieces) fill_stairs(p, out, report);
  return out;
}

void Floors::find_heights() {
  height_.assign(g_.runs.size(), 0);
  const std::size_t near = g_.cells_in(0.1);
  pool_.run(static_cast<std::uint32_t>(g_.nz), [&](std::uint32_t z) noexcept {
    std::vector<std::uint16_t> tops;
    for (std::size_t x = 0; x < g_.nx; ++x) {
      const std::size_t c = x + g_.nx * z;
      for (std::uint32_t r = g_.first[c]; r < g_.first[c + 1]; ++r) {
        if (label_[r] == kNotWalkable) continue;
        // Runs of a floor are near its plane. A neighbour farther away belongs to another surface behind
        // a gap.
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

void Floors::level_ramps(std::span<const GroundPiece> pieces, std::vector<Mark>& out) {
  ramp_.assign(g_.runs.size(), kNoLevel);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ground;
  for (const GroundPiece& p : pieces) {
    for (const auto& [c, run] : p.runs) ramp_[run] = height_[run];
    ground.insert(ground.end(), p.runs.begin(), p.runs.end());
  }
  // Treads near a floor's height are marked as that floor, and the risers between them as no floor.
  std::size_t next = ground.size();
  const auto add = [&](std::size_t c, std::uint32_t run) {
    if (ramp_[run] != kNoLevel) return;
    if (label_[run] < 0 && g_.runs[run].top() > height_[run] + s_.climb) return;
    ramp_[run] = height_[run];
    ground.push_back({static_cast<std::uint32_t>(c), run});
  };
  for (const GroundPiece& p : pieces) {
    for (const auto& [c, run] : p.beside) add(c, run);
  }
  const auto reach = static_cast<std::size_t>(kStairHead / g_.cell + 0.5);
  for (std::size_t k = 0; k < reach; ++k) {
    for (const std::size_t end = ground.size(); next < end; ++next) {
      const auto [c, run] = ground[next];
      each_neighbour(c, run, add);
    }
  }
  const auto far = g_.cells_in(kRampRadius);
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
    // The part that sticks out may hang above the run below. It then rests on that run.
    r.low = min(r.low, run > g_.first[c] ? max(tops[i], g_.runs[run - 1].end) : tops[i]);
    ramp_[run] = max(r.low, tops[i]);
    r.end = min(r.end, static_cast<std::uint16_t>(ramp_[run] + 1));
    if (label_[run] < 0) out.push_back({c, ramp_[run]});
  }
}

void Floors::fill_stairs(const GroundPiece& p, std::vector<Mark>& out, GaussianNavReport& report) {
  const auto far = g_.cells_in(kRampRadius);
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

}  // namespace gsnav::detail::floors
