// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "gsnav/sim/batch_world.hpp"
#include "gsnav/sim/simulator.hpp"

namespace gsnav {

/// One sensor's images of all environments, [environments][height][width][channels]. Valid until the next call.
struct BatchObservation {
  std::string_view uuid;
  SensorKind kind = SensorKind::rgb;
  std::size_t environments = 0;
  int height = 0, width = 0, channels = 0;
  std::span<const float> data;

  /// The image of one environment (of a finished one: by its place in BatchStep::finished).
  std::span<const float> of(std::size_t environment) const noexcept {
    const std::size_t n = data.size() / environments;
    return data.subspan(environment * n, n);
  }
};

/// What Gymnasium's VectorEnv returns: observations, rewards, terminated, truncated and what else there is to know.
struct BatchStep : BatchInfo {
  std::span<const BatchObservation> images;  ///< in the sensors' order; empty without rendering
  /// The last images of episodes that ended in this step and whose environments were reset in it, a row for each of
  /// `finished`; only with AutoReset::same_step.
  std::span<const BatchObservation> final_images;
};

struct BatchConfig : SimulatorConfig {
  AutoReset auto_reset = AutoReset::next_step;
  /// Times of a scene for which its avatars are held posed at once; more are drawn one after the other. Memory grows
  /// with it.
  std::size_t pose_slots = 8;
};

/// N environments over M scenes that they share: what N Simulators would do, bit for bit, by one call.
///
///     auto sim = make_batch_simulator(backend, scenes, config, 256, episode_of).value();
///     auto out = sim.reset().value();
///     while (running) out = sim.step(policy(out)).value();
///
/// Environment e draws its sensors' noise with seed + e. Environments that are in one scene at one time share its
/// avatars' capsules and skinned Gaussians. Scenes are held once, however many environments look at them. The backend
/// must outlive it. After an error reset() begins anew.
template <Backend B>
class BatchSimulator {
 public:
  /// `next_episode` is asked for each episode of each environment; see EpisodeSource. Errors: invalid_argument (names
  /// the field, sensor or scene).
  static Result<BatchSimulator> create(B& backend, std::vector<std::shared_ptr<const SimulatorScene>> scenes,
                                       BatchConfig config, std::size_t environments, EpisodeSource next_episode) {
    for (const auto& scene : scenes) {
      if (scene == nullptr) return {Errc::invalid_argument, "BatchSimulator: a scene is null"};
      if (Status s = validate(*scene); !s) return s;
    }
    if (Status s = validate(static_cast<const SimulatorConfig&>(config)); !s) return s;
    if (config.pose_slots < 1) return {Errc::invalid_argument, "BatchConfig.pose_slots = 0: must be >= 1"};
    std::vector<BatchScene> parts;
    for (const auto& scene : scenes) {
      parts.push_back({scene->navmesh, [scene](double t0, double t1, auto& out) { append_bodies(*scene, t0, t1, out); }});
    }
    auto worlds = BatchWorld::create(std::move(parts), config.task, config.auto_reset, environments, std::move(next_episode));
    if (!worlds) return worlds.status();
    return BatchSimulator(backend, std::move(*worlds), std::move(config), std::move(scenes));
  }

  std::size_t environments() const noexcept { return worlds_.size(); }
  const World& world(std::size_t environment) const noexcept { return worlds_.world(environment); }
  std::size_t scene_of(std::size_t environment) const noexcept { return worlds_.scene_of(environment); }

  /// Begins the next episode in every environment or, with a mask [N], in those where it is not 0.
  /// Errors: what the episode source and World::reset report; rendering.
  Result<BatchStep> reset(std::span<const std::uint8_t> mask = {}) {
    if (Status s = worlds_.reset(parallel(), mask); !s) return s;
    return observe(mask.empty());
  }

  /// One action for each environment, [N]. Errors: invalid_argument (another number of actions; an environment that is
  /// done, with AutoReset::disabled; before reset), with the environment's number; what World::step reports; rendering.
  Result<BatchStep> step(std::span<const Action> actions) {
    const auto draw_final = [this] { return observe_finished(); };
    if (Status s = worlds_.step(parallel(), actions, draw_final); !s) return s;
    return observe(false);
  }

  /// Renders made so far, and how many times an avatar was skinned for them.
  std::size_t render_count() const noexcept { return rig_.render_count(); }
  std::size_t pose_count() const noexcept {
    std::size_t sum = 0;
    for (const auto& s : scenes_) sum += s->pose_count();
    return sum;
  }
  void set_rendering(bool on) noexcept { config_.rendering = on; }

 private:
  BatchSimulator(B& backend, BatchWorld worlds, BatchConfig config,
                 std::vector<std::shared_ptr<const SimulatorScene>> scenes)
      : backend_(&backend), worlds_(std::move(worlds)), config_(std::move(config)), rig_(backend, config_.sensors) {
    for (auto& scene : scenes) {
      scenes_.push_back(std::make_unique<SceneOnBackend<B>>(backend, std::move(scene)));
      render_configs_.push_back(scenes_.back()->render_config(config_.render));
    }
    for (const SensorSpec& s : config_.sensors) {
      images_.push_back({s.uuid, s.kind, 0, s.resolution[0], s.resolution[1], channels_of(s.kind), {}});
    }
    final_images_ = images_;
  }

  auto parallel() noexcept {
    return [this](std::size_t n, const auto& f) {
      if constexpr (is_host_backend<B>) {
        backend_->parallel_for(n, f);
      } else {
        for (std::size_t i = 0; i < n; ++i) f(i);
      }
    };
  }

  Result<BatchStep> observe(bool all) {
    BatchStep out;
    static_cast<BatchInfo&>(out) = worlds_.info();
    if (!config_.rendering || images_.empty()) return out;
    rig_.resize(buffers_, environments());
    lookers_.clear();
    for (std::size_t e = 0; e < environments(); ++e) {
      if (all || worlds_.moved(e)) lookers_.push_back({e, e});
    }
    if (Status s = draw(buffers_); !s) return s;
    fill(images_, buffers_);
    out.images = images_;
    if (worlds_.auto_reset() == AutoReset::same_step && !worlds_.info().finished.empty()) out.final_images = final_images_;
    return out;
  }

  /// The last images of the episodes that ended, before their environments go on.
  Status observe_finished() {
    if (!config_.rendering || images_.empty()) return {};
    const std::span<const std::size_t> finished = worlds_.info().finished;
    rig_.resize(final_buffers_, finished.size());
    lookers_.clear();
    for (std::size_t i = 0; i < finished.size(); ++i) lookers_.push_back({finished[i], i});
    if (Status s = draw(final_buffers_); !s) return s;
    fill(final_images_, final_buffers_);
    return {};
  }

  void fill(std::vector<BatchObservation>& images, const SensorImages& buffers) const {
    for (std::size_t i = 0; i < images.size(); ++i) {
      images[i].environments = buffers.rows;
      images[i].data = rig_.all(buffers, i);
    }
  }

  struct Looker {
    std::size_t environment, row;
  };

  /// Draws `lookers_` into their rows: as many times of the scenes at once as there are slots for.
  Status draw(SensorImages& images) {
    // Where nobody walks all times are one.
    const auto key = [this](const Looker& l) {
      const std::size_t scene = worlds_.scene_of(l.environment);
      return std::pair(scene, scenes_[scene]->scene().avatars.empty() ? 0.0 : world(l.environment).time());
    };
    std::stable_sort(lookers_.begin(), lookers_.end(), [&](const Looker& a, const Looker& b) { return key(a) < key(b); });
    views_.clear();
    std::vector<std::size_t> used(scenes_.size());  // slots of each scene
    std::size_t times = 0;
    for (std::size_t first = 0, last = 0; first < lookers_.size(); first = last) {
      const auto here = key(lookers_[first]);
      while (last < lookers_.size() && key(lookers_[last]) == here) ++last;
      if (Status s = add_views(first, last, used[here.first]++); !s) return s;
      if (++times < config_.pose_slots && last < lookers_.size()) continue;
      if (Status s = rig_.render(views_, images); !s) return s;
      views_.clear();
      std::fill(used.begin(), used.end(), std::size_t{0});
      times = 0;
    }
    return {};
  }

  /// Views of lookers that share a scene and a time; its avatars are posed for them.
  Status add_views(std::size_t first, std::size_t last, std::size_t slot) {
    const std::size_t scene = worlds_.scene_of(lookers_[first].environment);
    const RenderConfig& config = render_configs_[scene];
    cameras_.clear();
    for (std::size_t i = first; i < last; ++i) {
      const AgentPose& agent = world(lookers_[i].environment).agent();
      rig_.append_cameras(agent.position, agent.rotation(), agent.pitch, cameras_);
    }
    SceneOnBackend<B>& posed = *scenes_[scene];
    if (Status s = posed.pose(slot, world(lookers_[first].environment).time(), cameras_, config); !s) return s;
    for (std::size_t i = first; i < last; ++i) {
      const std::size_t e = lookers_[i].environment;
      const AgentPose& agent = world(e).agent();
      views_.push_back({agent.position, agent.rotation(), agent.pitch,
                        noise_seed(config_.seed + e, world(e).state()), posed.sets(slot), &config, lookers_[i].row});
    }
    return {};
  }

  B* backend_;
  BatchWorld worlds_;
  BatchConfig config_;
  SensorRig<B> rig_;
  std::vector<std::unique_ptr<SceneOnBackend<B>>> scenes_;
  std::vector<RenderConfig> render_configs_;
  SensorImages buffers_, final_buffers_;
  std::vector<BatchObservation> images_, final_images_;
  std::vector<Looker> lookers_;
  std::vector<SensorView> views_;
  std::vector<Camera> cameras_;
};

/// BatchSimulator<B>::create with B deduced.
template <Backend B>
Result<BatchSimulator<B>> make_batch_simulator(B& backend, std::vector<std::shared_ptr<const SimulatorScene>> scenes,
                                               BatchConfig config, std::size_t environments, EpisodeSource next_episode) {
  return BatchSimulator<B>::create(backend, std::move(scenes), std::move(config), environments, std::move(next_episode));
}

}  // namespace gsnav
