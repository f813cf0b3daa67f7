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

/// What happens to an environment whose episode has ended: Gymnasium's AutoresetMode.
enum class AutoReset : std::uint8_t {
  next_step,  ///< the next step ignores its action and begins an episode: reward 0, neither terminated
              ///< nor truncated
  same_step,  ///< an episode begins in the step that ended one; BatchInfo::finished has the last metrics
  disabled,   ///< it waits for reset(mask)
};

/// An episode and the number of the scene that it takes place in.
struct BatchEpisode {
  std::size_t scene = 0;    ///< Number of the scene.
  PointNavEpisode episode;  ///< The episode.
};

/// Gives environment `environment` its `count`-th episode, from 0. Called by one thread, in order of
/// environments.
using EpisodeSource = std::function<Result<BatchEpisode>(std::size_t environment, std::size_t count)>;

/// What one step did in all environments, [N] each. Valid until the next call.
struct BatchInfo {
  std::span<const double> rewards;           ///< Reward of each environment.
  std::span<const std::uint8_t> terminated;  ///< stop ended the episode
  std::span<const std::uint8_t> truncated;   ///< it was cut off
  std::span<const StepInfo>
      infos;  ///< of the action; with AutoReset::same_step also where it was the last
  std::span<const PointGoal> point_goals;  ///< as now observed, so of a new episode where one has begun
  std::span<const double> times;           ///< seconds on the scenes' clocks
  std::span<const std::size_t> finished;   ///< environments whose episode ended in this step, rising
  std::span<const EpisodeMetrics> final_metrics;  ///< of each of `finished`
};

/// A scene without pictures, shared by environments.
struct BatchScene {
  /// World::BodySource that is given what an interval that ended at t0 had, or null: nobody need be
  /// posed for t0 again.
  using BodySourceAfter = std::function<void(double t0, double t1, const CapsuleSet* before,
                                             std::vector<DynamicCapsule>& out)>;

  std::shared_ptr<const NavMesh> navmesh;  ///< The walkable surface.
  World::BodySource bodies;                ///< Moving bodies of the scene.
  BodySourceAfter
      bodies_after{};  ///< where it is set, used in place of `bodies` during steps, and the same
};

/// Scenes by number, fetched when an episode begins in them and let go when no environment is in them.
struct BatchPlaces {
  std::size_t count = 0;                                     ///< Number of scenes.
  std::function<Result<BatchScene>(std::size_t scene)> get;  ///< Returns scene number `scene`.
  /// Called for scenes that will be needed; where it is set, the source of episodes is asked for each
  /// environment's next episode already when one begins.
  std::function<void(std::size_t scene)> prefetch;
};

/// Worlds that step together. Those in one scene over one interval share the bodies of that interval,
/// which are made once and kept for a while; all else is what each World does, bit for bit, for any
/// number of threads.
class BatchWorld {
 public:
  /// Runs f(i) for i in [0, n), in any order and by any threads.
  using ParallelFor = std::function<void(std::size_t n, const std::function<void(std::size_t)>& f)>;

  /// Errors: invalid_argument (a setting; no scene; no environment; no source).
  static Result<BatchWorld> create(std::vector<BatchScene> scenes, const TaskConfig& config,
                                   AutoReset auto_reset, std::size_t environments,
                                   EpisodeSource next_episode);
  static Result<BatchWorld> create(BatchPlaces places, const TaskConfig& config, AutoReset auto_reset,
                                   std::size_t environments, EpisodeSource next_episode);

  /// Number of environments.
  std::size_t size() const noexcept { return environments_.size(); }
  /// What happens when an episode ends.
  AutoReset auto_reset() const noexcept { return auto_reset_; }
  /// The world of environment e.
  const World& world(std::size_t e) const noexcept { return *environments_[e].world; }
  /// Number of the scene that environment e is in.
  std::size_t scene_of(std::size_t e) const noexcept { return environments_[e].scene; }
  /// How many intervals' bodies are held for whoever comes by there later; at most `most` after each
  /// step.
  std::size_t held_bodies() const noexcept { return bodies_.size(); }
  /// Sets the largest number of intervals that are kept.
  void keep_bodies(std::size_t most) noexcept { most_bodies_ = most; }
  /// Whether the last call stepped or reset environment e.
  bool moved(std::size_t e) const noexcept { return environments_[e].moved; }
  /// Results of the last call.
  const BatchInfo& info() const noexcept { return info_; }

  /// Begins the next episode everywhere or where mask[e] is not 0. Errors name the environment: what the
  /// source and World::reset report; invalid_argument (a mask of another size, or one before the first
  /// reset).
  Status reset(const ParallelFor& run, std::span<const std::uint8_t> mask = {});
  /// One action for each. With same_step, `before_reset` is called where episodes ended, when
  /// info().finished is known and their worlds are still as they ended. Errors name the environment:
  /// invalid_argument; what World::step reports; what the callback does.
  Status step(const ParallelFor& run, std::span<const Action> actions,
              const std::function<Status()>& before_reset = {});
  Status step(const ParallelFor& run, std::span<const VelocityCommand> commands,
              const std::function<Status()>& before_reset = {});

 private:
  struct Environment {
    std::optional<World> world;
    std::size_t scene = 0, episodes = 0;
    World::BodySource source;
    BatchScene::BodySourceAfter source_after;
    BodyCache::Key last;                       // the interval of the last substep
    std::optional<Result<BatchEpisode>> next;  // where it was asked for already
    std::vector<const CapsuleSet*> bodies;     // [substeps]
    Status status;
    bool moved = false;
  };
  BatchWorld() = default;
  template <class A>
  Status act(const ParallelFor& run, std::span<const A> actions,
             const std::function<Status()>& before_reset);
  Status begin(const ParallelFor& run, std::span<const std::size_t> which);
  Status make_bodies(const ParallelFor& run, std::span<const std::size_t> which);
  Status first_error(std::span<const std::size_t> which) const;
  void note_observation(std::size_t e);
  void publish();

  BatchPlaces places_;
  TaskConfig config_;
  AutoReset auto_reset_ = AutoReset::next_step;
  EpisodeSource next_episode_;
  std::vector<Environment> environments_;
  bool begun_ = false;
  std::size_t most_bodies_ = 2048;

  BodyCache bodies_;
  struct Missing {
    BodyCache::Key key;
    BodyCache::Entry* entry;
    const Environment* environment;
    const CapsuleSet* before;
  };
  std::vector<Missing> missing_;
  std::vector<Status> made_;
  std::vector<std::size_t> stepping_, resetting_, finished_;
  std::vector<BatchEpisode> episodes_;
  std::vector<EpisodeMetrics> final_metrics_;
  std::vector<double> rewards_, times_;
  std::vector<std::uint8_t> terminated_, truncated_;
  std::vector<StepInfo> infos_;
  std::vector<PointGoal> point_goals_;
  BatchInfo info_;
};

}  // namespace gsnav
