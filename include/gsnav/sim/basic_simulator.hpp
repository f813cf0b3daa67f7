// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "gsnav/detail/sim/scene_on_backend.hpp"
#include "gsnav/detail/sim/sensor_rig.hpp"
#include "gsnav/sim/config.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// What the noise of an observation depends on: the seed, the episode and how many actions it has seen.
std::uint64_t noise_seed(std::uint64_t seed, const WorldState& state) noexcept;

/// Where the camera of an ImageNav goal looks: about +Y by an angle that the episode's id alone decides,
/// so that an episode has one goal image.
Quatd goal_rotation(const PointNavEpisode& episode) noexcept;

/// The simulator over a backend of your choice; Simulator takes a Device. Scene, avatars, agent,
/// sensors and the PointNav task.
///
///     auto sim = make_simulator(backend, scene, config).value();
///     auto obs = sim.reset(episode).value();
///     while (!sim.done()) obs = sim.step(policy(obs)).value();
///     auto metrics = sim.metrics();
///
/// During an action avatars and agent move together over one control period; avatars are skinned only
/// when a sensor looks. The same calls give the same bits, where floating point rounds to nearest as a
/// program starts; flushing denormals to zero changes none. The backend must outlive it. One that was
/// moved from answers whatever can fail with invalid_argument; world().navmesh() and avatars() must not
/// be asked of it.
template <Backend B>
class BasicSimulator {
 public:
  /// Errors: invalid_argument (names the field, sensor or asset).
  static Result<BasicSimulator> create(B& backend, SimulatorScene scene, SimulatorConfig config) {
    return create(backend, std::make_shared<const SimulatorScene>(std::move(scene)), std::move(config));
  }
  /// `others` adds bodies to the scene's avatars, numbered behind them. Errors: as above.
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

  /// Begins an episode. Errors: what World::reset reports; rendering.
  Result<Observations> reset(const PointNavEpisode& episode) {
    if (Status s = world_.reset(episode); !s) return s;
    return observe();
  }

  /// Acts for one control period; Action::stop ends the episode. Errors: what World::step reports;
  /// rendering.
  Result<Observations> step(Action action) {
    if (Result<StepInfo> r = world_.step(action); !r) return r.status();
    return observe();
  }
  Result<Observations> step(const VelocityCommand& command) {
    if (Result<StepInfo> r = world_.step(command); !r) return r.status();
    return observe();
  }

  /// Renders what the agent sees now, without acting. Errors: what rendering reports.
  Result<Observations> observe() {
    if (Status s = alive(); !s) return s;
    Observations obs;
    static_cast<StepInfo&>(obs) = world_.last_step();
    obs.point_goal = world_.point_goal();
    obs.time = world_.time();
    if (!config_.rendering || images_.empty()) return obs;
    if (Status s = scene_.pose(0, world_.time()); !s) return s;
    const AgentPose& agent = world_.agent();
    const SensorView view{
        agent.position, agent.rotation(), agent.pitch, noise_seed(config_.seed, world_.state()),
        scene_.sets(0), &config_.render,  0,           scene_.meshes(),
        scene_.detail()};
    rig_.resize(buffers_, 1);
    if (Status s = rig_.render(std::span(&view, 1), buffers_); !s) return s;
    for (std::size_t i = 0; i < images_.size(); ++i) images_[i].data = buffers_.image(rig_.plan(), i, 0);
    obs.images = images_;
    return obs;
  }

  /// Whether the episode has ended.
  bool done() const noexcept { return world_.done(); }
  /// Metrics of the episode so far.
  EpisodeMetrics metrics() const { return world_.metrics(); }
  /// Seconds on the scene's clock.
  double clock() const noexcept { return world_.time(); }
  /// Where the agent is.
  const AgentPose& agent() const noexcept { return world_.agent(); }
  /// Agent, episode and clock, without sensors.
  const World& world() const noexcept { return world_; }
  /// The settings.
  const SimulatorConfig& config() const noexcept { return config_; }
  /// The scene.
  const SimulatorScene& scene() const noexcept { return scene_.scene(); }
  /// People of the scene.
  const std::vector<AvatarActor>& avatars() const noexcept { return scene_.scene().avatars; }

  /// Everything that changes while it runs, and the way back to it; observe() then sees what was seen
  /// there.
  const WorldState& state() const noexcept { return world_.state(); }
  /// As World::set_state, its errors: nothing is changed by a state that is refused.
  Status set_state(const WorldState& state) { return world_.set_state(state); }
  /// As World::set_agent: metres, radians, its errors.
  Status set_agent(const Vec3d& position, double yaw, double pitch = 0.0) {
    return world_.set_agent(position, yaw, pitch);
  }
  /// Decides the sensors' noise from here on.
  void set_seed(std::uint64_t seed) noexcept { config_.seed = seed; }

  /// Turns rendering on or off from the next action on.
  void set_rendering(bool on) noexcept { config_.rendering = on; }
  /// Renders made so far: sensors at one place with one field of view count once.
  std::size_t render_count() const noexcept { return rig_.render_count() + spectator_count_; }

  /// Renders any camera at the present time (a map, a spectator). Images live until the next call.
  /// Errors: what BasicRenderer::render reports.
  Result<const Frames<float>*> render(const Camera& camera, unsigned outputs = kRgb) {
    if (Status s = alive(); !s) return s;
    if (Status s = scene_.pose(0, world_.time()); !s) return s;
    RenderConfig config = config_.render;
    config.outputs = outputs;
    ++spectator_count_;
    const ImageRequest request{{scene_.sets(0), &camera, &config, {}, scene_.meshes()}, scene_.detail()};
    if (Status s = rig_.renderer().render(request, spectator_); !s) return s;
    return &spectator_;
  }

  /// The goal of ImageNav: what an agent at the episode's goal sees, turned by goal_rotation(), with
  /// nobody about. The images are in the sensors' order and live until the next call. Errors:
  /// invalid_argument before reset; rendering.
  Result<std::span<const Observation>> goal_images() {
    if (Status s = alive(); !s) return s;
    const WorldState& s = world_.state();
    if (!s.running) return {Errc::invalid_argument, "goal_images before reset: no episode is running"};
    const SensorView view{s.goal.position, goal_rotation(s.episode), 0.0, noise_seed(config_.seed, s),
                          scene_.assets(), &config_.render,          0,   scene_.meshes(),
                          scene_.detail()};
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
               ? Status(Errc::invalid_argument, "this Simulator was moved from: use what it became")
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

/// BasicSimulator<B>::create with B deduced.
template <Backend B>
Result<BasicSimulator<B>> make_simulator(B& backend, SimulatorScene scene, SimulatorConfig config) {
  return BasicSimulator<B>::create(backend, std::move(scene), std::move(config));
}

}  // namespace gsnav
