// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/core/host_threads.hpp"
#include "gsnav/detail/sim/batch_scenes.hpp"
#include "gsnav/detail/sim/batch_world.hpp"
#include "gsnav/detail/sim/scene_library.hpp"
#include "gsnav/detail/sim/team.hpp"
#include "gsnav/sim/basic_simulator.hpp"
#include "gsnav/sim/config.hpp"

namespace gsnav {

/// Batch of navigation environments that share scenes, on a backend of your choice. BatchSimulator is
/// the same for a Device chosen at run time.
///
/// @code
/// auto sim = make_batch_simulator(backend, scenes, config, 256, episode_of).value();
/// auto out = sim.reset().value();
/// while (running) out = sim.step(policy(out)).value();
/// @endcode
///
/// One call steps all environments. Environment e returns the same bits as a BasicSimulator with seed +
/// e. Each scene is held in memory once. Environments that are in the same scene at the same time share
/// its capsules and skinned Gaussians. The backend must outlive the simulator. After an error, call
/// reset(). A moved-from batch has no environments and returns invalid_argument. Not thread-safe.
template <Backend B>
class BasicBatchSimulator {
 public:
  /// Creates a batch over scenes in memory.
  /// @param backend Backend that renders. It must outlive the batch.
  /// @param scenes Scenes that episodes refer to by index.
  /// @param config Settings for all environments.
  /// @param environments Number of environments.
  /// @param next_episode Called for each new episode of each environment. See EpisodeSource.
  /// @return invalid_argument, with the field, sensor or scene at fault; unsupported, with the sensor,
  /// if its images cannot stay where BatchConfig::images asks for them.
  static Result<BasicBatchSimulator> create(B& backend,
                                            std::vector<std::shared_ptr<const SimulatorScene>> scenes,
                                            BatchConfig config, std::size_t environments,
                                            EpisodeSource next_episode) {
    for (const auto& scene : scenes) {
      if (scene == nullptr) return {Errc::invalid_argument, "BatchSimulator: a scene is null"};
      if (Status s = validate(*scene, config); !s) return s;
    }
    const std::size_t count = scenes.size();
    return create(
        backend, [held = std::move(scenes)](std::size_t i) -> Result<ScenePointer> { return held[i]; },
        {}, count, std::move(config), environments, std::move(next_episode));
  }
  /// Creates a batch over scenes that are loaded in the background and freed when no environment uses
  /// them. `next_episode` is called one episode ahead, when the previous episode of an environment
  /// begins, so that its scene can be loaded meanwhile. Errors of loading are returned by the reset() or
  /// step() that needs the scene.
  /// @return the errors of create(); invalid_argument if `library` is null.
  static Result<BasicBatchSimulator> create_from_library(B& backend,
                                                         std::shared_ptr<SceneLibrary> library,
                                                         BatchConfig config, std::size_t environments,
                                                         EpisodeSource next_episode) {
    if (library == nullptr)
      return {Errc::invalid_argument, "BatchSimulator: the library of scenes is null"};
    return create(
        backend, [library](std::size_t i) { return library->get(i); },
        [library](std::size_t i) { library->prefetch(i); }, library->size(), std::move(config),
        environments, std::move(next_episode));
  }

  /// Number of environments, N.
  std::size_t environments() const noexcept { return worlds_.size(); }
  /// World of one environment: agent, task and clock.
  /// @pre environment < environments(), and a reset() has succeeded.
  const World& world(std::size_t environment) const noexcept { return worlds_.world(environment); }
  /// Index of the scene that an environment is in. @pre as for world().
  std::size_t scene_of(std::size_t environment) const noexcept { return worlds_.scene_of(environment); }

  /// Begins the next episode in every environment.
  /// @param mask Shape [N]. If given, only environments with a nonzero value are reset.
  /// @param meanwhile See WhileDrawing.
  /// @return the errors of the episode source, of World::reset, of rendering, or of `meanwhile`.
  Result<BatchStep> reset(std::span<const std::uint8_t> mask = {},
                          const WhileDrawing& meanwhile = {}) & {
    if (environments() == 0) return moved_away();
    if (Status s = ask_for_memory(); !s) return s;
    if (Status s = worlds_.reset(parallel(), mask); !s) return s;
    free_scenes();
    return observe(mask.empty(), meanwhile);
  }

  /// Performs one action per environment.
  /// @param actions Shape [N].
  /// @param meanwhile See WhileDrawing.
  /// @return invalid_argument for a wrong number of actions, before reset(), or, with
  /// AutoReset::disabled, for an environment that is done (the message names it); the errors of
  /// World::step, of rendering and of `meanwhile`.
  Result<BatchStep> step(std::span<const Action> actions, const WhileDrawing& meanwhile = {}) & {
    return act(actions, meanwhile);
  }
  /// Drives each environment by a velocity for one control period. See BasicSimulator::step.
  /// @param commands Shape [N].
  /// @param meanwhile See WhileDrawing.
  Result<BatchStep> step(std::span<const VelocityCommand> commands,
                         const WhileDrawing& meanwhile = {}) & {
    return act(commands, meanwhile);
  }

  /// Number of images rendered so far. Sensors with the same position and field of view share one.
  std::size_t render_count() const noexcept { return rig_.render_count(); }
  /// Number of times that an avatar was skinned so far.
  std::size_t pose_count() const noexcept { return scenes_.pose_count(); }
  /// Turns rendering on or off, from the next call on.
  void set_rendering(bool on) noexcept { config_.rendering = on; }

 private:
  using ScenePointer = std::shared_ptr<const SimulatorScene>;
  using SceneOf = typename BatchScenes<B>::SceneOf;

  static Result<BasicBatchSimulator> create(B& backend, SceneOf scene_of,
                                            std::function<void(std::size_t)> prefetch,
                                            std::size_t scenes, BatchConfig config,
                                            std::size_t environments, EpisodeSource next_episode) {
    if (Status s = validate(static_cast<const SimulatorConfig&>(config)); !s) return s;
    if (config.images > ImageMemory::backend) {
      return {Errc::invalid_argument,
              "BatchConfig.images = " + std::to_string(static_cast<int>(config.images)) +
                  ": not a value of the enum"};
    }
    if (config.auto_reset > AutoReset::disabled) {
      return {Errc::invalid_argument,
              "BatchConfig.auto_reset = " + std::to_string(static_cast<int>(config.auto_reset)) +
                  ": not a value of the enum"};
    }
    if (config.pose_slots < 1)
      return {Errc::invalid_argument, "BatchConfig.pose_slots = 0: must be >= 1"};
    if (Status s = SensorRig<B>::check_memory(config.sensors, config.images); !s) return s;
    BatchPlaces places;
    places.count = scenes;
    places.get = [scene_of](std::size_t i) -> Result<BatchScene> {
      auto scene = scene_of(i);
      if (!scene) return scene.status();
      if ((*scene)->avatars.empty()) return BatchScene{(*scene)->navmesh, {}, {}};
      return BatchScene{
          (*scene)->navmesh,
          [held = *scene](double t0, double t1, auto& out) { append_bodies(*held, t0, t1, out); },
          [held = *scene](double t0, double t1, const CapsuleSet* before, auto& out) {
            append_bodies(*held, t0, t1, out, before);
          }};
    };
    const bool scenes_leave = prefetch != nullptr;
    places.prefetch = std::move(prefetch);
    auto worlds = BatchWorld::create(std::move(places), config.task, config.auto_reset, environments,
                                     std::move(next_episode));
    if (!worlds) return worlds.status();
    // Scenes of a library can be checked only after they are loaded.
    SceneOf checked = [scene_of, config](std::size_t i) -> Result<ScenePointer> {
      auto scene = scene_of(i);
      if (!scene) return scene;
      if (Status s = validate(**scene, config); !s) return s;
      return scene;
    };
    return BasicBatchSimulator(backend, std::move(*worlds), std::move(config), std::move(checked),
                               scenes, scenes_leave);
  }

  BasicBatchSimulator(B& backend, BatchWorld worlds, BatchConfig config, SceneOf scene_of,
                      std::size_t scenes, bool scenes_leave)
      : backend_(&backend),
        worlds_(std::move(worlds)),
        config_(std::move(config)),
        rig_(backend, config_.sensors),
        scenes_leave_(scenes_leave),
        scenes_(backend, std::move(scene_of), scenes, config_.render, detail_choice(config_),
                config_.pose_slots),
        in_use_(scenes) {
    for (const SensorSpec& s : config_.sensors) {
      images_.push_back({s.uuid, s.kind, 0, s.resolution[0], s.resolution[1], channels_of(s.kind), {}});
    }
    final_images_ = images_;
    buffers_.memory = final_buffers_.memory = config_.images;
    if constexpr (!is_host_backend<B> && !HasHostThreads<B>)
      pool_ = std::make_unique<ThreadPool>(threads_of_machine());
  }

  static Status moved_away() {
    return {Errc::invalid_argument,
            "this BatchSimulator was moved from: use the object that it was moved to"};
  }
  /// Frees the scenes that no environment uses.
  void free_scenes() {
    if (!scenes_leave_) return;
    std::fill(in_use_.begin(), in_use_.end(), std::uint8_t{0});
    for (std::size_t e = 0; e < environments(); ++e) in_use_[worlds_.scene_of(e)] = 1;
    scenes_.keep(in_use_);
  }

  auto parallel() noexcept {
    return [this](std::size_t n, const auto& f) {
      if constexpr (is_host_backend<B> || HasHostThreads<B>) {
        for_each_on_host(*backend_, n, f);
      } else {
        for_each_in(*pool_, n, f);
      }
    };
  }

  template <class A>
  Result<BatchStep> act(std::span<const A> actions, const WhileDrawing& meanwhile) {
    if (environments() == 0) return moved_away();
    if (Status s = ask_for_memory(); !s) return s;
    const auto draw_final = [this] { return observe_finished(); };
    if (Status s = worlds_.step(parallel(), actions, draw_final); !s) return s;
    free_scenes();
    return observe(false, meanwhile);
  }

  /// Asks BatchConfig::image_source for memory for the next images.
  Status ask_for_memory() {
    if (!config_.image_source || !config_.rendering) return {};
    return buffers_.ask(rig_.plan(), environments(), config_.image_source);
  }

  Result<BatchStep> observe(bool all, const WhileDrawing& meanwhile) {
    BatchStep out;
    static_cast<BatchInfo&>(out) = worlds_.info();
    Status told;
    bool untold = bool(meanwhile), prepared = is_host_backend<B>;
    const auto tell = [&] {
      if (std::exchange(untold, false)) told = detail::guarded([&] { return meanwhile(out); });
    };
    const auto while_drawing = [&] {
      tell();
      if (!std::exchange(prepared, true)) worlds_.prepare_step(parallel());
    };
    if (!config_.rendering || images_.empty()) {
      drawn_ = false;
      tell();
      if (!told) return told;
      return out;
    }
    rig_.resize(buffers_, environments());
    fill(images_, buffers_);
    out.images = images_;
    if (worlds_.auto_reset() == AutoReset::same_step && !worlds_.info().finished.empty())
      out.final_images = final_images_;
    views_.clear();
    // Environments that have not moved need an image too if the last call did not render, or drew
    // into memory of the caller.
    const bool every = all || config_.image_source || !std::exchange(drawn_, false);
    for (std::size_t e = 0; e < environments(); ++e) {
      if (every || worlds_.moved(e)) add_view(e, e);
    }
    if (Status s = draw(buffers_, std::ref(while_drawing)); !s) return s;
    drawn_ = true;
    tell();
    if (!told) return told;
    return out;
  }

  /// Renders the last images of the episodes that ended, before their environments are reset.
  Status observe_finished() {
    if (!config_.rendering || images_.empty()) return {};
    const std::span<const std::size_t> finished = worlds_.info().finished;
    rig_.resize(final_buffers_, finished.size());
    views_.clear();
    for (std::size_t i = 0; i < finished.size(); ++i) add_view(finished[i], i);
    if (Status s = draw(final_buffers_); !s) return s;
    fill(final_images_, final_buffers_);
    return {};
  }

  void fill(std::vector<BatchObservation>& images, const SensorImages<B>& buffers) const {
    for (std::size_t i = 0; i < images.size(); ++i) {
      images[i].environments = buffers.rows;
      images[i].data = buffers.all(rig_.plan(), i);
      images[i].on_backend = buffers.all_on_backend(rig_.plan(), i);
    }
  }

  /// Adds the view of environment e. Its images go to row `row`.
  void add_view(std::size_t e, std::size_t row) {
    const AgentPose& agent = world(e).agent();
    SceneView& v = views_.emplace_back();
    v.scene = worlds_.scene_of(e);
    v.time = world(e).time();
    v.view.base = agent.position;
    v.view.rotation = agent.rotation();
    v.view.pitch = agent.pitch;
    v.view.noise = noise_seed(config_.seed + e, world(e).state());
    v.view.row = row;
  }
  Status draw(SensorImages<B>& images, const std::function<void()>& idle = {}) {
    return scenes_.draw(views_, rig_.plan(), parallel(), [&](std::span<const SensorView> views) {
      return rig_.render(views, images, idle);
    });
  }

  B* backend_;
  BatchWorld worlds_;
  BatchConfig config_;
  SensorRig<B> rig_;
  bool scenes_leave_;
  BatchScenes<B> scenes_;
  std::vector<std::uint8_t> in_use_;  // For each scene: 1 if an environment is in it.
  bool drawn_ = false;                // True if buffers_ holds an image of every environment as of the
                                      // last call.
  SensorImages<B> buffers_, final_buffers_;
  std::unique_ptr<ThreadPool> pool_;  // Steps the worlds if the backend has no threads on the host.
  std::vector<BatchObservation> images_, final_images_;
  std::vector<SceneView> views_;
};

/// Calls BasicBatchSimulator<B>::create.
template <Backend B>
Result<BasicBatchSimulator<B>> make_batch_simulator(
    B& backend, std::vector<std::shared_ptr<const SimulatorScene>> scenes, BatchConfig config,
    std::size_t environments, EpisodeSource next_episode) {
  return BasicBatchSimulator<B>::create(backend, std::move(scenes), std::move(config), environments,
                                        std::move(next_episode));
}

}  // namespace gsnav
