// SPDX-License-Identifier: Apache-2.0
#include "plan_floor.hpp"

#include <algorithm>
#include <cmath>

namespace gsnav::plan {

FreeFloor::FreeFloor(const FloorRect& inside, double clearance)
    : inside_(inside),
      clearance_(clearance),
      columns_(static_cast<int>(std::ceil(inside.width() / kCell))),
      rows_(static_cast<int>(std::ceil(inside.depth() / kCell))),
      taken_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0) {
  const FloorRect& r = inside;
  constexpr double kOutside = 1.0;
  take({r.x0 - kOutside, r.z0 - kOutside, r.x0, r.z1 + kOutside});
  take({r.x1, r.z0 - kOutside, r.x1 + kOutside, r.z1 + kOutside});
  take({r.x0 - kOutside, r.z0 - kOutside, r.x1 + kOutside, r.z0});
  take({r.x0 - kOutside, r.z1, r.x1 + kOutside, r.z1 + kOutside});
}

void FreeFloor::take(const FloorRect& rect) {
  // Rounded outwards, so that a free cell is free all over.
  const auto low = [&](double v, double origin) {
    return std::max(static_cast<int>(std::floor((v - clearance_ - origin) / kCell + 1e-9)), 0);
  };
  const auto high = [&](double v, double origin, int n) {
    return std::min(static_cast<int>(std::ceil((v + clearance_ - origin) / kCell - 1e-9)), n);
  };
  const int i0 = low(rect.x0, inside_.x0), i1 = high(rect.x1, inside_.x0, columns_);
  const int j0 = low(rect.z0, inside_.z0), j1 = high(rect.z1, inside_.z0, rows_);
  for (int j = j0; j < j1 && i0 < i1; ++j) {
    std::fill_n(taken_.begin() + static_cast<std::ptrdiff_t>(j) * columns_ + i0, i1 - i0, char{1});
  }
}

bool FreeFloor::free(double x, double z) const noexcept {
  const int i = static_cast<int>(std::floor((x - inside_.x0) / kCell));
  const int j = static_cast<int>(std::floor((z - inside_.z0) / kCell));
  return i >= 0 && j >= 0 && i < columns_ && j < rows_ &&
         taken_[static_cast<std::size_t>(j * columns_ + i)] == 0;
}

bool FreeFloor::in_one_piece() {
  const auto first = std::find(taken_.begin(), taken_.end(), char{0});
  if (first == taken_.end()) return false;
  const auto width = static_cast<std::size_t>(columns_);
  // Cells at the walls are taken, so that no step leaves the room.
  reached_ = taken_;
  queue_.assign(1, static_cast<std::size_t>(first - taken_.begin()));
  reached_[queue_.front()] = 1;
  while (!queue_.empty()) {
    const std::size_t at = queue_.back();
    queue_.pop_back();
    for (const std::size_t next : {at - 1, at + 1, at - width, at + width}) {
      if (reached_[next] != 0) continue;
      reached_[next] = 1;
      queue_.push_back(next);
    }
  }
  return std::find(reached_.begin(), reached_.end(), char{0}) == reached_.end();
}

}  // namespace gsnav::plan
