// SPDX-License-Identifier: Apache-2.0
#include "engines.hpp"

#include <utility>

#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/sim/scene_library.hpp"

namespace gsnav {
namespace {

Result<const detail::EngineFactory*> engines_of(const Device& device) {
  switch (device.kind()) {
    case DeviceKind::serial:
      return &detail::serial_engines;
    case DeviceKind::cpu:
#if defined(GSNAV_DEVICE_OPENMP)
      return &detail::openmp_engines;
#else
      break;
#endif
    case DeviceKind::cuda:
#if defined(GSNAV_DEVICE_CUDA)
      return &detail::cuda_engines;
#else
      break;
#endif
  }
  return {Errc::unsupported, "device \"" + device.name() + "\": not in this build"};
}

Status moved_from(const char* what) {
  return {Errc::invalid_argument,
          std::string("this ") + what + " was moved from; use the object that it was moved to"};
}

/// Calls f(*engine) and turns exceptions into a status. A missing engine means that its owner, a `what`,
/// was moved from: an error.
template <class Engine, class F>
auto on_engine(const std::unique_ptr<Engine>& engine, const char* what, F&& f) -> decltype(f(*engine)) {
  if (engine == nullptr) return moved_from(what);
  return detail::guarded([&] { return f(*engine); });
}

}  // namespace

// ---- Renderer

Renderer::Renderer(const Device& device, std::unique_ptr<detail::RendererEngine> engine) noexcept
    : device_(device), engine_(std::move(engine)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Result<Renderer> Renderer::create(const Device& device, std::shared_ptr<const SimulatorScene> scene,
                                  RenderOptions options) {
  if (scene == nullptr) return {Errc::invalid_argument, "Renderer: the scene is null"};
  if (Status s = validate_assets(*scene); !s) return s;
  if (Status s = validate(options.render); !s) return s;
  if (Status s = validate_detail(*scene, options.detail); !s) return s;
  return detail::guarded([&]() -> Result<Renderer> {
    const auto engines = engines_of(device);
    if (!engines) return engines.status();
    return Renderer(device, (*engines)->renderer(device, std::move(scene), options));
  });
}
Result<Renderer> Renderer::create(const Device& device, GaussianCloud cloud, RenderOptions options) {
  SimulatorScene scene;
  scene.assets.push_back({std::make_shared<const GaussianCloud>(std::move(cloud))});
  return create(device, std::make_shared<const SimulatorScene>(std::move(scene)), std::move(options));
}

Status Renderer::render(std::span<const Camera> cameras, Frames<float>& out, double time) {
  return on_engine(engine_, "Renderer", [&](auto& engine) { return engine.render(cameras, time, out); });
}
Result<Frames<float>> Renderer::render(std::span<const Camera> cameras, double time) {
  Frames<float> frames;
  if (Status s = render(cameras, frames, time); !s) return s;
  return frames;
}
Result<Frames<float>> Renderer::render(const Camera& camera, double time) {
  return render(std::span(&camera, 1), time);
}
Status Renderer::set_config(const RenderConfig& config) {
  if (engine_ == nullptr) return moved_from("Renderer");
  if (Status s = validate(config); !s) return s;
  engine_->set_config(config);
  return {};
}
Status Renderer::set_light(const MeshLight& light) {
  if (engine_ == nullptr) return moved_from("Renderer");
  engine_->set_light(light);
  return {};
}

// ---- Simulator

Simulator::Simulator(const Device& device, std::unique_ptr<detail::SimulatorEngine> engine) noexcept
    : device_(device), engine_(std::move(engine)) {}
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;
Simulator::~Simulator() = default;

Result<Simulator> Simulator::create(const Device& device, std::shared_ptr<const SimulatorScene> scene,
                                    SimulatorConfig config, World::BodySource others) {
  return detail::guarded([&]() -> Result<Simulator> {
    const auto engines = engines_of(device);
    if (!engines) return engines.status();
    auto engine = (*engines)->simulator(device, std::move(scene), std::move(config), std::move(others));
    if (!engine) return engine.status();
    return Simulator(device, std::move(*engine));
  });
}
Result<Simulator> Simulator::create(const Device& device, SimulatorScene scene, SimulatorConfig config) {
  return create(device, std::make_shared<const SimulatorScene>(std::move(scene)), std::move(config));
}

Result<Observations> Simulator::reset(const PointNavEpisode& episode) & {
  return on_engine(engine_, "Simulator", [&](auto& engine) { return engine.reset(episode); });
}
Result<Observations> Simulator::step(Action action) & {
  return on_engine(engine_, "Simulator", [&](auto& engine) { return engine.step(action); });
}
Result<Observations> Simulator::step(const VelocityCommand& command) & {
  return on_engine(engine_, "Simulator", [&](auto& engine) { return engine.step(command); });
}
Result<Observations> Simulator::observe() & {
  return on_engine(engine_, "Simulator", [&](auto& engine) { return engine.observe(); });
}
bool Simulator::done() const noexcept { return engine_ == nullptr || world().done(); }
EpisodeMetrics Simulator::metrics() const { return world().metrics(); }
const World& Simulator::world() const noexcept { return engine_->world(); }
const SimulatorScene& Simulator::scene() const noexcept { return engine_->scene(); }
const SimulatorConfig& Simulator::config() const noexcept { return engine_->config(); }
Status Simulator::set_state(const WorldState& state) {
  return on_engine(engine_, "Simulator", [&](auto& engine) { return engine.set_state(state); });
}
Status Simulator::set_agent(const Vec3d& position, double yaw, double pitch) {
  return on_engine(engine_, "Simulator",
                   [&](auto& engine) { return engine.set_agent(position, yaw, pitch); });
}
void Simulator::set_seed(std::uint64_t seed) noexcept { engine_->set_seed(seed); }
void Simulator::set_rendering(bool on) noexcept { engine_->set_rendering(on); }
std::size_t Simulator::render_count() const noexcept { return engine_->render_count(); }
Result<const Frames<float>*> Simulator::render(const Camera& camera, unsigned outputs) & {
  return on_engine(engine_, "Simulator", [&](auto& engine) { return engine.render(camera, outputs); });
}
Result<std::span<const Observation>> Simulator::goal_images() & {
  return on_engine(engine_, "Simulator", [&](auto& engine) { return engine.goal_images(); });
}

// ---- BatchSimulator

BatchSimulator::BatchSimulator(const Device& device,
                               std::unique_ptr<detail::BatchEngine> engine) noexcept
    : device_(device), engine_(std::move(engine)) {}
BatchSimulator::BatchSimulator(BatchSimulator&&) noexcept = default;
BatchSimulator& BatchSimulator::operator=(BatchSimulator&&) noexcept = default;
BatchSimulator::~BatchSimulator() = default;

namespace {

Result<std::unique_ptr<detail::BatchEngine>> make_batch(const Device& device, detail::BatchParts parts) {
  return detail::guarded([&]() -> Result<std::unique_ptr<detail::BatchEngine>> {
    const auto engines = engines_of(device);
    if (!engines) return engines.status();
    return (*engines)->batch(device, std::move(parts));
  });
}

}  // namespace

Result<BatchSimulator> BatchSimulator::create(const Device& device,
                                              std::vector<std::shared_ptr<const SimulatorScene>> scenes,
                                              BatchConfig config, std::size_t environments,
                                              EpisodeSource next_episode) {
  auto engine = make_batch(
      device, {std::move(scenes), nullptr, std::move(config), environments, std::move(next_episode)});
  if (!engine) return engine.status();
  return BatchSimulator(device, std::move(*engine));
}
Result<BatchSimulator> BatchSimulator::create_from_library(const Device& device,
                                                           std::shared_ptr<SceneLibrary> library,
                                                           BatchConfig config, std::size_t environments,
                                                           EpisodeSource next_episode) {
  if (library == nullptr)
    return {Errc::invalid_argument, "BatchSimulator: the library of scenes is null"};
  auto engine = make_batch(
      device, {{}, std::move(library), std::move(config), environments, std::move(next_episode)});
  if (!engine) return engine.status();
  return BatchSimulator(device, std::move(*engine));
}

std::size_t BatchSimulator::environments() const noexcept {
  return engine_ == nullptr ? 0 : engine_->environments();
}
const World& BatchSimulator::world(std::size_t environment) const noexcept {
  return engine_->world(environment);
}
std::size_t BatchSimulator::scene_of(std::size_t environment) const noexcept {
  return engine_->scene_of(environment);
}
Result<BatchStep> BatchSimulator::reset(std::span<const std::uint8_t> mask,
                                        const WhileDrawing& meanwhile) & {
  return on_engine(engine_, "BatchSimulator",
                   [&](auto& engine) { return engine.reset(mask, meanwhile); });
}
Result<BatchStep> BatchSimulator::step(std::span<const Action> actions,
                                       const WhileDrawing& meanwhile) & {
  return on_engine(engine_, "BatchSimulator",
                   [&](auto& engine) { return engine.step(actions, meanwhile); });
}
Result<BatchStep> BatchSimulator::step(std::span<const VelocityCommand> commands,
                                       const WhileDrawing& meanwhile) & {
  return on_engine(engine_, "BatchSimulator",
                   [&](auto& engine) { return engine.step(commands, meanwhile); });
}
std::size_t BatchSimulator::render_count() const noexcept { return engine_->render_count(); }
std::size_t BatchSimulator::pose_count() const noexcept { return engine_->pose_count(); }
void BatchSimulator::set_rendering(bool on) noexcept { engine_->set_rendering(on); }

}  // namespace gsnav
