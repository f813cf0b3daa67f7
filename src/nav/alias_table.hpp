// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gsnav/core/rng.hpp"

namespace gsnav::detail {

/// Samples items in proportion to their weights in constant time (Walker 1977, built as by Vose 1991).
class AliasTable {
 public:
  AliasTable() = default;
  /// Builds the table. If all weights are zero, items are equally likely.
  /// @param names Values that draw() returns. Empty: indices of the items.
  AliasTable(const std::vector<double>& weights, const std::vector<std::uint32_t>& names) {
    const std::size_t n = weights.size();
    double sum = 0;
    for (const double w : weights) sum += w;
    std::vector<double> share(n, 1.0);
    if (sum > 0) {
      for (std::size_t i = 0; i < n; ++i) share[i] = weights[i] * (static_cast<double>(n) / sum);
    }
    const auto name = [&](std::size_t i) {
      return names.empty() ? static_cast<std::uint32_t>(i) : names[i];
    };
    std::vector<std::size_t> small, large;
    cells_.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      cells_.push_back({1.0, name(i), name(i)});
      (share[i] < 1 ? small : large).push_back(i);
    }
    while (!small.empty() && !large.empty()) {
      const std::size_t s = small.back(), l = large.back();
      small.pop_back();
      cells_[s].keep = share[s];
      cells_[s].other = name(l);
      share[l] -= 1 - share[s];
      if (share[l] >= 1) continue;
      large.pop_back();
      small.push_back(l);
    }
  }

  bool empty() const noexcept { return cells_.empty(); }
  std::uint32_t draw(Rng& rng) const noexcept {
    // The integer part of one random number selects the cell, the rest selects the side.
    const double at = rng.uniform() * static_cast<double>(cells_.size());
    const auto i = static_cast<std::size_t>(at);
    const Cell& c = cells_[i < cells_.size() ? i : cells_.size() - 1];
    return at - static_cast<double>(i) < c.keep ? c.own : c.other;
  }

 private:
  struct Cell {
    double keep = 1;
    std::uint32_t own = 0, other = 0;
  };
  std::vector<Cell> cells_;
};

}  // namespace gsnav::detail
