// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "engines.hpp"
#include "gsnav/detail/sim/image_renderer.hpp"
#include "gsnav/detail/sim/scene_on_backend.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "gsnav/sim/basic_simulator.hpp"

// The engines for a backend B. Each engine owns its backend, which `make` creates from a Device.

namespace gsnav::detail {

template <class B>
class RendererOn final : public RendererEngine {
 public:
  RendererOn(std::unique_ptr<B> backend, std::shared_ptr<const SimulatorScene> scene,
             const RenderOptions& options)
      : backend_(std::move(backend)),
        scene_(*backend_, std::move(scene), options.detail),
        skinning_(*backend_),
        images_(*backend_),
        light_(scene_.meshes().light) {
    set_config(options.render);
  }

  void set_config(const RenderConfig& config) override { config_ = scene_.render_config(config); }
  void set_light(const MeshLight& light) override { light_ = light; }

  Status render(std::span<const Camera> cameras, double time, Frames<float>& out) override {
    if (Status s = BasicRenderer<float, B>::size_frames(cameras, config_.outputs, out); !s) return s;
    scene_.make_slots(1);
    if (Status s = scene_.prepare(0, time, cameras, config_); !s) return s;
    scene_.pose_prepared(0, skinning_);
    if (Status s = skinning_.run(); !s) return s;
    requests_.clear();
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      requests_.push_back({{scene_.sets(0),
                            &cameras[c],
                            &config_,
                            BasicRenderer<float, B>::images_of(out, c),
                            {scene_.meshes().instances, light_}},
                           scene_.levels(),
                           scene_.bodies(0)});
    }
    if (Status s = images_.render(requests_, ImageMemory::host); !s) return s;
    std::copy(images_.stats().begin(), images_.stats().end(), out.stats.begin());
    return {};
  }

 private:
  std::unique_ptr<B> backend_;
  SceneOnBackend<B> scene_;
  SkinningBatch<B> skinning_;
  ImageRenderer<B> images_;
  MeshLight light_;
  RenderConfig config_;
  std::vector<ImageRequest> requests_;
};

template <class B>
class SimulatorOn final : public SimulatorEngine {
 public:
  SimulatorOn(std::unique_ptr<B> backend, BasicSimulator<B> simulator)
      : backend_(std::move(backend)), sim_(std::move(simulator)) {}

  Result<Observations> reset(const PointNavEpisode& episode) override { return sim_.reset(episode); }
  Result<Observations> step(Action action) override { return sim_.step(action); }
  Result<Observations> step(const VelocityCommand& command) override { return sim_.step(command); }
  Result<Observations> observe() override { return sim_.observe(); }
  const World& world() const noexcept override { return sim_.world(); }
  const SimulatorScene& scene() const noexcept override { return sim_.scene(); }
  const SimulatorConfig& config() const noexcept override { return sim_.config(); }
  Status set_state(const WorldState& state) override { return sim_.set_state(state); }
  Status set_agent(const Vec3d& position, double yaw, double pitch) override {
    return sim_.set_agent(position, yaw, pitch);
  }
  void set_seed(std::uint64_t seed) noexcept override { sim_.set_seed(seed); }
  void set_rendering(bool on) noexcept override { sim_.set_rendering(on); }
  std::size_t render_count() const noexcept override { return sim_.render_count(); }
  Result<const Frames<float>*> render(const Camera& camera, unsigned outputs) override {
    return sim_.render(camera, outputs);
  }
  Result<std::span<const Observation>> goal_images() override { return sim_.goal_images(); }

 private:
  std::unique_ptr<B> backend_;
  BasicSimulator<B> sim_;
};

template <class B>
class BatchOn final : public BatchEngine {
 public:
  BatchOn(std::unique_ptr<B> backend, BasicBatchSimulator<B> simulator)
      : backend_(std::move(backend)), sim_(std::move(simulator)) {}

  std::size_t environments() const noexcept override { return sim_.environments(); }
  const World& world(std::size_t environment) const noexcept override { return sim_.world(environment); }
  std::size_t scene_of(std::size_t environment) const noexcept override {
    return sim_.scene_of(environment);
  }
  Result<BatchStep> reset(std::span<const std::uint8_t> mask, const WhileDrawing& f) override {
    return sim_.reset(mask, f);
  }
  Result<BatchStep> step(std::span<const Action> actions, const WhileDrawing& f) override {
    return sim_.step(actions, f);
  }
  Result<BatchStep> step(std::span<const VelocityCommand> commands, const WhileDrawing& f) override {
    return sim_.step(commands, f);
  }
  std::size_t render_count() const noexcept override { return sim_.render_count(); }
  std::size_t pose_count() const noexcept override { return sim_.pose_count(); }
  void set_rendering(bool on) noexcept override { sim_.set_rendering(on); }

 private:
  std::unique_ptr<B> backend_;
  BasicBatchSimulator<B> sim_;
};

/// `make` returns a std::unique_ptr<B> for a Device.
template <class B, auto make>
constexpr EngineFactory engines_on() {
  return {
      [](const Device& device, std::shared_ptr<const SimulatorScene> scene,
         const RenderOptions& options) -> std::unique_ptr<RendererEngine> {
        return std::make_unique<RendererOn<B>>(make(device), std::move(scene), options);
      },
      [](const Device& device, std::shared_ptr<const SimulatorScene> scene, SimulatorConfig config,
         World::BodySource others) -> Result<std::unique_ptr<SimulatorEngine>> {
        std::unique_ptr<B> backend = make(device);
        auto sim =
            BasicSimulator<B>::create(*backend, std::move(scene), std::move(config), std::move(others));
        if (!sim) return sim.status();
        return std::unique_ptr<SimulatorEngine>(
            std::make_unique<SimulatorOn<B>>(std::move(backend), std::move(*sim)));
      },
      [](const Device& device, BatchParts p) -> Result<std::unique_ptr<BatchEngine>> {
        std::unique_ptr<B> backend = make(device);
        auto sim =
            p.library != nullptr
                ? BasicBatchSimulator<B>::create_from_library(*backend, std::move(p.library),
                                                              std::move(p.config), p.environments,
                                                              std::move(p.next_episode))
                : BasicBatchSimulator<B>::create(*backend, std::move(p.scenes), std::move(p.config),
                                                 p.environments, std::move(p.next_episode));
        if (!sim) return sim.status();
        return std::unique_ptr<BatchEngine>(
            std::make_unique<BatchOn<B>>(std::move(backend), std::move(*sim)));
      },
  };
}

}  // namespace gsnav::detail
