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
#if defined(GSNAV_DEVICE_OPENMP)
    case DeviceKind::cpu:
      return &detail::openmp_engines;
#endif
#if defined(GSNAV_DEVICE_CUDA)
    case DeviceKind::cuda:
      return &detail::cuda_engines;
#endif
    default:
      return {Errc::unsupported, "device \"" + device.name() + "\": not in this build"};
  }
}

Status moved_from(const char* what) {
  return {Errc::invalid_argument, std::string("this ") + what + " was moved from: use what it became"};
}

/// f(*engine), whose exceptions become a status; an error where the owner, a `what`, was moved from.
template <class Engine, class F>
auto on_engine(const std::unique_ptr<Engine>& engine, const char* what, F&& f) -> decltype(f(*engine)) {
  if (engine == nullptr) return moved_from(what);
  return detail::guarded([&] { return f(*engine); });
}

}  // namespace

// ---- DeviceRenderer

DeviceRenderer::DeviceRenderer(const Device& device,
                               std::unique_ptr<detail::RendererEngine> engine) noexcept
    : device_(device), engine_(std::move(engine)) {}
DeviceRenderer::DeviceRenderer(DeviceRenderer&&) noexcept = default;
DeviceRenderer& DeviceRenderer::operator=(DeviceRenderer&&) noexcept = default;
DeviceRenderer::~DeviceRenderer() = default;

Result<DeviceRenderer> DeviceRenderer::create(const Device& device,
                                              std::shared_ptr<const SimulatorScene> scene,
                                              RenderOptions options) {
  if (scene == nullptr) return {Errc::invalid_argument, "DeviceRenderer: the scene is null"};
  if (Status s = validate_assets(*scene); !s) return s;
  if (Status s = validate(options.render); !s) return s;
  if (Status s = validate_detail(*scene, options.detail); !s) return s;
  return detail::guarded([&]() -> Result<DeviceRenderer> {
    const auto engines = engines_of(device);
    if (!engines) return engines.status();
    return DeviceRenderer(device, (*engines)->renderer(device, std::move(scene), options));
  });
}
Result<DeviceRenderer> DeviceRenderer::create(const Device& device, GaussianCloud cloud,
                                              RenderOptions options) {
  SimulatorScene scene;
  scene.assets.push_back({std::make_shared<const GaussianCloud>(std::move(cloud))});
  return create(device, std::make_shared<const SimulatorScene>(std::move(scene)), std::move(options));
}

Status DeviceRenderer::render(std::span<const Camera> cameras, Frames<float>& out, double time) {
  return on_engine(engine_, "DeviceRenderer",
                   [&](auto& engine) { return engine.render(cameras, time, out); });
}
Result<Frames<float>> DeviceRenderer::render(std::span<const Camera> cameras, double time) {
  Frames<float> frames;
  if (Status s = render(cameras, frames, time); !s) return s;
  return frames;
}
Result<Frames<float>> DeviceRenderer::render(const Camera& camera, double time) {
  return render(std::span(&camera, 1), time);
}
Status DeviceRenderer::set_config(const RenderConfig& config) {
  if (engine_ == nullptr) return moved_from("DeviceRenderer");
  if (Status s = validate(config); !s) return s;
  engine_->set_config(config);
  return {};
}

// ---- DeviceSimulator

DeviceSimulator::DeviceSimulator(const Device& device,
                                 std::unique_ptr<detail::SimulatorEngine> engine) noexcept
    : device_(device), engine_(std::move(engine)) {}
DeviceSimulator::DeviceSimulator(DeviceSimulator&&) noexcept = default;
DeviceSimulator& DeviceSimulator::operator=(DeviceSimulator&&) noexcept = default;
DeviceSimulator::~DeviceSimulator() = default;

Result<DeviceSimulator> DeviceSimulator::create(const Device& device,
                                                std::shared_ptr<const SimulatorScene> scene,
                                                SimulatorConfig config, World::BodySource others) {
  return detail::guarded([&]() -> Result<DeviceSimulator> {
    const auto engines = engines_of(device);
    if (!engines) return engines.status();
    auto engine = (*engines)->simulator(device, std::move(scene), std::move(config), std::move(others));
    if (!engine) return engine.status();
    return DeviceSimulator(device, std::move(*engine));
  });
}
Result<DeviceSimulator> DeviceSimulator::create(const Device& device, SimulatorScene scene,
                                                SimulatorConfig config) {
  return create(device, std::make_shared<const SimulatorScene>(std::move(scene)), std::move(config));
}

Result<Observations> DeviceSimulator::reset(const PointNavEpisode& episode) {
  return on_engine(engine_, "DeviceSimulator", [&](auto& engine) { return engine.reset(episode); });
}
Result<Observations> DeviceSimulator::step(Action action) {
  return on_engine(engine_, "DeviceSimulator", [&](auto& engine) { return engine.step(action); });
}
Result<Observations> DeviceSimulator::step(const VelocityCommand& command) {
  return on_engine(engine_, "DeviceSimulator", [&](auto& engine) { return engine.step(command); });
}
Result<Observations> DeviceSimulator::observe() {
  return on_engine(engine_, "DeviceSimulator", [&](auto& engine) { return engine.observe(); });
}
bool DeviceSimulator::done() const noexcept { return engine_ == nullptr || world().done(); }
EpisodeMetrics DeviceSimulator::metrics() const { return world().metrics(); }
const World& DeviceSimulator::world() const noexcept { return engine_->world(); }
const SimulatorScene& DeviceSimulator::scene() const noexcept { return engine_->scene(); }
const SimulatorConfig& DeviceSimulator::config() const noexcept { return engine_->config(); }
Status DeviceSimulator::set_state(const WorldState& state) {
  return on_engine(engine_, "DeviceSimulator", [&](auto& engine) { return engine.set_state(state); });
}
Status DeviceSimulator::set_agent(const Vec3d& position, double yaw, double pitch) {
  return on_engine(engine_, "DeviceSimulator",
                   [&](auto& engine) { return engine.set_agent(position, yaw, pitch); });
}
void DeviceSimulator::set_seed(std::uint64_t seed) noexcept { engine_->set_seed(seed); }
void DeviceSimulator::set_rendering(bool on) noexcept { engine_->set_rendering(on); }
std::size_t DeviceSimulator::render_count() const noexcept { return engine_->render_count(); }
Result<const Frames<float>*> DeviceSimulator::render(const Camera& camera, unsigned outputs) {
  return on_engine(engine_, "DeviceSimulator",
                   [&](auto& engine) { return engine.render(camera, outputs); });
}
Result<std::span<const Observation>> DeviceSimulator::goal_images() {
  return on_engine(engine_, "DeviceSimulator", [&](auto& engine) { return engine.goal_images(); });
}

// ---- DeviceBatchSimulator

DeviceBatchSimulator::DeviceBatchSimulator(const Device& device,
                                           std::unique_ptr<detail::BatchEngine> engine) noexcept
    : device_(device), engine_(std::move(engine)) {}
DeviceBatchSimulator::DeviceBatchSimulator(DeviceBatchSimulator&&) noexcept = default;
DeviceBatchSimulator& DeviceBatchSimulator::operator=(DeviceBatchSimulator&&) noexcept = default;
DeviceBatchSimulator::~DeviceBatchSimulator() = default;

namespace {

Result<std::unique_ptr<detail::BatchEngine>> make_batch(const Device& device, detail::BatchParts parts) {
  return detail::guarded([&]() -> Result<std::unique_ptr<detail::BatchEngine>> {
    const auto engines = engines_of(device);
    if (!engines) return engines.status();
    return (*engines)->batch(device, std::move(parts));
  });
}

}  // namespace

Result<DeviceBatchSimulator> DeviceBatchSimulator::create(
    const Device& device, std::vector<std::shared_ptr<const SimulatorScene>> scenes, BatchConfig config,
    std::size_t environments, EpisodeSource next_episode) {
  auto engine = make_batch(
      device, {std::move(scenes), nullptr, std::move(config), environments, std::move(next_episode)});
  if (!engine) return engine.status();
  return DeviceBatchSimulator(device, std::move(*engine));
}
Result<DeviceBatchSimulator> DeviceBatchSimulator::create_from_library(
    const Device& device, std::shared_ptr<SceneLibrary> library, BatchConfig config,
    std::size_t environments, EpisodeSource next_episode) {
  if (library == nullptr)
    return {Errc::invalid_argument, "DeviceBatchSimulator: the library of scenes is null"};
  auto engine = make_batch(
      device, {{}, std::move(library), std::move(config), environments, std::move(next_episode)});
  if (!engine) return engine.status();
  return DeviceBatchSimulator(device, std::move(*engine));
}

std::size_t DeviceBatchSimulator::environments() const noexcept {
  return engine_ == nullptr ? 0 : engine_->environments();
}
const World& DeviceBatchSimulator::world(std::size_t environment) const noexcept {
  return engine_->world(environment);
}
std::size_t DeviceBatchSimulator::scene_of(std::size_t environment) const noexcept {
  return engine_->scene_of(environment);
}
Result<BatchStep> DeviceBatchSimulator::reset(std::span<const std::uint8_t> mask) {
  return on_engine(engine_, "DeviceBatchSimulator", [&](auto& engine) { return engine.reset(mask); });
}
Result<BatchStep> DeviceBatchSimulator::step(std::span<const Action> actions) {
  return on_engine(engine_, "DeviceBatchSimulator", [&](auto& engine) { return engine.step(actions); });
}
Result<BatchStep> DeviceBatchSimulator::step(std::span<const VelocityCommand> commands) {
  return on_engine(engine_, "DeviceBatchSimulator", [&](auto& engine) { return engine.step(commands); });
}
std::size_t DeviceBatchSimulator::render_count() const noexcept { return engine_->render_count(); }
std::size_t DeviceBatchSimulator::pose_count() const noexcept { return engine_->pose_count(); }
void DeviceBatchSimulator::set_rendering(bool on) noexcept { engine_->set_rendering(on); }

}  // namespace gsnav
