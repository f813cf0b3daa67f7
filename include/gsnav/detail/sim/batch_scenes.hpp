// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/sim/scene_on_backend.hpp"
#include "gsnav/detail/sim/sensor_requests.hpp"

namespace gsnav {

/// View into one scene of a batch at one time. BatchScenes fills in the members of `view` that depend on
/// the scene.
struct SceneView {
  std::size_t scene = 0;  ///< Index of the scene.
  double time = 0.0;      ///< Time on the scene's clock, seconds.
  SensorView view{};      ///< Position and orientation of the sensors, and row of the output.
};

/// Scenes of a batch in the memory of a backend, with avatars posed for the views of a step.
template <Backend B>
class BatchScenes {
 public:
  /// Function that returns the scene with a given index.
  using SceneOf = std::function<Result<std::shared_ptr<const SimulatorScene>>(std::size_t)>;

  /// Creates an empty store. Scenes are fetched when a view first needs them.
  /// @param scene_of Returns a scene. It must be compatible with `render` and `detail`.
  /// @param pose_slots Number of times per scene for which posed avatars are held at once.
  BatchScenes(B& backend, SceneOf scene_of, std::size_t count, const RenderConfig& render,
              const DetailChoice& detail, std::size_t pose_slots)
      : backend_(&backend),
        scene_of_(std::move(scene_of)),
        render_(render),
        detail_(detail),
        pose_slots_(pose_slots),
        scenes_(count),
        configs_(count),
        skinning_(backend) {}

  /// Frees the scenes s with in_use[s] == 0.
  void keep(std::span<const std::uint8_t> in_use) {
    for (std::size_t s = 0; s < scenes_.size(); ++s) {
      if (in_use[s] != 0 || scenes_[s] == nullptr) continue;
      left_poses_ += scenes_[s]->pose_count();
      scenes_[s].reset();
    }
  }
  /// Number of times that an avatar was posed so far.
  std::size_t pose_count() const noexcept {
    std::size_t sum = left_poses_;
    for (const auto& s : scenes_) sum += s != nullptr ? s->pose_count() : 0;
    return sum;
  }

  /// Poses the scenes for `views` and calls draw(span of SensorView), once for as many views as fit the
  /// pose slots of their scenes. Reorders `views`.
  /// @param run run(n, f) calls f(i) for i in [0, n) on several threads.
  /// @return the errors of `scene_of`, of skinning or of `draw`.
  template <class Run, class Draw>
  Status draw(std::span<SceneView> views, const SensorPlan& plan, const Run& run, const Draw& draw) {
    for (const SceneView& v : views) {
      if (Status s = place(v.scene); !s) return s;
    }
    // A scene without avatars looks the same at all times.
    const auto key = [this](const SceneView& v) {
      return std::pair(v.scene, scenes_[v.scene]->scene().avatars.empty() ? 0.0 : v.time);
    };
    order_.clear();
    for (std::size_t i = 0; i < views.size(); ++i) order_.emplace_back(key(views[i]), i);
    std::sort(order_.begin(), order_.end());
    unsorted_.assign(views.begin(), views.end());
    for (std::size_t i = 0; i < views.size(); ++i) views[i] = unsorted_[order_[i].second];
    posed_.clear();
    used_.assign(scenes_.size(), 0);
    for (std::size_t first = 0, last = 0; first < views.size(); first = last) {
      while (last < views.size() && key(views[last]) == key(views[first])) ++last;
      const std::size_t scene = views[first].scene;
      posed_.push_back({views.subspan(first, last - first), used_[scene]++, {}, {}});
      if (last < views.size() && used_[views[last].scene] < pose_slots_) continue;
      if (Status s = pose(plan, run); !s) return s;
      if (Status s = draw(std::span<const SensorView>(ready_)); !s) return s;
      posed_.clear();
      used_.assign(scenes_.size(), 0);
    }
    return {};
  }

 private:
  /// Views with the same scene and time. They share a pose slot.
  struct Posed {
    std::span<SceneView> views;
    std::size_t slot;
    std::vector<Camera> cameras;
    Status status;
  };

  /// Uploads a scene unless it is in the backend's memory already.
  Status place(std::size_t scene) {
    if (scenes_[scene] != nullptr) return {};
    auto held = scene_of_(scene);
    if (!held) return held.status();
    scenes_[scene] = std::make_unique<SceneOnBackend<B>>(*backend_, std::move(*held), detail_);
    configs_[scene] = scenes_[scene]->render_config(render_);
    return {};
  }

  /// Poses the avatars of posed_ and lists its views in ready_. Joints are computed on all threads.
  /// Gaussians of all avatars are skinned by the backend together.
  template <class Run>
  Status pose(const SensorPlan& plan, const Run& run) {
    for (const Posed& p : posed_) scenes_[p.views[0].scene]->make_slots(p.slot + 1);
    run(posed_.size(), [&](std::size_t i) {
      Posed& p = posed_[i];
      p.status = detail::guarded([&] {
        const std::size_t scene = p.views[0].scene;
        for (const SceneView& v : p.views) {
          if (scenes_[scene]->scene().avatars.empty()) break;
          plan.append_cameras(v.view.base, v.view.rotation, v.view.pitch, p.cameras);
        }
        return scenes_[scene]->prepare(p.slot, p.views[0].time, p.cameras, configs_[scene],
                                       plan.any(SensorPlan::kSemantic));
      });
    });
    for (const Posed& p : posed_) {
      if (!p.status) return p.status;
    }
    ready_.clear();
    for (const Posed& p : posed_) {
      const std::size_t number = p.views[0].scene;
      SceneOnBackend<B>& scene = *scenes_[number];
      scene.pose_prepared(p.slot, skinning_);
      for (const SceneView& v : p.views) {
        SensorView& view = ready_.emplace_back(v.view);
        view.sets = scene.sets(p.slot);
        view.config = &configs_[number];
        view.meshes = scene.meshes();
        view.levels = scene.levels();
        view.bodies = scene.bodies(p.slot);
      }
    }
    return skinning_.run();
  }

  B* backend_;
  SceneOf scene_of_;
  RenderConfig render_;
  DetailChoice detail_;
  std::size_t pose_slots_;
  std::vector<std::unique_ptr<SceneOnBackend<B>>> scenes_;  // Null for scenes that no view has needed.
  std::vector<RenderConfig> configs_;                       // One per scene.
  std::size_t left_poses_ = 0;                              // Poses of scenes that were freed.
  SkinningBatch<B> skinning_;
  std::vector<std::pair<std::pair<std::size_t, double>, std::size_t>> order_;  // Keys and places of
                                                                               // views, in order.
  std::vector<SceneView> unsorted_;
  std::vector<Posed> posed_;
  std::vector<std::size_t> used_;  // Number of slots used per scene.
  std::vector<SensorView> ready_;
};

}  // namespace gsnav
