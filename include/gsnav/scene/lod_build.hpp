// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <queue>
#include <string>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/math/svd.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/lod_merge.hpp"
#include "gsnav/scene/lod_tree.hpp"
#include "gsnav/scene/spatial_order.hpp"

namespace gsnav {

namespace detail {

/// Row i of a cloud (float SH) as clusters are made of it; `spread` m^2.
inline LodGaussian lod_gaussian(const GaussianCloud& cloud, std::size_t i, double spread) noexcept {
  LodGaussian g;
  g.mean = cloud.mean(i);
  Quatd q{cloud.quats[0][i], cloud.quats[1][i], cloud.quats[2][i], cloud.quats[3][i]};
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
  constexpr double kC0 = 0.28209479177387814;
  for (int k = 0; k < 3; ++k) {
    g.color[k] = 0.5 + kC0 * static_cast<double>(cloud.sh0[3 * i + static_cast<std::size_t>(k)]);
  }
  return g;
}

/// Puts Gaussians together, two at a time, the cheapest pair of neighbours first, until `target` are
/// left.
class GreedyMerge {
 public:
  explicit GreedyMerge(int neighbours) : k_(static_cast<std::size_t>(neighbours)) {}

  /// [in]: the Gaussians. owner()[i] then says which of left() shows the i-th.
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
      if (alive == before) break;  // nothing has neighbours: one Gaussian
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
    bool operator<(const Pair& o) const noexcept {  // the queue's top is its greatest
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
    // A pixel about as wide as neighbours are apart blurs by a third of that.
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

/// Gives a tree the size that it has for a cloud in spatial order: levels, nodes, rows; leaves with
/// their bounds.
inline void shape_lod(LodTree& out, const GaussianCloud& source, const LodSettings& settings) {
  if (source.size() == 0) return;
  GaussianCloud& m = out.merged;
  m.sh_degree = std::min(settings.sh_degree, source.sh_degree);
  m.filter = source.filter;
  m.eps2d = source.eps2d;
  m.sort_order = source.sort_order;
  const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(m.sh_degree) - 1);

  std::size_t count = source.view().all_chunks(), total = 0;
  for (bool last = false; !last; count = (count + 1) / 2) {
    out.level_begin.push_back(static_cast<std::uint32_t>(total));
    total += count;
    last = count <= 1;
  }
  out.level_begin.push_back(static_cast<std::uint32_t>(total));
  out.nodes.resize(total);
  const std::size_t rows = (total - out.leaves()) * kProjectChunk;
  for (auto& p : m.means) p.resize(rows);
  for (auto& p : m.quats) p.resize(rows);
  for (auto& p : m.scales) p.resize(rows);
  m.opacities.resize(rows);
  m.sh0.resize(3 * rows);
  m.shN = huge_vector<float>(rest * rows);
  m.origins = source.origins;
  if (!source.origin_ids.empty()) m.origin_ids.resize(rows);
  m.chunk_bounds.resize(total - out.leaves());
  for (std::size_t c = 0; c < out.leaves(); ++c) out.nodes[c].reach = source.chunk_bounds[c];
}

/// Builds the nodes of a tree, one after the other or side by side.
class LodBuilder {
 public:
  LodBuilder(const GaussianCloud& source, const LodSettings& settings, LodTree& out)
      : source_(source), settings_(settings), out_(out) {
    shape_lod(out, source, settings);
    rest_ = 3 * static_cast<std::size_t>(sh_coefficient_count(out.merged.sh_degree) - 1);
    source_rest_ = 3 * static_cast<std::size_t>(sh_coefficient_count(source.sh_degree) - 1);
    spreads_.resize(out.merged.size());
    grains_.resize(out.nodes.size());
  }

  /// Fills leaf i but for its bounds.
  void measure(std::size_t i) {
    Grain& sum = grains_[i];
    for (std::size_t row = i * kProjectChunk; row < std::min((i + 1) * kProjectChunk, source_.size()); ++row) {
      const LodGaussian g = lod_gaussian(source_, row, 0);
      const double area = lod_area(g.covariance);
      if (g.mass > 0 && area > 0) sum.add({g.mass, g.mass * std::log(area)});
    }
    out_.nodes[i].grain = sum.size();
  }
  /// Fills node i of level l > 0; its children must be there.
  void make(std::size_t l, std::size_t i) {
    const std::uint32_t* const begin = out_.level_begin.data();
    const std::size_t first = begin[l - 1] + 2 * i, end = std::min<std::size_t>(first + 2, begin[l]);
    std::vector<Row> rows;
    std::vector<LodGaussian> gaussians;
    LodNode& node = out_.nodes[begin[l] + i];
    for (std::size_t child = first; child < end; ++child) {
      add_rows(child, rows, gaussians);
      const LodNode& c = out_.nodes[child];
      node.error = std::max(node.error, c.error);
      grains_[begin[l] + i].add(grains_[child]);
      node.reach = child == first ? c.reach : both(node.reach, c.reach);
    }
    node.grain = grains_[begin[l] + i].size();
    const std::size_t target = std::min(kProjectChunk, (gaussians.size() + 1) / 2);
    GreedyMerge merge(settings_.neighbours);
    masses_of(gaussians, rows);
    merge.run(gaussians, target);
    write(begin[l] + i - out_.leaves(), rows, merge, node);
  }

 private:
  struct Row {
    const GaussianCloud* cloud;
    std::size_t row;
    double mass = 0;
  };

  static ChunkBounds both(const ChunkBounds& a, const ChunkBounds& b) noexcept {
    ChunkBounds out;
    for (int k = 0; k < 3; ++k) {
      out.low[k] = std::min(a.low[k], b.low[k]);
      out.high[k] = std::max(a.high[k], b.high[k]);
    }
    out.scale_max = std::max(a.scale_max, b.scale_max);
    out.opacity_max = std::max(a.opacity_max, b.opacity_max);
    return out;
  }
  /// Sum of mass, and of mass times log of area, of a node's leaves.
  struct Grain {
    double mass = 0, log_area = 0;
    void add(const Grain& o) noexcept {
      mass += o.mass;
      log_area += o.log_area;
    }
    float size() const noexcept { return mass > 0 ? static_cast<float>(std::exp(0.5 * log_area / mass)) : 0.0f; }
  };
  void add_rows(std::size_t node, std::vector<Row>& rows, std::vector<LodGaussian>& gaussians) const {
    const bool leaf = node < out_.leaves();
    const GaussianCloud& cloud = leaf ? source_ : out_.merged;
    const std::size_t first = (leaf ? node : node - out_.leaves()) * kProjectChunk;
    for (std::size_t i = first; i < std::min(first + kProjectChunk, cloud.size()); ++i) {
      if (!(cloud.opacities[i] > 0)) continue;
      rows.push_back({&cloud, i});
      gaussians.push_back(lod_gaussian(cloud, i, leaf ? 0.0 : static_cast<double>(spreads_[i])));
    }
  }
  static void masses_of(const std::vector<LodGaussian>& gaussians, std::vector<Row>& rows) noexcept {
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i].mass = std::max(gaussians[i].mass, 1e-30);
  }
  void write(std::size_t chunk, const std::vector<Row>& rows, const GreedyMerge& merge, LodNode& node) {
    GaussianCloud& m = out_.merged;
    const std::size_t first = chunk * kProjectChunk, n = merge.size();
    std::vector<double> sh(n * (3 + rest_)), mass(n);
    std::vector<std::size_t> heaviest(n, rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::size_t to = merge.owner()[i];
      const Row& r = rows[i];
      double* const sums = sh.data() + to * (3 + rest_);
      for (std::size_t k = 0; k < 3; ++k)
        sums[k] += r.mass * static_cast<double>(r.cloud->sh0[3 * r.row + k]);
      const std::size_t stride = r.cloud == &m ? rest_ : source_rest_;
      for (std::size_t k = 0; k < rest_; ++k)
        sums[3 + k] += r.mass * sh_of(*r.cloud, stride * r.row + k);
      mass[to] += r.mass;
      if (heaviest[to] == rows.size() || r.mass > rows[heaviest[to]].mass) heaviest[to] = i;
    }
    double squares = 0, total = 0;
    for (std::size_t g = 0; g < n; ++g) {
      const std::size_t row = first + g;
      const Row& like = rows[heaviest[g]];
      put(row, merge.left(g), like);
      for (std::size_t k = 0; k < 3; ++k)
        m.sh0[3 * row + k] = static_cast<float>(sh[g * (3 + rest_) + k] / mass[g]);
      for (std::size_t k = 0; k < rest_; ++k) {
        m.shN[rest_ * row + k] = static_cast<float>(sh[g * (3 + rest_) + 3 + k] / mass[g]);
      }
      squares += merge.left(g).mass * merge.left(g).spread;
      total += merge.left(g).mass;
    }
    for (std::size_t row = first + n; row < first + kProjectChunk; ++row)
      pad(row, n == 0 ? row : first + n - 1);
    if (total > 0) node.error = std::max(node.error, static_cast<float>(std::sqrt(squares / total)));
    ChunkBounds& own = m.chunk_bounds[chunk];
    Aabb<double> box;
    for (std::size_t row = first; row < first + kProjectChunk; ++row) {
      box.add(m.mean(row));
      for (const auto& scale : m.scales) own.scale_max = std::max(own.scale_max, scale[row]);
      own.opacity_max = std::max(own.opacity_max, m.opacities[row]);
    }
    own.low = box.low;
    own.high = box.high;
    node.reach = both(node.reach, own);
  }
  static double sh_of(const GaussianCloud& c, std::size_t at) noexcept {
    return static_cast<double>(c.shN_half.empty() ? c.shN[at] : half_to_float(c.shN_half[at]));
  }
  void put(std::size_t row, const LodGaussian& g, const Row& like) {
    GaussianCloud& m = out_.merged;
    Vec3d origin;
    if (!m.origin_ids.empty()) {
      m.origin_ids[row] = like.cloud->origin_ids[like.row];
      origin = m.origins[m.origin_ids[row]];
    }
    for (int k = 0; k < 3; ++k) {
      m.means[static_cast<std::size_t>(k)][row] = static_cast<float>(g.mean[k] - origin[k]);
    }
    const Svd3<double> axes = svd(g.covariance.matrix());
    double opacity = g.mass / std::max(lod_area(g.covariance), 1e-30), grow = 1;
    if (opacity > 1) {  // no Gaussian takes more than all light: its area has to
      grow = std::sqrt(opacity);
      opacity = 1;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      m.scales[k][row] = static_cast<float>(grow * std::sqrt(std::max(axes.values[k], 0.0)));
    }
    const Mat3d r{{{axes.left[0].x, axes.left[1].x, axes.left[2].x},
                   {axes.left[0].y, axes.left[1].y, axes.left[2].y},
                   {axes.left[0].z, axes.left[1].z, axes.left[2].z}}};
    const Quatd q = quat_from_matrix(r);
    m.quats[0][row] = static_cast<float>(q.w);
    m.quats[1][row] = static_cast<float>(q.x);
    m.quats[2][row] = static_cast<float>(q.y);
    m.quats[3][row] = static_cast<float>(q.z);
    m.opacities[row] = static_cast<float>(opacity);
    spreads_[row] = static_cast<float>(g.spread);
  }
  /// A row that shows nothing, where `like` is.
  void pad(std::size_t row, std::size_t like) {
    GaussianCloud& m = out_.merged;
    for (auto& p : m.means) p[row] = p[like];
    m.quats[0][row] = 1;
    if (!m.origin_ids.empty()) m.origin_ids[row] = m.origin_ids[like];
  }

  const GaussianCloud& source_;
  const LodSettings& settings_;
  LodTree& out_;
  std::size_t rest_ = 0, source_rest_ = 0;
  std::vector<float> spreads_;
  std::vector<Grain> grains_;
};

}  // namespace detail

/// Builds the tree of a cloud in spatial order (sort_spatially). The same bits on any backend in host
/// memory, for any number of threads. About 15 s a million Gaussians and core. Errors: invalid_argument
/// (no chunk bounds: the cloud is not sorted; a setting out of range).
template <Backend B>
requires is_host_backend<B> Result<LodTree> build_lod(B& backend, const GaussianCloud& cloud,
                                                      const LodSettings& settings = {}) {
  if (cloud.chunk_bounds.size() != cloud.view().all_chunks()) {
    return Status(Errc::invalid_argument,
                  "build_lod: the cloud's rows are not in spatial order: sort_spatially first");
  }
  if (settings.sh_degree < 0 || settings.sh_degree > kMaxShDegree) {
    return Status(
        Errc::invalid_argument,
        "LodSettings.sh_degree = " + std::to_string(settings.sh_degree) + ": must be in [0, 3]");
  }
  if (settings.neighbours < 1 || settings.neighbours > 16) {
    return Status(
        Errc::invalid_argument,
        "LodSettings.neighbours = " + std::to_string(settings.neighbours) + ": must be in [1, 16]");
  }
  LodTree tree;
  if (cloud.size() == 0) return tree;
  detail::LodBuilder builder(cloud, settings, tree);
  const double all = static_cast<double>(tree.nodes.size() - tree.leaves());
  std::size_t done = 0;
  backend.parallel_for(tree.leaves(), [&builder](std::size_t i) { builder.measure(i); });
  for (std::size_t l = 1; l < tree.levels(); ++l) {
    const std::size_t count = tree.level_begin[l + 1] - tree.level_begin[l];
    const std::size_t piece = std::max<std::size_t>(64, static_cast<std::size_t>(all) / 100);
    for (std::size_t first = 0; first < count; first += piece) {
      const std::size_t n = std::min(piece, count - first);
      backend.parallel_for(n, [&builder, l, first](std::size_t i) { builder.make(l, first + i); });
      if (Status s = backend.synchronize(); !s) return s;
      done += n;
      if (settings.progress) settings.progress(static_cast<double>(done) / all);
    }
  }
  return tree;
}

}  // namespace gsnav
