// SPDX-License-Identifier: Apache-2.0
#include "neighbours.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "gsnav/detail/core/thread_pool.hpp"
#include "gsnav/detail/scene/point_tree.hpp"
#include "threads.hpp"

namespace gsnav::io::detail {
namespace {

/// Squared distances from a point to its nearest others, ascending. Only the first `size` are used.
struct Nearest {
  std::uint32_t point = 0;
  std::array<double, kMostNeighbours> distances{};
  std::size_t size = 0;

  double worst() const noexcept { return distances[size - 1]; }
  void add(std::uint32_t other, double d) noexcept {
    if (other == point || !(d < worst())) return;
    std::size_t k = size - 1;
    for (; k > 0 && d < distances[k - 1]; --k) distances[k] = distances[k - 1];
    distances[k] = d;
  }
};

}  // namespace

std::vector<double> neighbour_distances(const std::vector<Vec3d>& points, std::size_t k) {
  std::vector<double> out(points.size(), 0.0);
  const gsnav::detail::PointTree tree(points);
  const std::size_t n = tree.order().size();
  k = std::min({k, kMostNeighbours, n == 0 ? 0 : n - 1});
  if (k == 0) return out;
  constexpr std::size_t kPiece = 4096;
  const auto piece = [&](std::uint32_t p) {
    Nearest best;
    best.size = k;
    for (std::size_t i = p * kPiece; i < std::min(n, (p + 1) * kPiece); ++i) {
      best.point = tree.order()[i];
      best.distances.fill(std::numeric_limits<double>::infinity());
      tree.search(points[best.point], best);
      double sum = 0;
      for (std::size_t j = 0; j < k; ++j) sum += best.distances[j];
      out[best.point] = std::sqrt(sum / static_cast<double>(k));
    }
  };
  ThreadPool(static_cast<int>(io_threads()))
      .run(static_cast<std::uint32_t>((n + kPiece - 1) / kPiece), piece);
  return out;
}

}  // namespace gsnav::io::detail
