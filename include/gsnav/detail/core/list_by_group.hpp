// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gsnav::detail {

/// Lists the numbers of n items by group. Those of group g are items[first[g]] to items[first[g + 1] -
/// 1], in ascending order. each(i, f) calls f(group) for every group of item i, twice in all.
template <class Place, class Each>
void list_by_group(std::size_t n, std::size_t groups, std::vector<Place>& first,
                   std::vector<std::uint32_t>& items, const Each& each) {
  first.assign(groups + 1, 0);
  for (std::size_t i = 0; i < n; ++i) each(i, [&](std::size_t g) { ++first[g + 1]; });
  for (std::size_t g = 0; g < groups; ++g) first[g + 1] += first[g];
  items.resize(first.back());
  std::vector<Place> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < n; ++i)
    each(i, [&](std::size_t g) { items[next[g]++] = static_cast<std::uint32_t>(i); });
}

}  // namespace gsnav::detail
