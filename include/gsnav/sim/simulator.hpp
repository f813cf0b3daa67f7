// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/avatar/skinned_gaussians.hpp"
#include "gsnav/scene/renderer.hpp"
#include "gsnav/sim/sensor.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// A cloud and how it stands in the world.
struct SceneAsset {
  std::shared_ptr<const GaussianCloud> cloud;
  Similarity world_from_asset{};
};

/// What a simulator runs in. Shared, never changed: many simulators may use one.
struct SimulatorScene {
  std::vector<SceneAsset> assets;
  std::shared_ptr<const NavMesh> navmesh;
  std::vector<AvatarActor> avatars;
};

struct SimulatorConfig {
  TaskConfig task{};
  std::vector<SensorSpec> sensors;  ///< none: nothing is rendered
  RenderConfig render{};            ///< outputs and sort order are chosen by sensors and scene
  bool rendering = true;            ///< off: physics and metrics only, no image memory
};

/// One sensor's image. Valid until the next step or reset of its simulator.
struct Observation {
  std::string_view uuid;
  SensorKind kind = SensorKind::rgb;
  int height = 0, width = 0, channels = 0;
  std::span<const float> data;  ///< [H][W][channels], row 0 on top
};

/// What the agent perceives after a reset or an action, and what that action did.
struct Observations : StepInfo {
  std::span<const Observation> images;  ///< in the sensors' order; empty without rendering
  PointGoal point_goal{};
  double time = 0.0;  ///< seconds on the scene's clock

  /// The image of sensor `uuid`; empty where there is none.
  std::span<const float> operator[](std::string_view uuid) const noexcept {
    for (const Observation& o : images) {
      if (o.uuid == uuid) return o.data;
    }
    return {};
  }
};

/// A simulator: scene, avatars, agent, sensors and the PointNav task, rendered on backend B.
///
///     auto sim = make_simulator(backend, scene, config).value();
///     auto obs = sim.reset(episode).value();
///     while (!sim.done()) obs = sim.step(policy(obs)).value();
///     auto metrics = sim.metrics();
///
/// During an action avatars and agent move together over one control period; avatars are skinned only
/// when a sensor looks. The same calls give the same bits. The backend must outlive it.
template <Backend B>
class Simulator {
 public:
  /// Errors: invalid_argument (names the field, sensor or asset).
  static Result<Simulator> create(B& backend, SimulatorScene scene, SimulatorConfig config) {
    if (Status s = check(scene, config); !s) return s;
    auto avatars = std::make_shared<const std::vector<AvatarActor>>(std::move(scene.avatars));
    Result<World> world = World::create(
        scene.navmesh, config.task, [avatars](double t0, double t1, std::vector<DynamicCapsule>& out) {
          for (std::size_t i = 0; i < avatars->size(); ++i) {
            (*avatars)[i].dynamic_capsules(t0, t1, static_cast<std::uint32_t>(i), out);
          }
        });
    if (!world) return world.status();
    Simulator sim(backend, std::move(*world), std::move(config), std::move(scene.assets),
                  std::move(avatars));
    return sim;
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

  /// Renders what the agent sees now, without acting.
  Result<Observations> observe() {
    Observations obs;
    static_cast<StepInfo&>(obs) = world_.last_step();
    obs.point_goal = world_.point_goal();
    obs.time = world_.time();
    if (!config_.rendering || groups_.empty()) return obs;
    if (Status s = pose_avatars(); !s) return s;
    for (Group& g : groups_) {
      const SensorSpec& first = config_.sensors[g.sensors.front()];
      const Camera camera = sensor_camera(first, world_.agent().position, world_.agent().rotation());
      if (Status s = render_into(camera, g.outputs, g.frames); !s) return s;
      for (float& z : g.frames.median_depth) z = static_cast<double>(z) > first.far_plane ? 0.0f : z;
      for (const std::size_t i : g.sensors)
        images_[i].data = image_of(config_.sensors[i].kind, g.frames);
    }
    obs.images = images_;
    return obs;
  }

  bool done() const noexcept { return world_.done(); }
  EpisodeMetrics metrics() const { return world_.metrics(); }
  double clock() const noexcept { return world_.time(); }
  const AgentPose& agent() const noexcept { return world_.agent(); }
  const World& world() const noexcept { return world_; }
  const SimulatorConfig& config() const noexcept { return config_; }
  const std::vector<AvatarActor>& avatars() const noexcept { return *avatars_; }

  /// Turns rendering on or off from the next action on.
  void set_rendering(bool on) noexcept { config_.rendering = on; }
  /// Renders made so far: sensors at one place with one field of view count once.
  std::size_t render_count() const noexcept { return render_count_; }

  /// Renders any camera at the present time (a map, a spectator). Images live until the next call.
  Result<const Frames<float>*> render(const Camera& camera, unsigned outputs = kRgb) {
    if (Status s = pose_avatars(); !s) return s;
    if (Status s = render_into(camera, outputs, spectator_); !s) return s;
    return &spectator_;
  }

 private:
  struct Group {  // sensors that share a camera
    std::vector<std::size_t> sensors;
    unsigned outputs = 0;
    Frames<float> frames;
  };

  Simulator(B& backend, World world, SimulatorConfig config, std::vector<SceneAsset> assets,
            std::shared_ptr<const std::vector<AvatarActor>> avatars)
      : world_(std::move(world)),
        config_(std::move(config)),
        assets_(std::move(assets)),
        avatars_(std::move(avatars)),
        renderer_(backend) {
    for (const SceneAsset& a : assets_) {
      arrays_.emplace_back(backend, *a.cloud);
      sets_.push_back(arrays_.back().set(a.world_from_asset));
    }
    for (const AvatarActor& actor : *avatars_) skins_.emplace_back(backend, actor.asset());
    if (!assets_.empty()) config_.render.sort_order = assets_.front().cloud->sort_order;
    for (std::size_t i = 0; i < config_.sensors.size(); ++i) {
      const SensorSpec& spec = config_.sensors[i];
      Group* group = nullptr;
      for (Group& g : groups_) {
        if (same_camera(config_.sensors[g.sensors.front()], spec)) group = &g;
      }
      if (group == nullptr) group = &groups_.emplace_back();
      group->sensors.push_back(i);
      group->outputs |= output_of(spec.kind);
      images_.push_back({config_.sensors[i].uuid,
                         spec.kind,
                         spec.resolution[0],
                         spec.resolution[1],
                         spec.kind == SensorKind::rgb ? 3 : 1,
                         {}});
    }
  }

  static Status check(const SimulatorScene& scene, const SimulatorConfig& config) {
    const auto bad = [](const std::string& what) { return Status(Errc::invalid_argument, what); };
    if (scene.navmesh == nullptr) return bad("SimulatorScene.navmesh is null");
    for (std::size_t i = 0; i < scene.assets.size(); ++i) {
      if (scene.assets[i].cloud == nullptr)
        return bad("SimulatorScene.assets[" + std::to_string(i) + "].cloud is null");
    }
    if (Status s = validate(config.task); !s) return s;
    if (Status s = validate(config.render); !s) return s;
    for (std::size_t i = 0; i < config.sensors.size(); ++i) {
      if (Status s = validate(config.sensors[i]); !s) return s;
      for (std::size_t j = 0; j < i; ++j) {
        if (config.sensors[i].uuid == config.sensors[j].uuid) {
          return bad("SensorSpec.uuid \"" + config.sensors[i].uuid + "\" is used twice");
        }
      }
    }
    return {};
  }

  static unsigned output_of(SensorKind kind) noexcept {
    return kind == SensorKind::rgb ? kRgb : (kind == SensorKind::depth ? kMedianDepth : kAlpha);
  }

  static std::span<const float> image_of(SensorKind kind, const Frames<float>& f) noexcept {
    return kind == SensorKind::rgb ? f.rgb : (kind == SensorKind::depth ? f.median_depth : f.alpha);
  }

  Status pose_avatars() {
    if (posed_ && posed_time_ == world_.time()) return {};
    sets_.resize(assets_.size());
    for (std::size_t i = 0; i < skins_.size(); ++i) {
      if (Status s = skins_[i].pose((*avatars_)[i], world_.time()); !s) return s;
      sets_.push_back(skins_[i].set());
    }
    posed_ = true;
    posed_time_ = world_.time();
    return {};
  }

  Status render_into(const Camera& camera, unsigned outputs, Frames<float>& frames) {
    RenderConfig rc = config_.render;
    rc.outputs = outputs;
    renderer_.set_config(rc);
    ++render_count_;
    return renderer_.render(sets_, std::span(&camera, 1), frames);
  }

  World world_;
  SimulatorConfig config_;
  std::vector<SceneAsset> assets_;
  std::shared_ptr<const std::vector<AvatarActor>> avatars_;
  Renderer<float, B> renderer_;
  std::vector<GaussianArrays<B>> arrays_;
  std::vector<SkinnedGaussians<B>> skins_;
  std::vector<GaussianSet> sets_;  // assets first, then avatars
  std::vector<Group> groups_;
  std::vector<Observation> images_;
  Frames<float> spectator_;
  std::size_t render_count_ = 0;
  double posed_time_ = 0.0;
  bool posed_ = false;
};

/// Simulator<B>::create with B deduced.
template <Backend B>
Result<Simulator<B>> make_simulator(B& backend, SimulatorScene scene, SimulatorConfig config) {
  return Simulator<B>::create(backend, std::move(scene), std::move(config));
}

}  // namespace gsnav
