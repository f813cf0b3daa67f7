// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/visible_sets.hpp"

namespace gsnav {

/// How a scene's assets are drawn by levels of detail (docs/concepts/scene.md), by what is seen from
/// where the camera is, or both.
struct SceneDetail {
  struct Asset {
    const LodTree* tree;  ///< null: all of the cloud, or what of it is seen
    const GaussianCloud* cloud;
    Similarity world_from_asset;
    GaussianRows cloud_there{},
        merged_there{};  ///< cloud's and tree's arrays in a backend's own memory; empty: the host's
    const VisibleSets* visible = nullptr;  ///< null: anything may be seen
    const std::uint32_t* visible_there =
        nullptr;  ///< visible->bits in a backend's own memory; null: the host's
  };
  std::vector<Asset> assets;  ///< in the order of the scene's sets; empty: all are drawn whole
  LodChoice choice{};
};

/// What one camera draws of a scene by levels of detail and visible sets. It depends on the camera
/// alone, not on what was seen before: a simulator that is set back to a state, or is one of a batch,
/// sees the same bits.
class DetailSets {
 public:
  /// `sets`: the scene's, assets first, then avatars, which stay as they are. Valid until the next call.
  std::span<const GaussianSet> select(const SceneDetail& detail, std::span<const GaussianSet> sets,
                                      const Camera& camera) {
    LodChoice choice = detail.choice;
    choice.hysteresis = 0;
    cuts_.resize(detail.assets.size());
    sets_.clear();
    chunks_.clear();
    to_place_.clear();
    stats_ = {};
    looked_from_.clear();
    for (std::size_t a = 0; a < detail.assets.size(); ++a) {
      const SceneDetail::Asset& asset = detail.assets[a];
      const auto cell = asset.visible != nullptr ? asset.visible->cell_of(camera, asset.world_from_asset)
                                                 : std::nullopt;
      View<const std::uint32_t> seen;
      if (cell) {
        seen = asset.visible->seen_from(*cell);
        looked_from_.push_back({asset.visible, *cell, asset.cloud->size()});
      }
      if (asset.tree == nullptr) {
        sets_.push_back(sets[a]);
        if (cell) sets_.back().selection.seen = asset.visible->seen_from(*cell, asset.visible_there);
        continue;
      }
      Cut& cut = cuts_[a];
      if (cut.tree != asset.tree || cut.cloud != asset.cloud) {
        cut = {asset.tree, asset.cloud, LodCut(*asset.tree, *asset.cloud)};
      }
      const auto chosen = cut.cut->select(camera, choice, asset.world_from_asset, seen);
      for (const GaussianSet& set : chosen) {
        sets_.push_back(set);
        if (asset.cloud_there.size() != 0) {
          move(asset, sets_.back(), cell);
          to_place_.push_back(sets_.size() - 1);
        }
      }
      stats_.shown += cut.cut->stats().shown;
      stats_.merged += cut.cut->stats().merged;
    }
    const auto others =
        sets.subspan(detail.assets.size() < sets.size() ? detail.assets.size() : sets.size());
    sets_.insert(sets_.end(), others.begin(), others.end());
    return sets_;
  }

  /// The last choice, its chunks where place_chunks() put them.
  std::span<const GaussianSet> sets() const noexcept { return sets_; }
  /// The rules by which to draw them; valid until the next call.
  const RenderConfig& rules(const RenderConfig& config) {
    rules_ = lod_config(config, stats_);
    return rules_;
  }

  /// How asset `a`, which has a tree, was cut by the last choice; its sets are of the host's arrays.
  const LodCut& cut(std::size_t a) const noexcept { return *cuts_[a].cut; }
  /// Gaussians of the assets that the last choice left out since nothing of them is seen from the
  /// camera's cell; where sets know of whole chunks only, less than a chunk too few.
  std::uint64_t unseen() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& [sets, cell, rows] : looked_from_) sum += rows - sets->count_seen_rows(cell, rows);
    return sum;
  }

  /// Chunks of the last choice that a backend with a memory of its own has to be given, and where they
  /// are there.
  std::span<const std::uint32_t> chunks() const noexcept { return chunks_; }
  void place_chunks(const std::uint32_t* there) noexcept {
    for (const std::size_t s : to_place_) {
      View<const std::uint32_t>& drawn = sets_[s].selection.drawn_chunks;
      drawn.data = there;
      there += drawn.size;
    }
  }

 private:
  /// From the host's arrays to the backend's.
  void move(const SceneDetail::Asset& asset, GaussianSet& set, std::optional<std::size_t> cell) {
    const View<const std::uint32_t> drawn = set.selection.drawn_chunks;
    chunks_.insert(chunks_.end(), drawn.data, drawn.data + drawn.size);
    const bool is_cloud = set.gaussians.shape.means.data[0] == asset.cloud->means[0].data();
    set.gaussians = is_cloud ? asset.cloud_there : asset.merged_there;
    set.selection = {{nullptr, drawn.size}, {}};
    if (is_cloud && cell) set.selection.seen = asset.visible->seen_from(*cell, asset.visible_there);
  }

  struct Cut {
    const LodTree* tree = nullptr;
    const GaussianCloud* cloud = nullptr;
    std::optional<LodCut> cut;
  };
  std::vector<Cut> cuts_;
  std::vector<GaussianSet> sets_;
  std::vector<std::uint32_t> chunks_;
  std::vector<std::size_t> to_place_;  // sets whose chunks these are
  LodStats stats_;                     // shown and merged of all
  struct LookedFrom {
    const VisibleSets* sets;
    std::size_t cell, rows;  // of the asset's cloud
  };
  std::vector<LookedFrom> looked_from_;
  RenderConfig rules_;
};

/// Takes what cuts chose to where a backend reads it: for a memory of its own, in one copy.
template <Backend B>
class ChosenChunks {
 public:
  explicit ChosenChunks(B& backend) : there_(backend) {}

  /// The sets of these cuts can be drawn until the next call.
  void place(std::span<DetailSets> cuts) {
    if constexpr (!is_host_backend<B>) {
      all_.clear();
      for (const DetailSets& cut : cuts)
        all_.insert(all_.end(), cut.chunks().begin(), cut.chunks().end());
      there_.resize_discard(all_.size());
      there_.upload(all_.data(), all_.size());
      const std::uint32_t* at = there_.data();
      for (DetailSets& cut : cuts) {
        cut.place_chunks(at);
        at += cut.chunks().size();
      }
    }
  }

 private:
  std::vector<std::uint32_t> all_;
  Buffer<std::uint32_t, B> there_;
};

}  // namespace gsnav
