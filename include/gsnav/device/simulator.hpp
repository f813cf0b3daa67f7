// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/render/frames.hpp"
#include "gsnav/sim/config.hpp"
#include "gsnav/sim/scene.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

class SceneLibrary;

namespace detail {
class BatchEngine;
class SimulatorEngine;
}  // namespace detail

/// A simulator on any device: scene, avatars, agent, sensors and the PointNav task. It is
/// BasicSimulator<B>, where B is the device's backend, compiled once: the same calls give the same bits.
/// It may be moved. In one that was moved from, calls that can fail answer invalid_argument; make no
/// others.
///
///     auto sim = gsnav::Simulator::create(device, scene, config).value();
///     auto obs = sim.reset(episode).value();
///     while (!sim.done()) obs = sim.step(policy(obs)).value();
///     auto metrics = sim.metrics();
class Simulator {
 public:
  /// Shares the scene (docs/ownership.md). Errors: invalid_argument naming the field, sensor or asset;
  /// unsupported where the device is not there; out_of_memory; backend_failure. `others` adds bodies to
  /// the scene's avatars, numbered behind them.
  static Result<Simulator> create(const Device& device, std::shared_ptr<const SimulatorScene> scene,
                                  SimulatorConfig config, World::BodySource others = {});
  /// Owns the scene. Errors: the same as above.
  static Result<Simulator> create(const Device& device, SimulatorScene scene, SimulatorConfig config);
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;
  ~Simulator();

  /// Begins an episode. Errors: what World::reset reports; rendering.
  Result<Observations> reset(const PointNavEpisode& episode);
  /// Acts for one control period; Action::stop ends the episode. Errors: what World::step reports;
  /// rendering.
  Result<Observations> step(Action action);
  Result<Observations> step(const VelocityCommand& command);
  /// Renders what the agent sees now, without acting. Errors: what rendering reports.
  Result<Observations> observe();

  bool done() const noexcept;      ///< Whether the episode has ended.
  EpisodeMetrics metrics() const;  ///< Metrics of the episode so far.
  /// Seconds on the scene's clock.
  double clock() const noexcept { return world().time(); }
  /// Where the agent is.
  const AgentPose& agent() const noexcept { return world().agent(); }
  const World& world() const noexcept;             ///< Agent, episode and clock, without sensors.
  const SimulatorScene& scene() const noexcept;    ///< The scene.
  const SimulatorConfig& config() const noexcept;  ///< The settings.
  /// The device that it runs on.
  const Device& device() const noexcept { return device_; }

  /// Everything that changes while it runs, and the way back to it. Errors: of World::set_state.
  const WorldState& state() const noexcept { return world().state(); }
  /// Goes back to a state of this simulator. Errors: invalid_argument if it is another task's.
  Status set_state(const WorldState& state);
  /// Metres, radians. Errors: of World::set_agent.
  Status set_agent(const Vec3d& position, double yaw, double pitch = 0.0);
  /// Decides the sensors' noise from here on.
  void set_seed(std::uint64_t seed) noexcept;
  /// Turns rendering on or off from the next action on.
  void set_rendering(bool on) noexcept;
  /// Renders made so far: sensors at one place with one field of view count once.
  std::size_t render_count() const noexcept;

  /// Renders any camera at the present time (a map, a spectator). Images live until the next call.
  /// Errors: of Renderer::render.
  Result<const Frames<float>*> render(const Camera& camera, unsigned outputs = kRgb);
  /// The goal of ImageNav: what an agent at the episode's goal sees, with nobody about. In the sensors'
  /// order; they live until the next call. Errors: invalid_argument before reset; rendering.
  Result<std::span<const Observation>> goal_images();

 private:
  Simulator(const Device& device, std::unique_ptr<detail::SimulatorEngine> engine) noexcept;

  Device device_;
  std::unique_ptr<detail::SimulatorEngine> engine_;
};

/// N environments over M scenes on any device: BasicBatchSimulator<B>, where B is the device's backend,
/// compiled once. It may be moved; one that was moved from has no environments and answers with
/// invalid_argument. After an error reset() begins anew.
///
///     auto sim = gsnav::BatchSimulator::create(device, scenes, config, 256, episode_of).value();
///     auto out = sim.reset().value();
///     while (running) out = sim.step(policy(out)).value();
class BatchSimulator {
 public:
  /// Shares the scenes. `next_episode` is asked for each episode of each environment; see EpisodeSource.
  /// Errors: invalid_argument naming the field, sensor or scene; unsupported where the device is not
  /// there, or naming a sensor whose images cannot stay where BatchConfig::images says; out_of_memory;
  /// backend_failure.
  static Result<BatchSimulator> create(const Device& device,
                                       std::vector<std::shared_ptr<const SimulatorScene>> scenes,
                                       BatchConfig config, std::size_t environments,
                                       EpisodeSource next_episode);
  /// The same over scenes that are loaded in the background and leave when they are not needed.
  static Result<BatchSimulator> create_from_library(const Device& device,
                                                    std::shared_ptr<SceneLibrary> library,
                                                    BatchConfig config, std::size_t environments,
                                                    EpisodeSource next_episode);
  BatchSimulator(BatchSimulator&&) noexcept;
  BatchSimulator& operator=(BatchSimulator&&) noexcept;
  ~BatchSimulator();

  std::size_t environments() const noexcept;                   ///< Number of environments.
  const World& world(std::size_t environment) const noexcept;  ///< The world of one environment.
  /// Number of the scene that an environment is in.
  std::size_t scene_of(std::size_t environment) const noexcept;
  /// The device that it runs on.
  const Device& device() const noexcept { return device_; }

  /// Begins the next episode in every environment or, with a mask [N], in those where it is not 0.
  /// Errors: what the episode source and World::reset report; rendering.
  Result<BatchStep> reset(std::span<const std::uint8_t> mask = {});
  /// One action, or one command of velocities, for each environment, [N]. Errors: invalid_argument
  /// (another number of actions; an environment that is done, with AutoReset::disabled; before reset),
  /// with the environment's number; what World::step reports; rendering.
  Result<BatchStep> step(std::span<const Action> actions);
  Result<BatchStep> step(std::span<const VelocityCommand> commands);

  /// Renders made so far, and how many times an avatar was skinned for them.
  std::size_t render_count() const noexcept;
  std::size_t pose_count() const noexcept;  ///< How often an avatar has been posed so far.
  /// Turns rendering on or off. Without it, steps give physics and metrics only.
  void set_rendering(bool on) noexcept;

 private:
  BatchSimulator(const Device& device, std::unique_ptr<detail::BatchEngine> engine) noexcept;

  Device device_;
  std::unique_ptr<detail::BatchEngine> engine_;
};

}  // namespace gsnav
