// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gsnav/detail/frame/cull.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/scene/lod_tree.hpp"

namespace gsnav {

/// How LodCut chooses.
struct LodChoice {
  double pixels = 1;  ///< a node is fine enough where its error is at most so many pixels ...
  /// ... and times its grain at most pixels times this, in square pixels: the larger Gaussians are, the
  /// nearer direct rendering is to the photo, and the less may be merged.
  double grain = 0.5;
  double hysteresis =
      0.1;  ///< a node that is drawn stays until its error is beyond (1 + this) of that; one that is
            ///< refined, until it is below (1 - this): levels do not flicker where a camera rests
  int photo = 4;  ///< the images to come near to: at so many times the resolution, averaged (O_photo)
};

/// Names the field that cannot be, or ok.
inline Status validate(const LodChoice& c) {
  const BadArgument bad{"LodChoice."};
  if (!(c.pixels > 0 && is_finite(c.pixels))) return bad("pixels", c.pixels, "must be positive");
  if (!(c.grain > 0 && is_finite(c.grain))) return bad("grain", c.grain, "must be positive");
  if (!(c.hysteresis >= 0 && c.hysteresis < 1))
    return bad("hysteresis", c.hysteresis, "must be in [0, 1)");
  if (c.photo < 1 || c.photo > 16) return bad("photo", c.photo, "must be in [1, 16]");
  return {};
}

/// What a cut draws, in Gaussians of the cloud where nothing else is said.
struct LodStats {
  std::uint64_t shown = 0;   ///< in chunks that may be in view
  std::uint64_t merged = 0;  ///< of these, those that merged ones stand for
  std::uint64_t drawn = 0;   ///< rows drawn for them, merged ones and others
  double error_px = 0;       ///< the largest error of a node that is drawn (LodNode::error), pixels
};

/// The rules of the profile `lod`: those of `fast`; and where at least half of what a cut shows is
/// merged, a pixel ends where less than 1/1000 of the light comes through. (Where little is merged
/// Gaussians are large and direct rendering is 60 dB and more from the photo: an earlier end would be
/// what is seen of the error.)
inline RenderConfig lod_config(RenderConfig config, const LodStats& stats = {}) noexcept {
  config.quality.exponential = Exponential::fast;
  if (stats.shown > 0 && 2 * stats.merged >= stats.shown) {
    config.quality.transmittance_min = std::max(config.quality.transmittance_min, 0.001);
  }
  return config;
}

/// A cut through a level-of-detail tree, for one sensor: which chunks are drawn. It remembers what it
/// chose, for hysteresis, and else depends on the camera only: the same calls give the same cuts.
class LodCut {
 public:
  /// The tree, and the cloud that it was built of, must outlive this.
  LodCut(const LodTree& tree, const GaussianCloud& cloud)
      : tree_(&tree), cloud_(&cloud), refined_(tree.nodes.size()) {}
  LodCut(const LodTree&& tree, const GaussianCloud& cloud) = delete;
  LodCut(const LodTree& tree, const GaussianCloud&& cloud) = delete;
  LodCut(const LodTree&& tree, const GaussianCloud&& cloud) = delete;

  /// Chooses for a camera; the cloud stands in the world by `world_from_asset`. What to draw then:
  /// chunks of the cloud, and merged ones, as the pixels of O_photo(choice.photo) see them. Valid until
  /// the next call. `seen`: what of the cloud may be seen (VisibleSets::seen_from, here): what shows
  /// none of its chunks is left out, and of chunks of the cloud its rows; empty: all may be.
  std::span<const GaussianSet> select(const Camera& camera, const LodChoice& choice = {},
                                      const Similarity& world_from_asset = {},
                                      View<const std::uint32_t> seen = {}) {
    seen_ = seen.empty()
                ? seen
                : View<const std::uint32_t>{seen.data, seen_chunk_words(cloud_->view().chunk_count())};
    leaf_chunks_.clear();
    merged_chunks_.clear();
    sets_.clear();
    stats_ = {};
    if (tree_->nodes.empty()) return {};
    const GaussianSet whole = photo_set(*cloud_, choice, world_from_asset);
    const auto p = make_projection_camera<double>(camera, whole);
    const double per_metre = std::max(p.fx, p.fy) / choice.pixels;
    if (tree_->boxes.empty()) {
      visit(tree_->levels() - 1, tree_->nodes.size() - 1, p, per_metre, choice);
    } else {
      for (const std::uint32_t root : tree_->roots) {
        if (seen_.empty() || shows_seen(root)) descend(root, p, per_metre, choice);
      }
    }
    add(*cloud_, leaf_chunks_, choice, world_from_asset, seen);
    add(tree_->merged, merged_chunks_, choice, world_from_asset);
    return sets_;
  }
  /// Forgets what was chosen before.
  void reset() { std::fill(refined_.begin(), refined_.end(), std::uint8_t{0}); }

  /// What the last select() chose.
  const LodStats& stats() const noexcept { return stats_; }
  /// Sets to draw: the cloud's chunks and the merged chunks.
  std::span<const GaussianSet> sets() const noexcept { return sets_; }
  /// Chosen chunks of the cloud.
  const std::vector<std::uint32_t>& leaf_chunks() const noexcept { return leaf_chunks_; }
  /// Chosen chunks of merged Gaussians.
  const std::vector<std::uint32_t>& merged_chunks() const noexcept { return merged_chunks_; }

  /// A cloud as the pixels of O_photo(k) see it: averaged over k x k samples, each blurred as the
  /// cloud's filter says; opacities make up for what a pixel blurs more than a sample.
  static GaussianSet photo_set(const GaussianCloud& cloud, const LodChoice& choice,
                               const Similarity& world_from_asset = {}) {
    GaussianSet s = cloud.set(world_from_asset);
    const double k2 = static_cast<double>(choice.photo) * choice.photo;
    const double sample = static_cast<double>(cloud.eps2d) / k2;
    // k points side by side over a pixel have the variance (1 - 1 / k^2) / 12.
    s.eps2d = static_cast<float>(sample + (1 - 1 / k2) / 12);
    s.base_eps2d = cloud.filter == Filter::mip ? 0.0f : static_cast<float>(sample);
    s.filter = Filter::mip;
    return s;
  }
  static GaussianSet photo_set(const GaussianCloud&& cloud, const LodChoice& choice,
                               const Similarity& world_from_asset = {}) = delete;

 private:
  void add(const GaussianCloud& cloud, const std::vector<std::uint32_t>& chunks, const LodChoice& choice,
           const Similarity& world_from_asset, View<const std::uint32_t> seen = {}) {
    if (chunks.empty()) return;
    sets_.push_back(photo_set(cloud, choice, world_from_asset));
    sets_.back().selection = {{chunks.data(), chunks.size()}, seen};
  }
  /// Whether one of the chunks [first, end), some of which may be beyond the cloud's, is among those
  /// that are seen.
  bool any_seen(std::uint64_t first, std::uint64_t end) const noexcept {
    end = std::min<std::uint64_t>(end, 32 * std::uint64_t{seen_.size});
    for (std::uint64_t c = first; c < end;) {
      const std::uint64_t in_word =
          std::min<std::uint64_t>(end - c / 32 * 32, 32);  // where the range ends in it
      const std::uint32_t below = in_word == 32 ? ~0u : (1u << in_word) - 1u;
      if ((seen_[c / 32] & below) >> (c % 32) != 0) return true;
      c = c / 32 * 32 + 32;
    }
    return false;
  }
  /// The same of what a box of a forest shows: its finest node has the cloud's chunks.
  bool shows_seen(std::uint32_t node) const noexcept {
    while (tree_->boxes[node].finer != LodBox::kNone) node = tree_->boxes[node].finer;
    const LodBox& box = tree_->boxes[node];
    return any_seen(box.first_chunk, std::uint64_t{box.first_chunk} + box.chunks);
  }
  /// What a metre is at the node's nearest depth, in choice.pixels.
  static double scale_of(const LodNode& n, const ProjectionCamera<double>& camera,
                         double per_metre) noexcept {
    return per_metre / detail::ChunkInView(camera, n.reach).z_min();
  }
  /// Whether what is finer than a node is needed.
  bool refine(std::size_t node, double scale, const LodChoice& choice) {
    const LodNode& n = tree_->nodes[node];
    const double grain = static_cast<double>(n.grain) * scale * choice.pixels / choice.grain;
    const double error = static_cast<double>(n.error) * scale * std::max(grain, 1.0);
    const bool finer = error > (refined_[node] != 0 ? 1 - choice.hysteresis : 1 + choice.hysteresis);
    refined_[node] = finer ? 1 : 0;
    return finer;
  }
  void note_error(const LodNode& n, double scale, const LodChoice& choice) noexcept {
    stats_.error_px = std::max(stats_.error_px, static_cast<double>(n.error) * scale * choice.pixels);
  }
  /// The level of one box of a forest.
  void descend(std::uint32_t node, const ProjectionCamera<double>& camera, double per_metre,
               const LodChoice& choice) {
    for (;;) {
      const LodNode& n = tree_->nodes[node];
      const LodBox& box = tree_->boxes[node];
      if (!may_be_visible(camera, n.reach)) return;
      const double scale = scale_of(n, camera, per_metre);
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
  void visit(std::size_t level, std::size_t node, const ProjectionCamera<double>& camera,
             double per_metre, const LodChoice& choice) {
    const LodNode& n = tree_->nodes[node];
    const std::uint64_t place = node - tree_->level_begin[level];
    if (!seen_.empty() && !any_seen(place << level, (place + 1) << level)) return;
    if (!may_be_visible(camera, n.reach)) return;
    const double scale = scale_of(n, camera, per_metre);
    if (!(level > 0 && refine(node, scale, choice))) {
      draw(level, node);
      note_error(n, scale, choice);
      return;
    }
    const std::size_t first = tree_->level_begin[level - 1] + 2 * place;
    visit(level - 1, first, camera, per_metre, choice);
    if (first + 1 < tree_->level_begin[level]) visit(level - 1, first + 1, camera, per_metre, choice);
  }

  void draw(std::size_t level, std::size_t node) {
    const std::uint64_t first = (node - tree_->level_begin[level]) << level;
    const std::uint64_t end =
        std::min<std::uint64_t>(first + (std::uint64_t{1} << level), tree_->leaves());
    const std::uint64_t shown =
        std::min<std::uint64_t>(end * kProjectChunk, cloud_->size()) - first * kProjectChunk;
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
  std::vector<std::uint8_t> refined_;
  std::vector<std::uint32_t> leaf_chunks_, merged_chunks_;
  std::vector<GaussianSet> sets_;
  LodStats stats_;
};

}  // namespace gsnav
