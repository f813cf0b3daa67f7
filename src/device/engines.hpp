// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gsnav/device/renderer.hpp"
#include "gsnav/device/simulator.hpp"

// Interfaces behind the classes over Device: one for each class, and for each backend a function that
// makes one.

namespace gsnav::detail {

class RendererEngine {
 public:
  virtual ~RendererEngine() = default;
  virtual Status render(std::span<const Camera> cameras, double time, Frames<float>& out) = 0;
  virtual void set_config(const RenderConfig& config) = 0;
  virtual void set_light(const MeshLight& light) = 0;
};

class SimulatorEngine {
 public:
  virtual ~SimulatorEngine() = default;
  virtual Result<Observations> reset(const PointNavEpisode& episode) = 0;
  virtual Result<Observations> step(Action action) = 0;
  virtual Result<Observations> step(const VelocityCommand& command) = 0;
  virtual Result<Observations> observe() = 0;
  virtual const World& world() const noexcept = 0;
  virtual const SimulatorScene& scene() const noexcept = 0;
  virtual const SimulatorConfig& config() const noexcept = 0;
  virtual Status set_state(const WorldState& state) = 0;
  virtual Status set_agent(const Vec3d& position, double yaw, double pitch) = 0;
  virtual void set_seed(std::uint64_t seed) noexcept = 0;
  virtual void set_rendering(bool on) noexcept = 0;
  virtual std::size_t render_count() const noexcept = 0;
  virtual Result<const Frames<float>*> render(const Camera& camera, unsigned outputs) = 0;
  virtual Result<std::span<const Observation>> goal_images() = 0;
};

class BatchEngine {
 public:
  virtual ~BatchEngine() = default;
  virtual std::size_t environments() const noexcept = 0;
  virtual const World& world(std::size_t environment) const noexcept = 0;
  virtual std::size_t scene_of(std::size_t environment) const noexcept = 0;
  virtual Result<BatchStep> reset(std::span<const std::uint8_t> mask, const WhileDrawing& f) = 0;
  virtual Result<BatchStep> step(std::span<const Action> actions, const WhileDrawing& f) = 0;
  virtual Result<BatchStep> step(std::span<const VelocityCommand> commands, const WhileDrawing& f) = 0;
  virtual std::size_t render_count() const noexcept = 0;
  virtual std::size_t pose_count() const noexcept = 0;
  virtual void set_rendering(bool on) noexcept = 0;
};

/// Arguments of a batch simulator.
struct BatchParts {
  std::vector<std::shared_ptr<const SimulatorScene>> scenes;
  std::shared_ptr<SceneLibrary> library;  ///< used instead of `scenes` if not null
  BatchConfig config;
  std::size_t environments = 0;
  EpisodeSource next_episode;
};

/// Makes engines for one kind of device. May throw anything that guarded() turns into a Status.
struct EngineFactory {
  std::unique_ptr<RendererEngine> (*renderer)(const Device&, std::shared_ptr<const SimulatorScene>,
                                              const RenderOptions&);
  Result<std::unique_ptr<SimulatorEngine>> (*simulator)(const Device&,
                                                        std::shared_ptr<const SimulatorScene>,
                                                        SimulatorConfig, World::BodySource);
  Result<std::unique_ptr<BatchEngine>> (*batch)(const Device&, BatchParts);
};

// Declared in every build and defined where the build has the backend: ccache then has the same engines
// for builds with and without GPUs.
extern const EngineFactory serial_engines;
extern const EngineFactory openmp_engines;
extern const EngineFactory cuda_engines;
/// Number of threads of a CPU device that was asked for `threads`, and the name of its instruction set.
int cpu_threads(int threads);
std::string cpu_instruction_set();
int cuda_count() noexcept;
/// build_visible_sets on a GPU. Exceptions of settings.progress leave it, as on a CPU.
Result<VisibleSets> visible_sets_on_cuda(const Device& device, const GaussianCloud& cloud,
                                         std::span<const Vec3d> viewpoints,
                                         const VisibleSettings& settings,
                                         const Similarity& world_from_asset);
std::string cuda_name(int index);

}  // namespace gsnav::detail
