// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <queue>
#include <vector>

#include "gsnav/detail/math/svd.hpp"
#include "gsnav/detail/scene/lod_merge.hpp"
#include "gsnav/frame/sh.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::detail {

/// Row i of a cloud with float SH as a LodGaussian. `spread` is in m^2.
inline LodGaussian lod_gaussian(const GaussianCloud& cloud, std::size_t i, double spread) noexcept {
  LodGaussian g;
  g.mean = cloud.mean(i);
  Quatd q = cloud.quat(i);
  normalize(q);
  const Mat3d r = rotation_matrix(q);
  const double s[3] = {cloud.scales[0][i], cloud.scales[1][i], cloud.scales[2][i]};
  for (int k = 0; k < 3; ++k) g.covariance.add_outer(r.column(k), s[k] * s[k]);
  const int least = s[0] < s[1] ? (s[0] < s[2] ? 0 : 2) : (s[1] < s[2] ? 1 : 2);
  const double middle = std::max(std::min(s[0], s[1]), std::min(std::max(s[0], s[1]), s[2]));
  g.normal = r.column(least);
  g.flatness = middle > 0 ? 1 - s[least] / middle : 0;
  g.mass = static_cast<double>(cloud.opacities[i]) * lod_area(g.covariance);
  g.spread = spread;
  for (int k = 0; k < 3; ++k) {
    g.color[k] = color_of_sh0(static_cast<double>(cloud.sh0[3 * i + static_cast<std::size_t>(k)]));
  }
  return g;
}

/// Writes the shape and opacity of row i of a cloud. The mean is relative to `origin`. No Gaussian takes
/// more than all light, so its area grows instead.
inline void set_lod_gaussian(GaussianCloud& cloud, std::size_t i, const LodGaussian& g,
                             const Vec3d& origin) noexcept {
  for (int k = 0; k < 3; ++k) {
    cloud.means[static_cast<std::size_t>(k)][i] = static_cast<float>(g.mean[k] - origin[k]);
  }
  const Svd3<double> axes = svd(g.covariance.matrix());
  double opacity = lod_opacity(g), grow = 1;
  if (opacity > 1) {
    grow = std::sqrt(opacity);
    opacity = 1;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    cloud.scales[k][i] = static_cast<float>(grow * std::sqrt(std::max(axes.values[k], 0.0)));
  }
  const Mat3d r{{{axes.left[0].x, axes.left[1].x, axes.left[2].x},
                 {axes.left[0].y, axes.left[1].y, axes.left[2].y},
                 {axes.left[0].z, axes.left[1].z, axes.left[2].z}}};
  cloud.set_quat(i, quat_from_matrix(r));
  cloud.opacities[i] = static_cast<float>(opacity);
}

/// Sums over Gaussians of their mass and of mass times log(area).
struct LodGrain {
  double mass = 0, log_area = 0;
  void add(const LodGaussian& g) noexcept {
    const double area = lod_area(g.covariance);
    if (g.mass > 0 && area > 0) add(LodGrain{g.mass, g.mass * std::log(area)});
  }
  void add(const LodGrain& o) noexcept {
    mass += o.mass;
    log_area += o.log_area;
  }
  /// The value of LodNode::grain, metres.
  float size() const noexcept {
    return mass > 0 ? static_cast<float>(std::exp(0.5 * log_area / mass)) : 0.0f;
  }
};

/// Merges Gaussians in pairs, the cheapest pair of neighbours first, until `target` are left.
class GreedyMerge {
 public:
  explicit GreedyMerge(int neighbours) : k_(static_cast<std::size_t>(neighbours)) {}

  /// Merges the Gaussians `in`, which are consumed. Afterwards owner()[i] is the index in left() of the
  /// one that stands for Gaussian i.
  void run(std::vector<LodGaussian>& in, std::size_t target) {
    items_.swap(in);
    const std::size_t n = items_.size();
    parent_.resize(n);
    for (std::size_t i = 0; i < n; ++i) parent_[i] = static_cast<std::uint32_t>(i);
    near_.assign(n, {});
    std::size_t alive = n;
    while (alive > target) {
      find_neighbours();
      const std::size_t before = alive;
      while (alive > target && !queue_.empty()) {
        const Pair p = queue_.top();
        queue_.pop();
        if (parent_[p.a] != p.a || parent_[p.b] != p.b) continue;
        join(p.a, p.b);
        --alive;
      }
      if (alive == before) break;  // no pair has neighbours: one Gaussian is left
    }
    left_.clear();
    place_.resize(items_.size());
    for (std::uint32_t i = 0; i < items_.size(); ++i) {
      if (parent_[i] != i) continue;
      place_[i] = static_cast<std::uint32_t>(left_.size());
      left_.push_back(i);
    }
    owner_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) owner_[i] = place_[root(i)];
  }
  std::size_t size() const noexcept { return left_.size(); }
  const LodGaussian& left(std::size_t i) const noexcept { return items_[left_[i]]; }
  const std::vector<std::uint32_t>& owner() const noexcept { return owner_; }

 private:
  struct Pair {
    double cost;
    std::uint32_t a, b;                             ///< a < b
    bool operator<(const Pair& o) const noexcept {  // the top of the queue is its greatest element
      if (cost != o.cost) return cost > o.cost;
      return a != o.a ? a > o.a : b > o.b;
    }
  };
  struct Neighbour {
    double distance;
    std::uint32_t id;
    bool operator<(const Neighbour& o) const noexcept {
      return distance != o.distance ? distance < o.distance : id < o.id;
    }
  };

  std::uint32_t root(std::uint32_t i) const noexcept {
    while (parent_[i] != i) i = parent_[i];
    return i;
  }
  double distance(std::uint32_t a, std::uint32_t b) const noexcept {
    const Vec3d d = items_[a].mean - items_[b].mean;
    return dot(d, d);
  }
  void find_neighbours() {
    queue_ = {};
    std::vector<std::uint32_t> alive;
    for (std::uint32_t i = 0; i < items_.size(); ++i) {
      if (parent_[i] == i) alive.push_back(i);
    }
    std::vector<double> nearest;
    for (const std::uint32_t i : alive) {
      std::vector<Neighbour>& list = near_[i];
      list.clear();
      for (const std::uint32_t j : alive) {
        if (j == i) continue;
        const Neighbour n{distance(i, j), j};
        if (list.size() == k_ && !(n < list.back())) continue;
        if (list.size() == k_) list.pop_back();
        list.insert(std::upper_bound(list.begin(), list.end(), n), n);
      }
      if (!list.empty()) nearest.push_back(list.front().distance);
    }
    if (nearest.empty()) return;
    const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
    std::nth_element(nearest.begin(), middle, nearest.end());
    // A pixel about as wide as the distance between neighbours blurs by a third of that distance.
    variance_ = std::max(0.25 * *middle, 1e-12);
    for (const std::uint32_t i : alive) {
      for (const Neighbour& n : near_[i]) {
        if (i < n.id || !lists(n.id, i)) push(i, n.id);
      }
    }
  }
  bool lists(std::uint32_t i, std::uint32_t j) const noexcept {
    return std::any_of(near_[i].begin(), near_[i].end(), [j](const Neighbour& n) { return n.id == j; });
  }
  void push(std::uint32_t a, std::uint32_t b) {
    queue_.push({merge_cost(items_[a], items_[b], variance_), std::min(a, b), std::max(a, b)});
  }
  void join(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t id = static_cast<std::uint32_t>(items_.size());
    items_.push_back(merged(items_[a], items_[b]));
    parent_.push_back(id);
    parent_[a] = parent_[b] = id;
    std::vector<std::uint32_t> around;
    for (const std::uint32_t from : {a, b}) {
      for (const Neighbour& n : near_[from]) around.push_back(root(n.id));
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    std::vector<Neighbour> list;
    for (const std::uint32_t i : around) {
      if (i != id) list.push_back({distance(id, i), i});
    }
    std::sort(list.begin(), list.end());
    if (list.size() > k_) list.resize(k_);
    for (const Neighbour& n : list) push(id, n.id);
    near_.push_back(std::move(list));
  }

  std::size_t k_;
  double variance_ = 0;
  std::vector<LodGaussian> items_;
  std::vector<std::uint32_t> parent_, left_, place_, owner_;
  std::vector<std::vector<Neighbour>> near_;
  std::priority_queue<Pair> queue_;
};

}  // namespace gsnav::detail
