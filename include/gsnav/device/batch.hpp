// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/sim/config.hpp"
#include "gsnav/sim/observations.hpp"
#include "gsnav/sim/scene.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

class SceneLibrary;

namespace detail {
class BatchEngine;
}

/// N environments over M scenes on any device: BasicBatchSimulator on the device's backend, compiled
/// once. It may be moved; one that was moved from has no environments and answers with
/// invalid_argument. After an error reset() begins anew.
///
///     auto sim = gsnav::DeviceBatchSimulator::create(device, scenes, config, 256, episode_of).value();
///     auto out = sim.reset().value();
///     while (running) out = sim.step(policy(out)).value();
class DeviceBatchSimulator {
 public:
  /// `next_episode` is asked for each episode of each environment; see EpisodeSource. Errors:
  /// invalid_argument naming the field, sensor or scene; unsupported where the device is not there, or
  /// naming a sensor whose images cannot stay where BatchConfig::images says; out_of_memory;
  /// backend_failure.
  static Result<DeviceBatchSimulator> create(const Device& device,
                                             std::vector<std::shared_ptr<const SimulatorScene>> scenes,
                                             BatchConfig config, std::size_t environments,
                                             EpisodeSource next_episode);
  /// The same over scenes that are loaded in the background and leave when they are not needed.
  static Result<DeviceBatchSimulator> create_from_library(const Device& device,
                                                          std::shared_ptr<SceneLibrary> library,
                                                          BatchConfig config, std::size_t environments,
                                                          EpisodeSource next_episode);
  DeviceBatchSimulator(DeviceBatchSimulator&&) noexcept;
  DeviceBatchSimulator& operator=(DeviceBatchSimulator&&) noexcept;
  ~DeviceBatchSimulator();

  std::size_t environments() const noexcept;
  const World& world(std::size_t environment) const noexcept;
  std::size_t scene_of(std::size_t environment) const noexcept;
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
  std::size_t pose_count() const noexcept;
  void set_rendering(bool on) noexcept;

 private:
  DeviceBatchSimulator(const Device& device, std::unique_ptr<detail::BatchEngine> engine) noexcept;

  Device device_;
  std::unique_ptr<detail::BatchEngine> engine_;
};

}  // namespace gsnav
