// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <span>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/scene/view_cells.hpp"
#include "gsnav/detail/sim/body_levels.hpp"
#include "gsnav/scene/lod_cut.hpp"

namespace gsnav {

/// Cuts of levels of detail, one per cell of space, shared by the cameras in it. A cut is found when a
/// camera first needs it. Thread-safe.
class LodCells {
 public:
  /// Edge of a cell, metres in the world.
  static constexpr double kEdge = 0.5;
  /// Limit of the memory of the cuts that are kept, in chunk numbers: 256 MB.
  static constexpr std::size_t kMostChunks = std::size_t{1} << 26;

  /// The cut of the cell of `camera`. Cells far from the origin have no number; a camera in one of them
  /// gets a cut of its own.
  /// @param asset number of the asset, with its tree and cloud.
  /// @param seen, seen_cell set of VisibleSets that applies to the camera, and its number. Empty:
  /// everything may be seen.
  std::shared_ptr<const LodCut> at(std::size_t asset, const LodTree& tree, const GaussianCloud& cloud,
                                   const Camera& camera, const LodChoice& choice,
                                   const Similarity& world_from_asset, View<const std::uint32_t> seen,
                                   std::optional<std::size_t> seen_cell) {
    const Vec3d eye = camera.position_in(world_from_asset);
    const double edge = kEdge / world_from_asset.scale;
    const auto cell = VisibleSets::key_of(eye, edge);
    const auto make = [&](const Aabb<double>& box) {
      auto cut = std::make_shared<LodCut>(tree, cloud);
      cut->select_from(box, camera, choice, world_from_asset, seen);
      return cut;
    };
    if (!cell) return make({eye, eye});
    const Key key{
        asset,        &tree,       *cell,        seen_cell,     camera.fx,         camera.fy,
        camera.cx,    camera.cy,   camera.width, camera.height, camera.near_plane, choice.pixels,
        choice.grain, choice.photo};
    {
      const std::shared_lock lock(mutex_);
      if (const auto found = cuts_.find(key); found != cuts_.end()) return found->second;
    }
    Aabb<double> box;
    for (int k = 0; k < 3; ++k) {
      box.low[k] = edge * (*cell)[static_cast<std::size_t>(k)];
      box.high[k] = box.low[k] + edge;
    }
    auto cut = make(box);
    const std::size_t chunks = cut->leaf_chunks().size() + cut->merged_chunks().size();
    const std::scoped_lock lock(mutex_);
    if (chunks_ + chunks > kMostChunks) {
      cuts_.clear();
      chunks_ = 0;
    }
    const auto at = cuts_.emplace(key, std::move(cut));
    if (at.second) chunks_ += chunks;  // Another thread may have been faster.
    return at.first->second;
  }

 private:
  using Key = std::tuple<std::size_t, const LodTree*, VisibleSets::Key, std::optional<std::size_t>,
                         double, double, double, double, int, int, double, double, double, int>;
  std::shared_mutex mutex_;
  std::map<Key, std::shared_ptr<const LodCut>> cuts_;
  std::size_t chunks_ = 0;  // In all cuts.
};

/// Selects which part of a scene's assets is drawn: by level of detail (docs/concepts/scene.md), by
/// visibility from the camera's cell, or both.
struct LeveledScene {
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
  LodChoice choice{};         ///< Settings of the levels of detail. Without hysteresis.
  std::shared_ptr<LodCells> cells = std::make_shared<LodCells>();  ///< Cuts found so far.
};

/// The sets that one camera draws with levels of detail and visible sets. They depend only on the
/// camera and the cell that it is in, not on earlier views. A simulator that was restored to a state, or
/// is part of a batch, therefore renders the same bits.
class CutSets {
 public:
  /// Selects the sets for a camera. The result is valid until the next call.
  /// @param sets Sets of the scene: assets first, then avatars.
  /// @param bodies Levels of detail of the avatars. Empty, or without an asset: the avatar's set is not
  /// changed.
  std::span<const GaussianSet> select(const LeveledScene& levels, std::span<const GaussianSet> sets,
                                      const Camera& camera, std::span<const BodyLevels> bodies = {}) {
    cuts_.assign(levels.assets.size(), nullptr);
    sets_.clear();
    to_place_.clear();
    looked_from_.clear();
    for (std::size_t a = 0; a < levels.assets.size(); ++a) {
      const LeveledScene::Asset& asset = levels.assets[a];
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
      const LodCut& cut =
          *(cuts_[a] = levels.cells->at(a, *asset.tree, *asset.cloud, camera, levels.choice,
                                        asset.world_from_asset, seen, cell));
      for (const GaussianSet& set : cut.sets()) {
        sets_.push_back(set);
        if (asset.cloud_there.size() != 0) move(asset, a, sets_.back(), cell);
      }
    }
    const auto others =
        sets.subspan(levels.assets.size() < sets.size() ? levels.assets.size() : sets.size());
    for (std::size_t i = 0; i < others.size(); ++i) {
      const BodyLevels* const body = i < bodies.size() ? &bodies[i] : nullptr;
      sets_.push_back(body == nullptr || body->asset == nullptr ? others[i]
                                                                : body->set_for(camera, levels.choice));
    }
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
  const LodCut& cut(std::size_t a) const noexcept { return *cuts_[a]; }
  /// Number of Gaussians that the last select() left out because they are invisible from the camera's
  /// cell. Where visibility is known only per chunk, the number may be too low, by less than a chunk.
  std::uint64_t unseen() const noexcept {
    std::uint64_t sum = 0;
    for (const auto& [sets, cell, rows] : looked_from_) sum += rows - sets->count_seen_rows(cell, rows);
    return sum;
  }

  /// Calls f with each chunk list of the last select() that a backend with its own memory needs, and
  /// with the cut that holds the list. f returns the address of a copy there.
  template <class F>
  void place_chunks(const F& f) {
    for (const auto& [set, asset, list] : to_place_)
      sets_[set].selection.drawn_chunks.data = f(cuts_[asset], list);
  }

 private:
  /// Changes the last set from host arrays to the backend's arrays.
  void move(const LeveledScene::Asset& asset, std::size_t index, GaussianSet& set,
            std::optional<std::size_t> cell) {
    const View<const std::uint32_t> drawn = set.selection.drawn_chunks;
    to_place_.push_back({sets_.size() - 1, index, drawn});
    const bool is_cloud = set.gaussians.shape.means.data[0] == asset.cloud->means[0].data();
    set.gaussians = is_cloud ? asset.cloud_there : asset.merged_there;
    set.selection = {{nullptr, drawn.size}, {}};
    if (is_cloud && cell) set.selection.seen = asset.visible->seen_from(*cell, asset.visible_there);
  }

  std::vector<std::shared_ptr<const LodCut>> cuts_;  // Per asset.
  std::vector<GaussianSet> sets_;
  struct ToPlace {
    std::size_t set, asset;  // Indices in sets_ and cuts_.
    View<const std::uint32_t> chunks;
  };
  std::vector<ToPlace> to_place_;
  struct LookedFrom {
    const VisibleSets* sets;
    std::size_t cell, rows;  // Cell, and number of rows of the asset's cloud.
  };
  std::vector<LookedFrom> looked_from_;
  RenderConfig rules_;
};

/// Makes chosen chunk lists readable for the backend. If it has its own memory, each list is uploaded
/// when it is first needed, together with the other new lists of that call.
template <Backend B>
class ChosenChunks {
 public:
  explicit ChosenChunks(B& backend) : backend_(&backend), there_(backend) {}

  /// Uploads the lists of these cuts. Their sets can be drawn until the next call. Cameras that share a
  /// cut share its lists.
  void place(std::span<CutSets> cuts) {
    if constexpr (!is_host_backend<B>) {
      if (!list_new(cuts) || used_ + new_.size() > there_.size()) {
        // Forget all lists, so that memory is bounded, and list those of this call.
        kept_.clear();
        used_ = 0;
        list_new(cuts);
        there_.resize_discard(std::max(2 * there_.size(), 2 * new_.size()));
      }
      if (!new_.empty()) {
        backend_->copy(there_.data() + used_, new_.data(), new_.size() * sizeof(std::uint32_t),
                       CopyKind::host_to_device);
      }
      used_ += new_.size();
      for (CutSets& cut : cuts) {
        cut.place_chunks([&](const auto&, View<const std::uint32_t> list) {
          return std::as_const(there_).data() + kept_.at(list.data).first;
        });
      }
    }
  }

 private:
  /// Puts the lists that are not on the backend yet into new_. Returns false if more would be kept than
  /// LodCells keeps.
  bool list_new(std::span<CutSets> cuts) {
    new_.clear();
    for (CutSets& cut : cuts) {
      cut.place_chunks([&](const std::shared_ptr<const LodCut>& held, View<const std::uint32_t> list) {
        const auto [at, is_new] = kept_.try_emplace(list.data, used_ + new_.size(), held);
        if (is_new) new_.insert(new_.end(), list.data, list.data + list.size);
        return static_cast<const std::uint32_t*>(nullptr);
      });
    }
    return used_ + new_.size() <= LodCells::kMostChunks;
  }

  B* backend_;
  /// By address: place in there_, and the cut, without which another list could have the address.
  std::unordered_map<const std::uint32_t*, std::pair<std::size_t, std::shared_ptr<const LodCut>>> kept_;
  std::vector<std::uint32_t> new_;
  std::size_t used_ = 0;  ///< Numbers in there_ that belong to lists.
  Buffer<std::uint32_t, B> there_;
};

}  // namespace gsnav
