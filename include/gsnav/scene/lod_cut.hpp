// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/kernels/cull.hpp"
#include "gsnav/kernels/projection_camera.hpp"
#include "gsnav/scene/lod_tree.hpp"

namespace gsnav {

/// How LodCut chooses.
struct LodChoice {
  double pixels = 0.5;      ///< a node is fine enough where its error is at most so many pixels
  double hysteresis = 0.1;  ///< a node that is drawn stays until its error is beyond (1 + this) of that; one that is
                            ///< refined, until it is below (1 - this): levels do not flicker where a camera rests
  int photo = 4;            ///< the images to come near to: at so many times the resolution, averaged (O_photo)
};

/// A cut through a level-of-detail tree, for one sensor: which chunks are drawn. It remembers what it chose, for
/// hysteresis, and else depends on the camera only: the same calls give the same cuts.
class LodCut {
 public:
  /// The tree, and the cloud that it was built of, must stay.
  LodCut(const LodTree& tree, const GaussianCloud& cloud) : tree_(&tree), cloud_(&cloud), refined_(tree.nodes.size()) {}

  /// Chooses for a camera; the cloud stands in the world by `world_from_asset`.
  void select(const Camera& camera, const LodChoice& choice = {}, const Similarity& world_from_asset = {}) {
    leaf_chunks_.clear();
    merged_chunks_.clear();
    if (tree_->nodes.empty()) return;
    GaussianSet set = cloud_->set(world_from_asset);
    set.eps2d = std::max(set.eps2d, eps2d(choice, set.eps2d));
    const auto p = make_projection_camera<double>(camera, set);
    const double per_metre = std::max(p.fx, p.fy) / choice.pixels;
    const std::size_t root = tree_->nodes.size() - 1;
    visit(tree_->levels() - 1, root, p, per_metre, choice.hysteresis);
  }
  /// Forgets what was chosen before.
  void reset() { std::fill(refined_.begin(), refined_.end(), std::uint8_t{0}); }

  /// What is drawn: chunks of the cloud, and merged ones; either may be empty. Valid until the next select().
  /// As O_photo sees them: pixels are averaged over photo x photo samples, each blurred as the cloud's filter says, and
  /// opacities make up for what a pixel blurs more than a sample.
  std::vector<GaussianSet> sets(const LodChoice& choice = {}, const Similarity& world_from_asset = {}) const {
    std::vector<GaussianSet> out;
    const auto add = [&](const GaussianCloud& cloud, const std::vector<std::uint32_t>& chunks) {
      if (chunks.empty()) return;
      GaussianSet s = cloud.set(world_from_asset);
      s.gaussians.drawn_chunks = {chunks.data(), chunks.size()};
      const float own = s.eps2d;
      s.eps2d = eps2d(choice, own);
      s.base_eps2d = cloud_->filter == Filter::mip ? 0.0f : own / static_cast<float>(choice.photo * choice.photo);
      s.filter = Filter::mip;
      out.push_back(s);
    };
    add(*cloud_, leaf_chunks_);
    add(tree_->merged, merged_chunks_);
    return out;
  }
  const std::vector<std::uint32_t>& leaf_chunks() const noexcept { return leaf_chunks_; }
  const std::vector<std::uint32_t>& merged_chunks() const noexcept { return merged_chunks_; }

  /// px^2 by which O_photo(k) blurs: a sample's own filter, and k samples an axis over the pixel.
  static float eps2d(const LodChoice& choice, float own) noexcept {
    const double k2 = static_cast<double>(choice.photo) * choice.photo;
    return static_cast<float>(static_cast<double>(own) / k2 + (1 - 1 / k2) / 12);
  }

 private:
  void visit(std::size_t level, std::size_t node, const ProjectionCamera<double>& camera, double per_metre,
             double hysteresis) {
    const LodNode& n = tree_->nodes[node];
    if (!may_be_visible(camera, n.reach)) return;
    bool refine = level > 0;
    if (refine) {
      const double z = detail::ChunkInView(camera, n.reach).z_min();
      const double limit = refined_[node] != 0 ? 1 - hysteresis : 1 + hysteresis;
      refine = static_cast<double>(n.error) * per_metre > limit * z;
      refined_[node] = refine ? 1 : 0;
    }
    if (!refine) {
      if (level == 0) {
        leaf_chunks_.push_back(static_cast<std::uint32_t>(node));
      } else {
        merged_chunks_.push_back(static_cast<std::uint32_t>(node - tree_->leaves()));
      }
      return;
    }
    const std::size_t i = node - tree_->level_begin[level];
    const std::size_t first = tree_->level_begin[level - 1] + 2 * i;
    visit(level - 1, first, camera, per_metre, hysteresis);
    if (first + 1 < tree_->level_begin[level]) visit(level - 1, first + 1, camera, per_metre, hysteresis);
  }

  const LodTree* tree_;
  const GaussianCloud* cloud_;
  std::vector<std::uint8_t> refined_;
  std::vector<std::uint32_t> leaf_chunks_, merged_chunks_;
};

}  // namespace gsnav
