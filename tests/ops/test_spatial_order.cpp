// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/core/permute.hpp"
#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

using Order = std::vector<std::uint32_t>;

Order identity(std::size_t n) {
  Order order(n);
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

Order shuffled(std::size_t n, std::uint64_t seed) {
  Order order = identity(n);
  Rng rng(seed);
  for (std::size_t i = n; i > 1; --i) {
    std::swap(order[i - 1], order[static_cast<std::size_t>(rng.uniform() * static_cast<double>(i))]);
  }
  return order;
}

Order rotated(std::size_t n, std::size_t by) {
  Order order = identity(n);
  std::rotate(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(by), order.end());
  return order;
}

std::uint64_t code_of(const Vec3d& place) {
  return detail::hilbert_code({static_cast<std::uint32_t>(place.x), static_cast<std::uint32_t>(place.y),
                               static_cast<std::uint32_t>(place.z)});
}

}  // namespace

TEST_CASE("permute_rows: what picking row after row gives, narrow rows and wide") {
  const std::vector<Order> orders = {
      {}, {0}, {1, 0}, rotated(100000, 1), shuffled(7, 1), shuffled(1000, 2), shuffled(70001, 3)};
  for (const Order& order : orders) {
    CAPTURE(order.size());
    for (const std::size_t stride : {1u, 3u, 9u, 15u, 24u, 45u}) {
      std::vector<std::uint32_t> rows(stride * order.size());
      std::iota(rows.begin(), rows.end(), 7u);
      std::vector<std::uint32_t> want;
      for (const std::uint32_t from : order) {
        for (std::size_t k = 0; k < stride; ++k) want.push_back(rows[stride * from + k]);
      }
      for (const std::size_t threads : {1u, 4u}) {
        PoolBackend backend(threads);
        std::vector<std::uint32_t> got = rows;
        permute_rows(backend, order, stride, got);
        CHECK(got == want);
      }
    }
  }
}

TEST_CASE("value_of_rank is what sorting puts there") {
  Rng rng(9);
  for (const std::size_t n : {1u, 2u, 100u, 70000u}) {
    std::vector<float> values(n);
    for (float& v : values)
      v = static_cast<float>(std::exp(rng.normal()) - 0.5 * (rng.uniform() < 0.3 ? 1 : 0));
    if (n > 50) values[7] = values[8] = values[9] = 0, values[10] = INFINITY;
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (const std::size_t rank : {std::size_t{0}, n / 2, n - 1 - (n - 1) / 64, n - 1}) {
      CHECK(detail::value_of_rank(values, rank) == sorted[rank]);
    }
  }
}

TEST_CASE("hilbert_code: fills each cube of cells, of any size, before the next, in steps of one cell") {
  Rng rng(41);
  struct Cell {
    std::uint64_t code;
    std::array<std::uint32_t, 3> at;
    bool operator<(const Cell& o) const { return code < o.code; }
  };
  // Cubes of 8 x 8 x 8 parts: of single cells anywhere, of larger parts, and the whole grid.
  for (int run = 0; run < 40; ++run) {
    const int level = run < 20 ? 0 : run - 20 < 19 ? run - 20 : 18;
    CAPTURE(level);
    std::array<std::uint32_t, 3> corner{};
    for (auto& c : corner)
      c = static_cast<std::uint32_t>(rng.uniform() * (1 << (18 - level))) << (3 + level);
    std::vector<Cell> cells;
    for (std::uint32_t i = 0; i < 512; ++i) {
      const std::array<std::uint32_t, 3> at{corner[0] + ((i & 7) << level),
                                            corner[1] + ((i >> 3 & 7) << level),
                                            corner[2] + ((i >> 6) << level)};
      cells.push_back({detail::hilbert_code(at) >> (3 * level), at});
    }
    std::sort(cells.begin(), cells.end());
    CHECK(cells[0].code % 512 == 0);
    bool whole = true, steps = true;
    for (std::size_t i = 1; i < cells.size(); ++i) {
      whole = whole && cells[i].code == cells[0].code + i;
      std::uint64_t apart = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = cells[i].at[k], b = cells[i - 1].at[k];
        apart += a > b ? a - b : b - a;
      }
      steps = steps && apart == std::uint64_t{1} << level;
    }
    CHECK(whole);
    CHECK(steps);
  }
}

TEST_CASE(
    "sort_spatially: the order of codes in 63 bits, then of rows, whatever the number of threads") {
  for (const int count : {1, 2, 300, 100000}) {
    CAPTURE(count);
    GaussianCloud cloud =
        random_cloud(31, {.count = count, .sh_degree = 1, .center = {90, 0, -20}, .extent = 40});
    const std::size_t n = cloud.size();
    // Rows at the same place, and most of them together: the box is as large as a few that are far away.
    for (std::size_t i = 0; i < n; ++i) {
      if (i % 7 == 0) {
        for (auto& plane : cloud.means) plane[i] = plane[0];
      } else if (i % 100 != 1) {
        for (auto& plane : cloud.means) plane[i] = plane[0] + 1e-3f * (plane[i] - plane[0]);
      }
      if (!cloud.origin_ids.empty() && i % 100 != 1) cloud.origin_ids[i] = cloud.origin_ids[0];
    }
    // Means before anything is sorted, and what each row's place is among all.
    Vec3d low = cloud.mean(0), high = low;
    std::vector<float> largest(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (int k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], cloud.mean(i)[k]);
        high[k] = std::max(high[k], cloud.mean(i)[k]);
        largest[i] = std::max(largest[i], cloud.scales[static_cast<std::size_t>(k)][i]);
      }
    }
    const double cell = std::max({high.x - low.x, high.y - low.y, high.z - low.z, 1e-9}) / 2097151.0;
    std::vector<float> sizes = largest;
    std::sort(sizes.begin(), sizes.end());
    const float large = sizes[n - 1 - (n - 1) / 64];
    std::vector<std::tuple<bool, std::uint64_t, std::uint32_t>> keys;
    for (std::size_t i = 0; i < n; ++i) {
      keys.emplace_back(largest[i] > large, code_of((cloud.mean(i) - low) * (1.0 / cell)),
                        static_cast<std::uint32_t>(i));
    }
    std::sort(keys.begin(), keys.end());
    for (const std::size_t threads : {1u, 2u, 5u}) {
      PoolBackend backend(threads);
      GaussianCloud got = cloud;
      sort_spatially(backend, got);
      REQUIRE(got.row_ids.size() == n);
      bool same = true;
      for (std::size_t i = 0; i < n; ++i) {
        const std::uint32_t row = std::get<2>(keys[i]);
        same = same && got.row_ids[i] == row && got.mean(i) == cloud.mean(row) &&
               got.quats[3][i] == cloud.quats[3][row] && got.sh0[3 * i + 2] == cloud.sh0[3 * row + 2] &&
               got.shN[9 * i + 8] == cloud.shN[9 * row + 8];
      }
      CHECK(same);
    }
  }
}
