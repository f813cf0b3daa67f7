// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <vector>

#include "gsnav/core/permute.hpp"
#include "gsnav/core/pool_backend.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/scene/spatial_order.hpp"
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

/// Every 21 bits of a place become every third of its code, one at a time.
std::uint64_t morton(const Vec3d& place) {
  std::uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto steps = static_cast<std::uint64_t>(place[axis]);
    for (int bit = 0; bit < 21; ++bit) code |= (steps >> bit & 1) << (3 * bit + axis);
  }
  return code;
}

}  // namespace

TEST_CASE("permute_rows: what picking row after row gives, narrow rows and wide") {
  const std::vector<Order> orders = {{},           {0},         {1, 0},           rotated(100000, 1),
                                     shuffled(7, 1), shuffled(1000, 2), shuffled(70001, 3)};
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
      keys.emplace_back(largest[i] > large, morton((cloud.mean(i) - low) * (1.0 / cell)),
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
