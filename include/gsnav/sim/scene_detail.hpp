// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/scene/lod_cut.hpp"

namespace gsnav {

/// How a scene's assets are drawn by levels of detail (docs/lod.md).
struct SceneDetail {
  struct Asset {
    const LodTree* tree;
    const GaussianCloud* cloud;
    Similarity world_from_asset;
  };
  std::vector<Asset> assets;  ///< in the order of the scene's sets; empty: all are drawn whole
  LodChoice choice{};
};

/// What one camera draws of a scene by levels of detail. It depends on the camera alone, not on what was
/// seen before: a simulator that is set back to a state, or is one of a batch, sees the same bits.
class DetailSets {
 public:
  /// `sets`: the scene's, assets first, then avatars, which stay as they are. Valid until the next call.
  std::span<const GaussianSet> select(const SceneDetail& detail, std::span<const GaussianSet> sets,
                                      const Camera& camera) {
    LodChoice choice = detail.choice;
    choice.hysteresis = 0;
    cuts_.resize(detail.assets.size());
    sets_.clear();
    stats_ = {};
    for (std::size_t a = 0; a < detail.assets.size(); ++a) {
      const SceneDetail::Asset& asset = detail.assets[a];
      Cut& cut = cuts_[a];
      if (cut.tree != asset.tree || cut.cloud != asset.cloud) {
        cut = {asset.tree, asset.cloud, LodCut(*asset.tree, *asset.cloud)};
      }
      const auto chosen = cut.cut->select(camera, choice, asset.world_from_asset);
      sets_.insert(sets_.end(), chosen.begin(), chosen.end());
      stats_.shown += cut.cut->stats().shown;
      stats_.merged += cut.cut->stats().merged;
    }
    const auto others =
        sets.subspan(detail.assets.size() < sets.size() ? detail.assets.size() : sets.size());
    sets_.insert(sets_.end(), others.begin(), others.end());
    return sets_;
  }

  /// The rules by which to draw them; valid until the next call.
  const RenderConfig& rules(const RenderConfig& config) {
    rules_ = lod_config(config, stats_);
    return rules_;
  }

 private:
  struct Cut {
    const LodTree* tree = nullptr;
    const GaussianCloud* cloud = nullptr;
    std::optional<LodCut> cut;
  };
  std::vector<Cut> cuts_;
  std::vector<GaussianSet> sets_;
  LodStats stats_;  // shown and merged of all
  RenderConfig rules_;
};

}  // namespace gsnav
