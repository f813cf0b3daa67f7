// SPDX-License-Identifier: Apache-2.0
#include "neighbours.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "gsnav/core/thread_pool.hpp"
#include "threads.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::size_t kLeaf = 8;

/// Squared distances, ascending; the first `size` count.
struct Nearest {
  std::array<double, kMostNeighbours> distances{};
  std::size_t size = 0;

  double worst() const noexcept { return distances[size - 1]; }
  void add(double d) noexcept {
    if (!(d < worst())) return;
    std::size_t k = size - 1;
    for (; k > 0 && d < distances[k - 1]; --k) distances[k] = distances[k - 1];
    distances[k] = d;
  }
};

double squared(double v) noexcept { return v * v; }

/// A k-d tree without nodes: [first, last) is split at its middle by its longest axis, over and over.
class PointTree {
 public:
  explicit PointTree(const std::vector<Vec3d>& points) : points_(points), axes_(points.size()) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (is_finite(points[i])) order_.push_back(static_cast<std::uint32_t>(i));
    }
    split(0, order_.size());
  }
  const std::vector<std::uint32_t>& order() const noexcept { return order_; }

  /// The nearest others of point `i`; `best.size` says how many.
  void nearest(std::uint32_t i, Nearest& best) const {
    best.distances.fill(std::numeric_limits<double>::infinity());
    search(0, order_.size(), i, best);
  }

 private:
  void split(std::size_t first, std::size_t last) {
    if (last - first <= kLeaf) return;
    Vec3d low = points_[order_[first]], high = low;
    for (std::size_t i = first; i < last; ++i) {
      const Vec3d& p = points_[order_[i]];
      for (int k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
    const Vec3d size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = first + (last - first) / 2;
    const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(first), at(middle), at(last), [&](std::uint32_t a, std::uint32_t b) {
      return points_[a][axis] < points_[b][axis];
    });
    axes_[middle] = static_cast<std::uint8_t>(axis);
    split(first, middle);
    split(middle + 1, last);
  }

  void look(std::uint32_t other, std::uint32_t i, Nearest& best) const {
    if (other == i) return;
    const Vec3d d = points_[other] - points_[i];
    best.add(dot(d, d));
  }

  void search(std::size_t first, std::size_t last, std::uint32_t i, Nearest& best) const {
    if (last - first <= kLeaf) {
      for (std::size_t k = first; k < last; ++k) look(order_[k], i, best);
      return;
    }
    const std::size_t middle = first + (last - first) / 2;
    const int axis = axes_[middle];
    const double beyond = points_[i][axis] - points_[order_[middle]][axis];
    look(order_[middle], i, best);
    search(beyond < 0 ? first : middle + 1, beyond < 0 ? middle : last, i, best);
    if (squared(beyond) < best.worst())
      search(beyond < 0 ? middle + 1 : first, beyond < 0 ? last : middle, i, best);
  }

  const std::vector<Vec3d>& points_;
  std::vector<std::uint32_t> order_;
  std::vector<std::uint8_t> axes_;
};

}  // namespace

std::vector<double> neighbour_distances(const std::vector<Vec3d>& points, std::size_t k) {
  std::vector<double> out(points.size(), 0.0);
  const PointTree tree(points);
  const std::size_t n = tree.order().size();
  k = std::min({k, kMostNeighbours, n == 0 ? 0 : n - 1});
  if (k == 0) return out;
  constexpr std::size_t kPiece = 4096;
  const auto piece = [&](std::uint32_t p) {
    Nearest best;
    best.size = k;
    for (std::size_t i = p * kPiece; i < std::min(n, (p + 1) * kPiece); ++i) {
      tree.nearest(tree.order()[i], best);
      double sum = 0;
      for (std::size_t j = 0; j < k; ++j) sum += best.distances[j];
      out[tree.order()[i]] = std::sqrt(sum / static_cast<double>(k));
    }
  };
  ThreadPool(static_cast<int>(io_threads())).run(static_cast<std::uint32_t>((n + kPiece - 1) / kPiece), piece);
  return out;
}

}  // namespace gsnav::io::detail
