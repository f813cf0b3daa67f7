// SPDX-License-Identifier: Apache-2.0
#pragma once

// BasicSimulator. Programs that draw a simulator's scene by themselves find SceneOnBackend and CutSets
// here, too (detail/sim/scene_on_backend.hpp and scene_levels.hpp).

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "gsnav/detail/sim/scene_levels.hpp"
#include "gsnav/detail/sim/scene_on_backend.hpp"
#include "gsnav/detail/sim/sensor_rig.hpp"
#include "gsnav/sim/config.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// Seed of the sensor noise of one observation. It depends on the seed, the episode and the number of
/// actions so far.
std::uint64_t noise_seed(std::uint64_t seed, const WorldState& state) noexcept;

/// Orientation of the camera for an ImageNav goal: a turn about +Y by an angle derived from the
/// episode's id. Each episode therefore has one goal image.
Quatd goal_rotation(const PointNavEpisode& episode) noexcept;

/// Navigation simulator for one agent, on a backend of your choice: a scene, moving avatars, sensors and
/// a PointNav task. Simulator is the same for a Device chosen at run time.
///
/// @code
/// auto sim = make_simulator(backend, scene, config).value();
/// auto obs = sim.reset(episode).value();
/// while (!sim.done()) obs = sim.step(policy(obs)).value();
/// auto metrics = sim.metrics();
/// @endcode
///
/// The agent and all avatars move together during one control period. Avatars are skinned only when a
/// sensor renders. The same sequence of calls returns the same bits if the floating-point rounding mode
/// is round-to-nearest (the default). Flush-to-zero does not change them. The backend must outlive the
/// simulator. A moved-from simulator returns invalid_argument from every call that can fail; do not call
/// world().navmesh() or avatars() on it. Not thread-safe; use one simulator per thread.
template <Backend B>
class BasicSimulator {
 public:
  /// Creates a simulator that owns its scene.
  /// @return invalid_argument, with the field, sensor or asset at fault.
  static Result<BasicSimulator> create(B& backend, SimulatorScene scene, SimulatorConfig config) {
    return create(backend, std::make_shared<const SimulatorScene>(std::move(scene)), std::move(config));
  }
  /// Creates a simulator that shares a scene with others.
  /// @param backend Backend that renders. It must outlive the simulator.
  /// @param scene Scene to simulate.
  /// @param config Settings.
  /// @param others Adds bodies to the scene's avatars. They are numbered after the avatars.
  /// @return invalid_argument, with the field, sensor or asset at fault.
  static Result<BasicSimulator> create(B& backend, std::shared_ptr<const SimulatorScene> scene,
                                       SimulatorConfig config, World::BodySource others = {}) {
    if (scene == nullptr) return {Errc::invalid_argument, "SimulatorScene is null"};
    if (Status s = validate(config); !s) return s;
    if (Status s = validate(*scene, config); !s) return s;
    Result<World> world =
        World::create(scene->navmesh, config.task, [scene, others](double t0, double t1, auto& out) {
          append_bodies(*scene, t0, t1, out);
          if (others) others(t0, t1, out);
        });
    if (!world) return world.status();
    return BasicSimulator(backend, std::move(*world), std::move(config), std::move(scene));
  }

  /// Starts an episode and renders the first observation.
  /// @return the errors of World::reset, or of rendering.
  Result<Observations> reset(const PointNavEpisode& episode) & {
    if (Status s = world_.reset(episode); !s) return s;
    return observe();
  }

  /// Performs one action for one control period and renders. Action::stop ends the episode.
  /// @return the errors of World::step, or of rendering.
  Result<Observations> step(Action action) & {
    if (Result<StepInfo> r = world_.step(action); !r) return r.status();
    return observe();
  }
  /// Moves at a commanded velocity for one control period and renders.
  /// @return the errors of World::step, or of rendering.
  Result<Observations> step(const VelocityCommand& command) & {
    if (Result<StepInfo> r = world_.step(command); !r) return r.status();
    return observe();
  }

  /// Renders the current observation without acting.
  /// @return an error of rendering.
  Result<Observations> observe() & {
    if (Status s = alive(); !s) return s;
    Observations obs;
    static_cast<StepInfo&>(obs) = world_.last_step();
    obs.point_goal = world_.point_goal();
    obs.time = world_.time();
    if (!config_.rendering || images_.empty()) return obs;
    if (Status s = scene_.pose(0, world_.time()); !s) return s;
    const AgentPose& agent = world_.agent();
    const SensorView view{
        agent.position,  agent.rotation(), agent.pitch, noise_seed(config_.seed, world_.state()),
        scene_.sets(0),  &config_.render,  0,           scene_.meshes(),
        scene_.levels(), scene_.bodies(0)};
    rig_.resize(buffers_, 1);
    if (Status s = rig_.render(std::span(&view, 1), buffers_); !s) return s;
    for (std::size_t i = 0; i < images_.size(); ++i) images_[i].data = buffers_.image(rig_.plan(), i, 0);
    obs.images = images_;
    return obs;
  }

  /// True if the episode has ended.
  bool done() const noexcept { return world_.done(); }
  /// Metrics as if the episode ended now. They are final once done().
  EpisodeMetrics metrics() const { return world_.metrics(); }
  /// Current time on the scene's clock, seconds.
  double clock() const noexcept { return world_.time(); }
  /// Current pose of the agent.
  const AgentPose& agent() const noexcept { return world_.agent(); }
  /// The agent with its task and clock, without images.
  const World& world() const noexcept { return world_; }
  /// Configuration, with `render` as the simulator resolved it.
  const SimulatorConfig& config() const noexcept { return config_; }
  /// The scene that the simulator runs in.
  const SimulatorScene& scene() const noexcept { return scene_.scene(); }
  /// Avatars of the scene.
  const std::vector<AvatarActor>& avatars() const noexcept { return scene_.scene().avatars; }

  /// Complete state of the episode. Restore it with set_state(); observe() then renders the same images
  /// again.
  const WorldState& state() const noexcept { return world_.state(); }
  /// Restores a state. A state that is rejected changes nothing.
  /// @return the errors of World::set_state.
  Status set_state(const WorldState& state) { return world_.set_state(state); }
  /// Moves the agent to another position. See World::set_agent.
  /// @param position World position, metres.
  /// @param yaw, pitch Radians.
  /// @return the errors of World::set_agent.
  Status set_agent(const Vec3d& position, double yaw, double pitch = 0.0) {
    return world_.set_agent(position, yaw, pitch);
  }
  /// Sets the seed of the sensor noise for all later observations.
  void set_seed(std::uint64_t seed) noexcept { config_.seed = seed; }

  /// Turns rendering on or off, from the next action on.
  void set_rendering(bool on) noexcept { config_.rendering = on; }
  /// Number of images rendered so far. Sensors with the same position and field of view share one.
  std::size_t render_count() const noexcept { return rig_.render_count() + spectator_count_; }

  /// Renders the scene at the current time from any camera, for a map or a spectator view. The images
  /// are valid until the next call.
  /// @param camera Camera in world coordinates.
  /// @param outputs Bitmask of kRgb, kAlpha, ...
  /// @return the errors of BasicRenderer::render.
  Result<const Frames<float>*> render(const Camera& camera, unsigned outputs = kRgb) & {
    if (Status s = alive(); !s) return s;
    if (Status s = scene_.pose(0, world_.time()); !s) return s;
    RenderConfig config = config_.render;
    config.outputs = outputs;
    ++spectator_count_;
    const ImageRequest request{
        {scene_.sets(0), &camera, &config, {}, scene_.meshes()}, scene_.levels(), scene_.bodies(0)};
    if (Status s = rig_.renderer().render(request, spectator_); !s) return s;
    return &spectator_;
  }

  /// Renders the goal images of an ImageNav task: the view of an agent at the goal, turned by
  /// goal_rotation(), without avatars.
  /// @return images in the order of the sensors, valid until the next call; invalid_argument before
  /// reset(), or an error of rendering.
  Result<std::span<const Observation>> goal_images() & {
    if (Status s = alive(); !s) return s;
    const WorldState& s = world_.state();
    if (!s.running) return {Errc::invalid_argument, "goal_images before reset: no episode is running"};
    const SensorView view{s.goal.position,
                          goal_rotation(s.episode),
                          0.0,
                          noise_seed(config_.seed, s),
                          scene_.assets(),
                          &config_.render,
                          0,
                          scene_.meshes(),
                          scene_.levels(),
                          {}};
    rig_.resize(goal_buffers_, 1);
    if (Status e = rig_.render(std::span(&view, 1), goal_buffers_); !e) return e;
    goal_images_ = images_;
    for (std::size_t i = 0; i < images_.size(); ++i)
      goal_images_[i].data = goal_buffers_.image(rig_.plan(), i, 0);
    return std::span<const Observation>(goal_images_);
  }

 private:
  Status alive() const {
    return world_.moved_from()
               ? Status(Errc::invalid_argument,
                        "this Simulator was moved from: use the object that it was moved to")
               : Status();
  }

  BasicSimulator(B& backend, World world, SimulatorConfig config,
                 std::shared_ptr<const SimulatorScene> scene)
      : world_(std::move(world)),
        config_(std::move(config)),
        scene_(backend, std::move(scene), detail_choice(config_)),
        rig_(backend, config_.sensors) {
    config_.render = scene_.render_config(config_.render);
    for (const SensorSpec& s : config_.sensors) {
      images_.push_back({s.uuid, s.kind, s.resolution[0], s.resolution[1], channels_of(s.kind), {}});
    }
  }

  World world_;
  SimulatorConfig config_;
  SceneOnBackend<B> scene_;
  SensorRig<B> rig_;
  SensorImages<B> buffers_, goal_buffers_;
  std::vector<Observation> images_, goal_images_;
  Frames<float> spectator_;
  std::size_t spectator_count_ = 0;
};

/// Calls BasicSimulator<B>::create.
template <Backend B>
Result<BasicSimulator<B>> make_simulator(B& backend, SimulatorScene scene, SimulatorConfig config) {
  return BasicSimulator<B>::create(backend, std::move(scene), std::move(config));
}

}  // namespace gsnav
