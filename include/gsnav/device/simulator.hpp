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

/// Navigation simulator for one agent on any device: scene, avatars, sensors and the PointNav task.
///
/// It is `BasicSimulator<B>`, compiled for the device's backend B: the same calls return the same bits.
/// After a move, functions of the old object that return a Status or Result return invalid_argument. Its
/// other functions must not be called.
/// Images lie in the simulator: functions that return them do not compile on a temporary.
///
/// @code
/// auto sim = gsnav::Simulator::create(device, scene, config).value();
/// auto obs = sim.reset(episode).value();
/// while (!sim.done()) obs = sim.step(policy(obs)).value();
/// auto metrics = sim.metrics();
/// @endcode
class Simulator {
 public:
  /// Creates a simulator that shares `scene` (docs/reference/ownership.md).
  /// @param others further bodies, numbered after the scene's avatars
  /// @return invalid_argument naming the field, sensor or asset; unsupported if the device is not
  ///   available; out_of_memory; backend_failure.
  static Result<Simulator> create(const Device& device, std::shared_ptr<const SimulatorScene> scene,
                                  SimulatorConfig config, World::BodySource others = {});
  /// Creates a simulator that owns `scene`.
  /// @return the errors of the overload above.
  static Result<Simulator> create(const Device& device, SimulatorScene scene, SimulatorConfig config);
  /// Takes over the simulator of the argument.
  Simulator(Simulator&&) noexcept;
  /// Takes over the simulator of the argument.
  Simulator& operator=(Simulator&&) noexcept;
  /// Frees the device's memory.
  ~Simulator();

  /// Starts an episode and renders the first observations.
  /// @return the errors of World::reset, or a rendering error.
  Result<Observations> reset(const PointNavEpisode& episode) &;
  /// Performs one action for one control period and renders. `Action::stop` ends the episode.
  /// @return the errors of World::step, or a rendering error.
  Result<Observations> step(Action action) &;
  /// Moves at the given velocities for one control period and renders.
  /// @return the errors of World::step, or a rendering error.
  Result<Observations> step(const VelocityCommand& command) &;
  /// Renders the sensors at the present time, without acting.
  /// @return a rendering error.
  Result<Observations> observe() &;

  /// True if the episode has ended.
  bool done() const noexcept;
  /// Metrics of the episode so far.
  EpisodeMetrics metrics() const;
  /// Time on the scene's clock, seconds.
  double clock() const noexcept { return world().time(); }
  /// Position and orientation of the agent.
  const AgentPose& agent() const noexcept { return world().agent(); }
  /// The world without images: agent, task and clock. Valid while the simulator lives.
  const World& world() const noexcept;
  /// The scene. Valid while the simulator lives.
  const SimulatorScene& scene() const noexcept;
  /// Settings. Valid while the simulator lives.
  const SimulatorConfig& config() const noexcept;
  /// Device that the simulator runs on.
  const Device& device() const noexcept { return device_; }

  /// All state that changes during an episode. Pass a copy to set_state to return to this moment.
  const WorldState& state() const noexcept { return world().state(); }
  /// Restores a state that state() returned.
  /// @return the errors of World::set_state.
  Status set_state(const WorldState& state);
  /// Moves the agent. Position in metres, angles in radians.
  /// @return the errors of World::set_agent.
  Status set_agent(const Vec3d& position, double yaw, double pitch = 0.0);
  /// Seeds the sensors' noise from now on.
  void set_seed(std::uint64_t seed) noexcept;
  /// Turns rendering on or off, from the next action on.
  void set_rendering(bool on) noexcept;
  /// Number of renders so far. Sensors with the same position and field of view share a render.
  std::size_t render_count() const noexcept;

  /// Renders any camera at the present time, such as a map or a spectator's view. The images are valid
  /// until the next call.
  /// @return the errors of Renderer::render.
  Result<const Frames<float>*> render(const Camera& camera, unsigned outputs = kRgb) &;
  /// Goal images of ImageNav: what the sensors see from the episode's goal, without avatars. In the
  /// order of the sensors; valid until the next call.
  /// @return invalid_argument before the first reset; a rendering error.
  Result<std::span<const Observation>> goal_images() &;

 private:
  Simulator(const Device& device, std::unique_ptr<detail::SimulatorEngine> engine) noexcept;

  Device device_;
  std::unique_ptr<detail::SimulatorEngine> engine_;
};

/// Navigation simulator for N environments over M scenes on any device, stepped by one call.
///
/// It is `BasicBatchSimulator<B>`, compiled for the device's backend B. After an error, call reset() to
/// start again. After a move, the old object has no environments and returns invalid_argument. Images
/// lie in the simulator: functions that return them do not compile on a temporary.
///
/// @code
/// auto sim = gsnav::BatchSimulator::create(device, scenes, config, 256, episode_of).value();
/// auto out = sim.reset().value();
/// while (running) out = sim.step(policy(out)).value();
/// @endcode
class BatchSimulator {
 public:
  /// Creates a simulator that shares `scenes`.
  /// @param environments number of environments, N
  /// @param next_episode called once for each episode of each environment; see EpisodeSource
  /// @return invalid_argument naming the field, sensor or scene; unsupported if the device is not
  ///   available, or naming a sensor whose images cannot stay where BatchConfig::images asks;
  ///   out_of_memory; backend_failure.
  static Result<BatchSimulator> create(const Device& device,
                                       std::vector<std::shared_ptr<const SimulatorScene>> scenes,
                                       BatchConfig config, std::size_t environments,
                                       EpisodeSource next_episode);
  /// Creates a simulator over scenes that `library` loads in the background and unloads when they are
  /// not needed. Other arguments and errors as for create.
  static Result<BatchSimulator> create_from_library(const Device& device,
                                                    std::shared_ptr<SceneLibrary> library,
                                                    BatchConfig config, std::size_t environments,
                                                    EpisodeSource next_episode);
  /// Takes over the simulator of the argument.
  BatchSimulator(BatchSimulator&&) noexcept;
  /// Takes over the simulator of the argument.
  BatchSimulator& operator=(BatchSimulator&&) noexcept;
  /// Frees the device's memory.
  ~BatchSimulator();

  /// Number of environments, N.
  std::size_t environments() const noexcept;
  /// World of an environment, without images. Valid while the simulator lives.
  /// @pre environment < environments(), and a reset() has succeeded.
  const World& world(std::size_t environment) const noexcept;
  /// Index of the scene that an environment is in. @pre as for world().
  std::size_t scene_of(std::size_t environment) const noexcept;
  /// Device that the simulator runs on.
  const Device& device() const noexcept { return device_; }

  /// Starts the next episode in all environments, or only in those whose mask is not 0.
  /// @param mask [N], or empty for all
  /// @param meanwhile called while a GPU draws, or after drawing on a CPU; see WhileDrawing
  /// @return the errors of the episode source and World::reset, a rendering error, or that of
  ///   `meanwhile`.
  Result<BatchStep> reset(std::span<const std::uint8_t> mask = {}, const WhileDrawing& meanwhile = {}) &;
  /// Performs one action per environment and renders.
  /// @param actions [N]
  /// @param meanwhile called while a GPU draws, or after drawing on a CPU; see WhileDrawing
  /// @return invalid_argument naming the environment's index: for a wrong number of actions, before the
  ///   first reset, or in an environment that is done with AutoReset::disabled. Also the errors of
  ///   World::step, a rendering error, or that of `meanwhile`.
  Result<BatchStep> step(std::span<const Action> actions, const WhileDrawing& meanwhile = {}) &;
  /// Moves each environment's agent at the given velocities, [N], and renders. Errors as above.
  Result<BatchStep> step(std::span<const VelocityCommand> commands,
                         const WhileDrawing& meanwhile = {}) &;

  /// Number of renders so far.
  std::size_t render_count() const noexcept;
  /// Number of times that an avatar was skinned for rendering.
  std::size_t pose_count() const noexcept;
  /// Turns rendering on or off, from the next action on.
  void set_rendering(bool on) noexcept;

 private:
  BatchSimulator(const Device& device, std::unique_ptr<detail::BatchEngine> engine) noexcept;

  Device device_;
  std::unique_ptr<detail::BatchEngine> engine_;
};

}  // namespace gsnav
