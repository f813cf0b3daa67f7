// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/lod_greedy.hpp"
#include "gsnav/detail/scene/lod_merge.hpp"
#include "gsnav/detail/scene/lod_settings.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/lod_tree.hpp"

namespace gsnav {

namespace detail {

/// Sizes a tree for a cloud in spatial order: levels, nodes, rows, and the bounds of leaves.
inline void shape_lod(LodTree& out, const GaussianCloud& source, const LodSettings& settings) {
  if (source.size() == 0) return;
  GaussianCloud& m = out.merged;
  m.sh_degree = std::min(settings.sh_degree, source.sh_degree);
  m.filter = source.filter;
  m.eps2d = source.eps2d;
  m.sort_order = source.sort_order;
  const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(m.sh_degree) - 1);

  std::size_t count = source.view().chunk_count(), total = 0;
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

/// Builds the nodes of a tree. Nodes of one level may be built in parallel.
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

  /// Fills leaf i, except its bounds.
  void measure(std::size_t i) {
    LodGrain& sum = grains_[i];
    for (std::size_t row = i * kProjectChunk; row < std::min((i + 1) * kProjectChunk, source_.size());
         ++row) {
      sum.add(lod_gaussian(source_, row, 0));
    }
    out_.nodes[i].grain = sum.size();
  }
  /// Fills node i of level l > 0 from its children, which must be complete.
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
    LodDistance moved;
    for (std::size_t g = 0; g < n; ++g) {
      const std::size_t row = first + g;
      const Row& like = rows[heaviest[g]];
      put(row, merge.left(g), like);
      for (std::size_t k = 0; k < 3; ++k)
        m.sh0[3 * row + k] = static_cast<float>(sh[g * (3 + rest_) + k] / mass[g]);
      for (std::size_t k = 0; k < rest_; ++k) {
        m.shN[rest_ * row + k] = static_cast<float>(sh[g * (3 + rest_) + 3 + k] / mass[g]);
      }
      moved.add(merge.left(g).mass, merge.left(g).spread);
    }
    for (std::size_t row = first + n; row < first + kProjectChunk; ++row)
      pad(row, n == 0 ? row : first + n - 1);
    node.error = std::max(node.error, static_cast<float>(moved.size()));
    const ChunkBounds own = bounds_of_rows(m, first, first + kProjectChunk);
    m.chunk_bounds[chunk] = own;
    node.reach = both(node.reach, own);
  }
  static double sh_of(const GaussianCloud& c, std::size_t at) noexcept {
    return static_cast<double>(c.compact() ? half_to_float(c.shN_half[at]) : c.shN[at]);
  }
  void put(std::size_t row, const LodGaussian& g, const Row& like) {
    GaussianCloud& m = out_.merged;
    Vec3d origin;
    if (!m.origin_ids.empty()) {
      m.origin_ids[row] = like.cloud->origin_ids[like.row];
      origin = m.origins[m.origin_ids[row]];
    }
    set_lod_gaussian(m, row, g, origin);
    spreads_[row] = static_cast<float>(g.spread);
  }
  /// Makes a transparent row at the position of row `like`.
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
  std::vector<LodGrain> grains_;
};

}  // namespace detail

/// Builds the level-of-detail tree of a cloud in spatial order (sort_spatially). Takes about 15 s for
/// each million Gaussians on one core. The result has the same bits on any host backend and for any
/// number of threads. Errors: invalid_argument (a cloud without chunk bounds, which is not sorted; a
/// setting out of range).
template <Backend B>
requires is_host_backend<B> Result<LodTree> build_lod(B& backend, const GaussianCloud& cloud,
                                                      const LodSettings& settings = {}) {
  if (cloud.chunk_bounds.size() != cloud.view().chunk_count()) {
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
