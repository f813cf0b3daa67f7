// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/sim/body_cache.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// Treatment of an environment whose episode has ended. Equivalent to Gymnasium's AutoresetMode.
enum class AutoReset : std::uint8_t {
  next_step,  ///< The next step ignores its action and begins an episode. Its reward is 0, and it is
              ///< neither terminated nor truncated.
  same_step,  ///< The step that ends an episode begins the next one. BatchInfo has the metrics of the
              ///< finished one.
  disabled,   ///< The environment waits for reset(mask).
};

/// An episode and the scene in which it takes place.
struct BatchEpisode {
  std::size_t scene = 0;    ///< Index of the scene.
  PointNavEpisode episode;  ///< The episode.
};

/// Function that returns episode number `count` (from 0) of an environment. It is called from one
/// thread, in the order of environments.
using EpisodeSource = std::function<Result<BatchEpisode>(std::size_t environment, std::size_t count)>;

/// Results of one step for all environments. Spans have shape [N] unless stated otherwise and are valid
/// until the next call.
struct BatchInfo {
  std::span<const double> rewards;           ///< Reward of the action.
  std::span<const std::uint8_t> terminated;  ///< 1 if `stop` ended the episode.
  std::span<const std::uint8_t> truncated;   ///< 1 if the episode reached its limit of actions.
  std::span<const StepInfo> infos;  ///< Outcome of the action. With AutoReset::same_step, this includes
                                    ///< the last action of a finished episode.
  std::span<const PointGoal> point_goals;  ///< Goal as observed now. In a new episode, its own goal.
  std::span<const double> times;           ///< Time on the clock of the environment's scene, seconds.
  std::span<const std::size_t> finished;   ///< Environments whose episode ended in this step, in
                                           ///< increasing order.
  std::span<const EpisodeMetrics> final_metrics;  ///< Metrics of those episodes, one per entry of
                                                  ///< `finished`.
  std::span<const PointGoal> final_point_goals;   ///< Goal as observed at the end of those episodes, one
                                                  ///< per entry of `finished`.
};

/// Scene of a BatchWorld: NavMesh and bodies, without anything to render.
struct BatchScene {
  /// Like World::BodySource, but also receives the bodies of the interval that ended at t0, or null. It
  /// then need not pose avatars for t0 again.
  using BodySourceAfter = std::function<void(double t0, double t1, const CapsuleSet* before,
                                             std::vector<DynamicCapsule>& out)>;

  std::shared_ptr<const NavMesh> navmesh;  ///< Surface that agents walk on.
  World::BodySource bodies;                ///< Moving bodies.
  BodySourceAfter bodies_after{};  ///< If set, replaces `bodies` during steps. It must append the
                                   ///< capsules that `bodies` appends.
};

/// Source of scenes, by index. A scene is fetched when an episode begins in it and released when no
/// environment uses it.
struct BatchPlaces {
  std::size_t count = 0;                                     ///< Number of scenes.
  std::function<Result<BatchScene>(std::size_t scene)> get;  ///< Returns a scene.
  /// Called for a scene that will be needed soon. If set, the next episode of an environment is
  /// requested one episode ahead.
  std::function<void(std::size_t scene)> prefetch;
};

/// Worlds that step together. Worlds in the same scene and interval share the bodies of that interval,
/// which are computed once and cached. Each world returns the same bits as a World of its own, for any
/// number of threads.
class BatchWorld {
 public:
  /// Function that calls f(i) for each i in [0, n), in any order, on any threads.
  using ParallelFor = std::function<void(std::size_t n, const std::function<void(std::size_t)>& f)>;

  /// Creates the worlds.
  /// @return invalid_argument for a setting out of range, or if there are no scenes, environments or
  /// source of episodes.
  static Result<BatchWorld> create(std::vector<BatchScene> scenes, const TaskConfig& config,
                                   AutoReset auto_reset, std::size_t environments,
                                   EpisodeSource next_episode);
  /// Creates worlds over scenes that are fetched when needed. Same errors.
  static Result<BatchWorld> create(BatchPlaces places, const TaskConfig& config, AutoReset auto_reset,
                                   std::size_t environments, EpisodeSource next_episode);

  /// Number of environments.
  std::size_t size() const noexcept { return environments_.size(); }
  /// When finished environments begin their next episode.
  AutoReset auto_reset() const noexcept { return auto_reset_; }
  /// World of environment e.
  const World& world(std::size_t e) const noexcept { return *environments_[e].world; }
  /// Index of the scene that environment e is in.
  std::size_t scene_of(std::size_t e) const noexcept { return environments_[e].scene; }
  /// True if the last call stepped or reset environment e.
  bool moved(std::size_t e) const noexcept { return environments_[e].moved; }
  /// Results of the last call.
  const BatchInfo& info() const noexcept { return info_; }

  /// Begins the next episode in all environments, or in those where mask[e] is not 0.
  /// @return errors of the episode source or of World::reset, with the environment; invalid_argument for
  /// a mask of the wrong size or a mask before the first reset.
  Status reset(const ParallelFor& run, std::span<const std::uint8_t> mask = {});
  /// Performs one action per environment.
  /// @param run Runs the environments in parallel.
  /// @param actions One action per environment.
  /// @param before_reset With AutoReset::same_step, called when episodes have ended. info().finished is
  /// then set and the worlds still show the end of their episodes.
  /// @return invalid_argument, or errors of World::step or of the callback, with the environment.
  Status step(const ParallelFor& run, std::span<const Action> actions,
              const std::function<Status()>& before_reset = {});
  /// Drives each environment by a velocity for one control period. Same parameters and errors.
  Status step(const ParallelFor& run, std::span<const VelocityCommand> commands,
              const std::function<Status()>& before_reset = {});
  /// Makes the bodies of the next step of all episodes that go on, so that step() finds them. Call it
  /// while the host would wait, such as for images. Results do not change. Errors are left to step().
  void prepare_step(const ParallelFor& run);

 private:
  friend struct BatchWorldCache;  // Tests read and limit the number of cached intervals.
  struct Environment {
    std::optional<World> world;
    std::size_t scene = 0, episodes = 0;
    World::BodySource source;
    BatchScene::BodySourceAfter source_after;
    BodyCache::Key last;                       // Interval of the last substep.
    std::optional<Result<BatchEpisode>> next;  // Next episode if it was requested ahead.
    std::vector<const CapsuleSet*> bodies;     // Shape [substeps].
    Status status;
    bool moved = false;
  };
  BatchWorld() = default;
  template <class A>
  Status act(const ParallelFor& run, std::span<const A> actions,
             const std::function<Status()>& before_reset);
  Status begin(const ParallelFor& run, std::span<const std::size_t> which);
  Status make_bodies(const ParallelFor& run, std::span<const std::size_t> which);
  Status list_and_make_bodies(const ParallelFor& run, std::span<const std::size_t> which);
  Status first_error(std::span<const std::size_t> which) const;
  void note_observation(std::size_t e);
  void publish();

  BatchPlaces places_;
  TaskConfig config_;
  AutoReset auto_reset_ = AutoReset::next_step;
  EpisodeSource next_episode_;
  std::vector<Environment> environments_;
  bool begun_ = false;
  std::size_t most_bodies_ = 2048;  // Largest number of intervals that stay cached after a step.
  bool prepared_ = false;           // True if prepare_step() has made the bodies of the next step.

  BodyCache bodies_;
  struct Missing {
    BodyCache::Key key;
    BodyCache::Entry* entry;
    const Environment* environment;
    const CapsuleSet* before;
  };
  std::vector<Missing> missing_;
  std::vector<Status> made_;
  std::vector<CapsuleSet> removed_;
  std::vector<std::size_t> stepping_, resetting_, finished_;
  std::vector<BatchEpisode> episodes_;
  std::vector<EpisodeMetrics> final_metrics_;
  std::vector<PointGoal> final_point_goals_;
  std::vector<double> rewards_, times_;
  std::vector<std::uint8_t> terminated_, truncated_;
  std::vector<StepInfo> infos_;
  std::vector<PointGoal> point_goals_;
  BatchInfo info_;
};

}  // namespace gsnav
