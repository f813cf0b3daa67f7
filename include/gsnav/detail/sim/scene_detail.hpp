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

/// Selects which part of a scene's assets is drawn: by level of detail (docs/concepts/scene.md), by
/// visibility from the camera's cell, or both.
struct SceneDetail {
  /// Data of one asset.
  struct Asset {
    const LodTree* tree;                         ///< Level-of-detail tree. Null: no levels of detail.
    const GaussianCloud* cloud;                  ///< The Gaussians.
    Similarity world_from_asset;                 ///< Transform from the asset's frame to the world.
    GaussianRows cloud_there{}, merged_there{};  ///< Arrays of `cloud` and of the tree in the backend's
                                                 ///< own memory. Empty if it uses host memory.
    const VisibleSets* visible = nullptr;        ///< Visible sets. Null: everything may be visible.
    const std::uint32_t* visible_there =
        nullptr;  ///< `visible->bits` in the backend's own memory. Null if it uses host memory.
  };
  std::vector<Asset> assets;  ///< In the order of the scene's sets. Empty: draw all assets whole.
  LodChoice choice{};         ///< Settings of the levels of detail.
};

/// The sets that one camera draws with levels of detail and visible sets. They depend only on the
/// camera, not on earlier views. A simulator that was restored to a state, or is part of a batch,
/// therefore renders the same bits.
class DetailSets {
 public:
  /// Selects the sets for a camera. The result is valid until the next call.
  /// @param sets Sets of the scene: assets first, then avatars, which are not changed.
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

  /// Result of the last select(), with chunk lists where place_chunks() put them.
  std::span<const GaussianSet> sets() const noexcept { return sets_; }
  /// Render settings for these sets. Valid until the next call.
  const RenderConfig& rules(const RenderConfig& config) {
    rules_ = lod_config(config);
    return rules_;
  }

  /// How the last select() cut asset `a`. The asset must have a tree. The sets of the cut refer to host
  /// arrays.
  const LodCut& cut(std::size_t a) const noexcept { return *cuts_[a].cut; }
  /// Number of Gaussians that the last select() left out because they are invisible from the camera's
  /// cell. If visibility is known only per chunk, it may be less than a chunk too low.
  std::uint64_t unseen() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& [sets, cell, rows] : looked_from_) sum += rows - sets->count_seen_rows(cell, rows);
    return sum;
  }

  /// Chunk lists of the last select() that a backend with its own memory needs.
  std::span<const std::uint32_t> chunks() const noexcept { return chunks_; }
  /// Sets where the chunk lists are in the backend's memory.
  void place_chunks(const std::uint32_t* there) noexcept {
    for (const std::size_t s : to_place_) {
      View<const std::uint32_t>& drawn = sets_[s].selection.drawn_chunks;
      drawn.data = there;
      there += drawn.size;
    }
  }

 private:
  /// Changes a set from host arrays to the backend's arrays.
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
  std::vector<std::size_t> to_place_;  // Indices of the sets that own chunks_.
  LodStats stats_;                     // Totals of all cuts.
  struct LookedFrom {
    const VisibleSets* sets;
    std::size_t cell, rows;  // Cell, and number of rows of the asset's cloud.
  };
  std::vector<LookedFrom> looked_from_;
  RenderConfig rules_;
};

/// Makes chosen chunk lists readable for the backend. If it has its own memory, all lists are uploaded
/// in one copy.
template <Backend B>
class ChosenChunks {
 public:
  explicit ChosenChunks(B& backend) : there_(backend) {}

  /// Uploads the lists of these cuts. Their sets can be drawn until the next call.
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
