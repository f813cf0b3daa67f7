// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/detail/frame/cull.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/detail/scene/lod_choice.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/scene/lod_tree.hpp"

namespace gsnav {

/// Counts of a cut. They are Gaussians of the cloud unless said otherwise.
struct LodStats {
  std::uint64_t shown = 0;   ///< Gaussians in chunks that may be in view; by select_from, all.
  std::uint64_t merged = 0;  ///< Number of those that merged Gaussians stand for.
  std::uint64_t drawn = 0;   ///< Rows that are drawn for them, merged ones included.
  double error_px = 0;       ///< Largest LodNode::error of a node that is drawn, pixels.
};

/// Render settings of the profile `lod`: those of Quality::fast(), with the other settings of `config`.
inline RenderConfig lod_config(RenderConfig config) noexcept {
  const Quality fast = Quality::fast();
  config.quality.exponential = fast.exponential;
  config.quality.transmittance_min = max(config.quality.transmittance_min, fast.transmittance_min);
  config.quality.normalize_closed = fast.normalize_closed;
  return config;
}

/// `set` filtered for the pixels of O_photo(k): the mean of k x k samples, each blurred by the set's own
/// filter. Opacities compensate for the part of a pixel's blur that a sample does not have.
inline GaussianSet filtered_for_photo(GaussianSet set, const LodChoice& choice) noexcept {
  const double k2 = static_cast<double>(choice.photo) * choice.photo;
  const double sample = static_cast<double>(set.eps2d) / k2;
  // k points spaced evenly over a pixel have the variance (1 - 1 / k^2) / 12.
  set.eps2d = static_cast<float>(sample + (1 - 1 / k2) / 12);
  set.base_eps2d = set.filter == Filter::mip ? 0.0f : static_cast<float>(sample);
  set.filter = Filter::mip;
  return set;
}

/// Size of a metre at a depth of 1, in units of choice.pixels.
inline double lod_units_per_metre(const ProjectionCamera<double>& camera,
                                  const LodChoice& choice) noexcept {
  return max(camera.fx, camera.fy) / choice.pixels;
}

/// Error of merged Gaussians as a multiple of the largest that is allowed.
/// @param error,grain values of LodNode, metres.
/// @param scale size of a metre at their nearest depth, in units of choice.pixels.
inline double relative_lod_error(float error, float grain, double scale,
                                 const LodChoice& choice) noexcept {
  const double grains = static_cast<double>(grain) * scale * choice.pixels / choice.grain;
  return static_cast<double>(error) * scale * max(grains, 1.0);
}

namespace detail {

/// Tells whether a camera may see a node, and the nearest depth of the node. Depths are in asset units.
struct SeenByCamera {
  const ProjectionCamera<double>& camera;
  bool shows(const ChunkBounds& reach) const noexcept { return may_be_visible(camera, reach); }
  double nearest(const ChunkBounds& reach) const noexcept { return ChunkInView(camera, reach).z_min(); }
};

/// The same for all cameras in a box that differ in position and rotation only.
struct SeenFromBox {
  Aabb<double> box;      ///< Positions of the cameras.
  double cosine;         ///< Cosine of the largest angle between the view axis and a ray of the image.
  double nearest_depth;  ///< Least depth of a Gaussian that is drawn.
  static bool shows(const ChunkBounds&) noexcept { return true; }
  double nearest(const ChunkBounds& reach) const noexcept {
    const double squared = distance2({reach.low, reach.high}, box);
    return max(sqrt(squared) * cosine * (1 - 1e-6), nearest_depth);
  }
};

}  // namespace detail

/// Chooses for one sensor which nodes of a level-of-detail tree are drawn. A cut remembers its last
/// choice, for hysteresis; otherwise it depends on the camera only. The same sequence of calls gives the
/// same cuts.
class LodCut {
 public:
  /// `tree` and the cloud from which it was built must outlive the cut.
  LodCut(const LodTree& tree, const GaussianCloud& cloud) : tree_(&tree), cloud_(&cloud) {}
  /// Deleted: a temporary tree would not outlive the cut.
  LodCut(const LodTree&& tree, const GaussianCloud& cloud) = delete;
  /// Deleted: a temporary cloud would not outlive the cut.
  LodCut(const LodTree& tree, const GaussianCloud&& cloud) = delete;
  /// Deleted: temporaries would not outlive the cut.
  LodCut(const LodTree&& tree, const GaussianCloud&& cloud) = delete;

  /// Chooses the nodes for a camera and returns what to draw: chunks of the cloud and merged Gaussians,
  /// filtered for the pixels of O_photo(choice.photo). Valid until the next call.
  /// @param world_from_asset placement of the cloud in the world.
  /// @param seen chunks and rows that may be seen from the camera's cell (VisibleSets::seen_from, in
  /// host memory). Nodes without a seen chunk are left out, and so are unseen rows of the cloud's
  /// chunks. Empty: everything may be seen.
  std::span<const GaussianSet> select(const Camera& camera, const LodChoice& choice = {},
                                      const Similarity& world_from_asset = {},
                                      View<const std::uint32_t> seen = {}) {
    const auto p = make_projection_camera<double>(camera, photo_set(*cloud_, choice, world_from_asset));
    refined_.resize(tree_->nodes.size());
    return choose(detail::SeenByCamera{p}, lod_units_per_metre(p, choice), choice, world_from_asset,
                  seen);
  }

  /// Chooses the nodes for all cameras in a box that have the size, focal lengths and near plane of
  /// `camera`, whatever their rotations. No node has a larger error for one of them than select()
  /// allows, so that they can share the cut. It has no hysteresis.
  /// @param box positions of the cameras in the asset's frame.
  std::span<const GaussianSet> select_from(const Aabb<double>& box, const Camera& camera,
                                           LodChoice choice = {},
                                           const Similarity& world_from_asset = {},
                                           View<const std::uint32_t> seen = {}) {
    choice.hysteresis = 0;
    refined_.clear();
    const auto p = make_projection_camera<double>(camera, photo_set(*cloud_, choice, world_from_asset));
    const double x = max(camera.cx, camera.width - camera.cx) / camera.fx,
                 y = max(camera.cy, camera.height - camera.cy) / camera.fy;
    return choose(detail::SeenFromBox{box, 1 / sqrt(1 + x * x + y * y), p.near_plane / p.scale},
                  lod_units_per_metre(p, choice), choice, world_from_asset, seen);
  }
  /// Forgets the last choice, and with it the hysteresis.
  void reset() { refined_.clear(); }

  /// Numbers of the last select() or select_from().
  const LodStats& stats() const noexcept { return stats_; }
  /// The sets of that call.
  std::span<const GaussianSet> sets() const noexcept { return sets_; }
  /// Chunks of the cloud that it chose.
  const std::vector<std::uint32_t>& leaf_chunks() const noexcept { return leaf_chunks_; }
  /// Chunks of LodTree::merged that it chose.
  const std::vector<std::uint32_t>& merged_chunks() const noexcept { return merged_chunks_; }

  /// The set of a cloud, filtered_for_photo().
  static GaussianSet photo_set(const GaussianCloud& cloud, const LodChoice& choice,
                               const Similarity& world_from_asset = {}) {
    return filtered_for_photo(cloud.set(world_from_asset), choice);
  }
  /// Deleted: the set would point into a temporary cloud.
  static GaussianSet photo_set(const GaussianCloud&& cloud, const LodChoice& choice,
                               const Similarity& world_from_asset = {}) = delete;

 private:
  template <class Viewer>
  std::span<const GaussianSet> choose(const Viewer& viewer, double per_metre, const LodChoice& choice,
                                      const Similarity& world_from_asset,
                                      View<const std::uint32_t> seen) {
    seen_ = seen.empty()
                ? seen
                : View<const std::uint32_t>{seen.data, seen_chunk_words(cloud_->view().chunk_count())};
    leaf_chunks_.clear();
    merged_chunks_.clear();
    sets_.clear();
    stats_ = {};
    if (tree_->nodes.empty()) return {};
    if (tree_->boxes.empty()) {
      visit(tree_->levels() - 1, tree_->nodes.size() - 1, viewer, per_metre, choice);
    } else {
      for (const std::uint32_t root : tree_->roots) {
        if (seen_.empty() || shows_seen(root)) descend(root, viewer, per_metre, choice);
      }
    }
    add(*cloud_, leaf_chunks_, choice, world_from_asset, seen);
    add(tree_->merged, merged_chunks_, choice, world_from_asset);
    return sets_;
  }
  void add(const GaussianCloud& cloud, const std::vector<std::uint32_t>& chunks, const LodChoice& choice,
           const Similarity& world_from_asset, View<const std::uint32_t> seen = {}) {
    if (chunks.empty()) return;
    sets_.push_back(photo_set(cloud, choice, world_from_asset));
    sets_.back().selection = {{chunks.data(), chunks.size()}, seen};
  }
  /// Whether any of the chunks [first, end) is seen. The range may extend beyond the cloud's chunks.
  bool any_seen(std::uint64_t first, std::uint64_t end) const noexcept {
    end = min<std::uint64_t>(end, 32 * std::uint64_t{seen_.size});
    for (std::uint64_t c = first; c < end;) {
      const std::uint64_t in_word =
          min<std::uint64_t>(end - c / 32 * 32, 32);  // where the range ends in this word
      const std::uint32_t below = in_word == 32 ? ~0u : (1u << in_word) - 1u;
      if ((seen_[c / 32] & below) >> (c % 32) != 0) return true;
      c = c / 32 * 32 + 32;
    }
    return false;
  }
  /// Whether any chunk below a box of a forest is seen. The finest node of the box has the chunks of the
  /// cloud.
  bool shows_seen(std::uint32_t node) const noexcept {
    while (tree_->boxes[node].finer != LodBox::kNone) node = tree_->boxes[node].finer;
    const LodBox& box = tree_->boxes[node];
    return any_seen(box.first_chunk, std::uint64_t{box.first_chunk} + box.chunks);
  }
  /// Whether the node is too coarse, so that its children are drawn instead. `scale`: size of a metre
  /// at the node's nearest depth, in units of choice.pixels.
  bool refine(std::size_t node, double scale, const LodChoice& choice) {
    const LodNode& n = tree_->nodes[node];
    const double error = relative_lod_error(n.error, n.grain, scale, choice);
    if (refined_.empty()) return error > 1;
    const bool finer = error > (refined_[node] != 0 ? 1 - choice.hysteresis : 1 + choice.hysteresis);
    refined_[node] = finer ? 1 : 0;
    return finer;
  }
  void note_error(const LodNode& n, double scale, const LodChoice& choice) noexcept {
    stats_.error_px = max(stats_.error_px, static_cast<double>(n.error) * scale * choice.pixels);
  }
  /// Chooses the level of one box of a forest, from its coarsest node down.
  template <class Viewer>
  void descend(std::uint32_t node, const Viewer& viewer, double per_metre, const LodChoice& choice) {
    for (;;) {
      const LodNode& n = tree_->nodes[node];
      const LodBox& box = tree_->boxes[node];
      if (!viewer.shows(n.reach)) return;
      const double scale = per_metre / viewer.nearest(n.reach);
      const bool leaf = box.finer == LodBox::kNone;
      if (!leaf && refine(node, scale, choice)) {
        node = box.finer;
        continue;
      }
      std::vector<std::uint32_t>& chunks = leaf ? leaf_chunks_ : merged_chunks_;
      for (std::uint32_t c = 0; c < box.chunks; ++c) chunks.push_back(box.first_chunk + c);
      stats_.shown += box.shown;
      stats_.merged += leaf ? 0 : box.shown;
      stats_.drawn += box.rows;
      note_error(n, scale, choice);
      return;
    }
  }
  template <class Viewer>
  void visit(std::size_t level, std::size_t node, const Viewer& viewer, double per_metre,
             const LodChoice& choice) {
    const LodNode& n = tree_->nodes[node];
    const std::uint64_t place = node - tree_->level_begin[level];
    if (!seen_.empty() && !any_seen(place << level, (place + 1) << level)) return;
    if (!viewer.shows(n.reach)) return;
    const double scale = per_metre / viewer.nearest(n.reach);
    if (!(level > 0 && refine(node, scale, choice))) {
      draw(level, node);
      note_error(n, scale, choice);
      return;
    }
    const std::size_t first = tree_->level_begin[level - 1] + 2 * place;
    visit(level - 1, first, viewer, per_metre, choice);
    if (first + 1 < tree_->level_begin[level]) visit(level - 1, first + 1, viewer, per_metre, choice);
  }

  void draw(std::size_t level, std::size_t node) {
    const std::uint64_t first = (node - tree_->level_begin[level]) << level;
    const std::uint64_t end = min<std::uint64_t>(first + (std::uint64_t{1} << level), tree_->leaves());
    const std::uint64_t shown =
        min<std::uint64_t>(end * kProjectChunk, cloud_->size()) - first * kProjectChunk;
    stats_.shown += shown;
    if (level == 0) {
      leaf_chunks_.push_back(static_cast<std::uint32_t>(node));
      stats_.drawn += shown;
      return;
    }
    merged_chunks_.push_back(static_cast<std::uint32_t>(node - tree_->leaves()));
    stats_.merged += shown;
    stats_.drawn += kProjectChunk;
  }

  const LodTree* tree_;
  const GaussianCloud* cloud_;
  View<const std::uint32_t> seen_;
  std::vector<std::uint8_t> refined_;  // Last choice of select(), per node; else empty.
  std::vector<std::uint32_t> leaf_chunks_, merged_chunks_;
  std::vector<GaussianSet> sets_;
  LodStats stats_;
};

}  // namespace gsnav
