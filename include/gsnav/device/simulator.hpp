// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "gsnav/core/status.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/render/frames.hpp"
#include "gsnav/sim/config.hpp"
#include "gsnav/sim/observations.hpp"
#include "gsnav/sim/scene.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

namespace detail {
class SimulatorEngine;
}

/// A simulator on any device: scene, avatars, agent, sensors and the PointNav task. It is BasicSimulator
/// on the device's backend, compiled once: the same calls give the same bits. It may be moved; one that
/// was moved from answers whatever can fail with invalid_argument, and nothing else must be asked of it.
///
///     auto sim = gsnav::DeviceSimulator::create(device, scene, config).value();
///     auto obs = sim.reset(episode).value();
///     while (!sim.done()) obs = sim.step(policy(obs)).value();
///     auto metrics = sim.metrics();
class DeviceSimulator {
 public:
  /// Errors: invalid_argument naming the field, sensor or asset; unsupported where the device is not
  /// there; out_of_memory; backend_failure. `others` adds bodies to the scene's avatars, numbered behind
  /// them.
  static Result<DeviceSimulator> create(const Device& device,
                                        std::shared_ptr<const SimulatorScene> scene,
                                        SimulatorConfig config, World::BodySource others = {});
  static Result<DeviceSimulator> create(const Device& device, SimulatorScene scene,
                                        SimulatorConfig config);
  DeviceSimulator(DeviceSimulator&&) noexcept;
  DeviceSimulator& operator=(DeviceSimulator&&) noexcept;
  ~DeviceSimulator();

  /// Begins an episode. Errors: what World::reset reports; rendering.
  Result<Observations> reset(const PointNavEpisode& episode);
  /// Acts for one control period; Action::stop ends the episode. Errors: what World::step reports;
  /// rendering.
  Result<Observations> step(Action action);
  Result<Observations> step(const VelocityCommand& command);
  /// Renders what the agent sees now, without acting. Errors: what rendering reports.
  Result<Observations> observe();

  bool done() const noexcept;
  EpisodeMetrics metrics() const;
  /// Seconds on the scene's clock.
  double clock() const noexcept { return world().time(); }
  const AgentPose& agent() const noexcept { return world().agent(); }
  const World& world() const noexcept;
  const SimulatorScene& scene() const noexcept;
  const SimulatorConfig& config() const noexcept;
  const Device& device() const noexcept { return device_; }

  /// Everything that changes while it runs, and the way back to it. Errors: of World::set_state.
  const WorldState& state() const noexcept { return world().state(); }
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
  /// Errors: of DeviceRenderer::render.
  Result<const Frames<float>*> render(const Camera& camera, unsigned outputs = kRgb);
  /// The goal of ImageNav: what an agent at the episode's goal sees, with nobody about. In the sensors'
  /// order; they live until the next call. Errors: invalid_argument before reset; rendering.
  Result<std::span<const Observation>> goal_images();

 private:
  DeviceSimulator(const Device& device, std::unique_ptr<detail::SimulatorEngine> engine) noexcept;

  Device device_;
  std::unique_ptr<detail::SimulatorEngine> engine_;
};

}  // namespace gsnav
