// SPDX-License-Identifier: Apache-2.0
#include "plan_floor.hpp"

#include <algorithm>
#include <cmath>

namespace gsnav::plan {
namespace {

std::uint64_t bits(int from, int to) noexcept {
  const auto below = [](int n) { return n >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << n) - 1; };
  return from < to ? below(to) & ~below(from) : 0;
}

/// The runs of set bits of `free` that contain a bit of `seeds`.
std::uint64_t runs_of(std::uint64_t seeds, std::uint64_t free) noexcept {
  std::uint64_t up = seeds & free, down = up, free_up = free, free_down = free;
  for (int step = 1; step < 64; step *= 2) {
    up |= free_up & (up << step);
    free_up &= free_up << step;
    down |= free_down & (down >> step);
    free_down &= free_down >> step;
  }
  return up | down;
}

}  // namespace

FreeFloor::FreeFloor(const FloorRect& inside, double clearance)
    : inside_(inside),
      clearance_(clearance),
      rows_along_x_(inside.width() < inside.depth()),
      columns_(static_cast<int>(std::ceil(std::min(inside.width(), inside.depth()) / kCell))),
      rows_(static_cast<int>(std::ceil(std::max(inside.width(), inside.depth()) / kCell))),
      free_(static_cast<std::size_t>(rows_), bits(0, columns_)) {
  const FloorRect& r = inside;
  constexpr double kOutside = 1.0;
  take({r.x0 - kOutside, r.z0 - kOutside, r.x0, r.z1 + kOutside});
  take({r.x1, r.z0 - kOutside, r.x1 + kOutside, r.z1 + kOutside});
  take({r.x0 - kOutside, r.z0 - kOutside, r.x1 + kOutside, r.z0});
  take({r.x0 - kOutside, r.z1, r.x1 + kOutside, r.z1 + kOutside});
}

void FreeFloor::take(const FloorRect& rect) {
  // Round outwards, so that a free cell is free everywhere.
  const auto low = [&](double v, double origin) {
    return std::max(static_cast<int>(std::floor((v - clearance_ - origin) / kCell + 1e-9)), 0);
  };
  const auto high = [&](double v, double origin, int n) {
    return std::min(static_cast<int>(std::ceil((v + clearance_ - origin) / kCell - 1e-9)), n);
  };
  const int along_x = rows_along_x_ ? columns_ : rows_, along_z = rows_along_x_ ? rows_ : columns_;
  const int x0 = low(rect.x0, inside_.x0), x1 = high(rect.x1, inside_.x0, along_x);
  const int z0 = low(rect.z0, inside_.z0), z1 = high(rect.z1, inside_.z0, along_z);
  const std::uint64_t taken = rows_along_x_ ? bits(x0, x1) : bits(z0, z1);
  const int first = rows_along_x_ ? z0 : x0, last = rows_along_x_ ? z1 : x1;
  for (int j = first; j < last; ++j) free_[static_cast<std::size_t>(j)] &= ~taken;
}

bool FreeFloor::in_one_piece() {
  const auto first =
      std::find_if(free_.begin(), free_.end(), [](std::uint64_t row) { return row != 0; });
  if (first == free_.end()) return false;
  reached_.assign(free_.size(), 0);
  reached_[static_cast<std::size_t>(first - free_.begin())] = runs_of(*first & (0 - *first), *first);
  const std::size_t n = free_.size();
  for (bool grows = true; grows;) {
    grows = false;
    for (std::size_t k = 0; k < 2 * n; ++k) {  // forwards, then backwards
      const std::size_t j = k < n ? k : 2 * n - 1 - k;
      if (reached_[j] == free_[j]) continue;
      const std::uint64_t beside = (j > 0 ? reached_[j - 1] : 0) | (j + 1 < n ? reached_[j + 1] : 0);
      const std::uint64_t now = runs_of(reached_[j] | beside, free_[j]);
      grows = grows || now != reached_[j];
      reached_[j] = now;
    }
  }
  return reached_ == free_;
}

}  // namespace gsnav::plan
