// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/detail/core/host_array.hpp"
#include "gsnav/detail/sim/image_renderer.hpp"
#include "gsnav/detail/sim/semantic.hpp"
#include "gsnav/detail/sim/sensor_images.hpp"
#include "gsnav/detail/sim/sensor_plan.hpp"

namespace gsnav {

/// Input of one agent's sensors: its pose, the scene, and its row in the images.
struct SensorView {
  Vec3d base{};                          ///< World position, metres.
  Quatd rotation{};                      ///< Orientation of the agent.
  double pitch = 0.0;                    ///< Tilt of the sensors, radians.
  std::uint64_t noise = 0;               ///< Seed of the noise.
  std::span<const GaussianSet> sets;     ///< Gaussians to draw.
  const RenderConfig* config = nullptr;  ///< Render settings. The sensors choose `outputs`.
  std::size_t row = 0;                   ///< Row of the images.
  MeshFrame meshes{};                    ///< Meshes to draw. Semantic images contain their ids.
  const LeveledScene* levels = nullptr;  ///< Levels of detail and visible sets of the assets, which are
                                         ///< the first of `sets`. Null: draw everything. Semantic
                                         ///< sensors always draw everything.
  std::span<const BodyLevels> bodies{};  ///< Levels of detail of the avatars.

  /// Number of sets and meshes that a semantic sensor distinguishes.
  std::size_t things() const noexcept {
    std::size_t count = 0;
    for (const MeshInstance& m : meshes.instances) count = std::max(count, std::size_t{m.id} + 1);
    return sets.size() + count;
  }
};

/// Turns views into requests for the renderer. Each request writes an image of a sensor, or scratch from
/// which SensorFinish makes the image.
template <Backend B>
class SensorRequests {
 public:
  using Plan = SensorPlan;
  /// A normal sensor, which needs the median depth of its camera.
  struct Normals {
    std::size_t view, group, camera;
    const float* seen;
  };
  /// Coverage of each pixel of one view by each set and mesh.
  struct Shares {
    std::size_t view, buffer;
    std::vector<std::vector<GaussianSet>> sets;  // One per pass.
    std::vector<std::vector<MeshInstance>> meshes;
    std::vector<std::vector<float>> images;
  };

  explicit SensorRequests(B& backend) : semantic_(backend) {}

  /// Makes the requests for all sensors of all views. They write to `images` and to scratch. Valid until
  /// the next call.
  std::span<ImageRequest> make(const Plan& plan, std::span<const SensorView> views,
                               SensorImages<B>& images) {
    cameras_.clear();
    for (const SensorView& v : views) plan.append_cameras(v.base, v.rotation, v.pitch, cameras_);
    requests_.clear();
    normals_.clear();
    size_scratch(plan, views.size());
    prepare_shares(plan, views);
    std::size_t camera = 0;  // First camera of the next group.
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (std::size_t g = 0; g < plan.groups().size(); ++g) {
        if (plan.groups()[g].cube == nullptr) {
          add_pinhole(plan, views[v], v, g, images, camera++);
        } else {
          add_cube(plan, views[v], v, g, camera);
        }
      }
    }
    return requests_;
  }

  /// Number of renders requested so far: one per view and camera (a cube counts as one), and one per
  /// three objects for semantic sensors.
  std::size_t render_count() const noexcept { return render_count_; }

  // The following are results of the last make().
  const Camera& camera(std::size_t i) const noexcept { return cameras_[i]; }
  std::span<const Normals> normals() const noexcept { return normals_; }
  std::span<const Shares> shares() const noexcept { return shares_; }
  /// Images of the faces of a cube.
  std::array<const float*, CubeMap::kFaces> faces(const Plan& plan, std::size_t group, std::size_t kind,
                                                  std::size_t view) const noexcept {
    std::array<const float*, CubeMap::kFaces> at{};
    for (std::size_t f = 0; f < CubeMap::kFaces; ++f)
      at[f] = faces_[group][kind].data() + face_place(*plan.groups()[group].cube, kind, view, f);
    return at;
  }

 private:
  static std::size_t face_place(const CubeMap& cube, std::size_t kind, std::size_t view,
                                std::size_t face) noexcept {
    const std::size_t side = static_cast<std::size_t>(cube.side());
    return (view * CubeMap::kFaces + face) * side * side * Plan::channels(kind);
  }

  void size_scratch(const Plan& plan, std::size_t views) {
    faces_.resize(plan.groups().size());
    seen_.resize(plan.groups().size());
    for (std::size_t g = 0; g < plan.groups().size(); ++g) {
      const Plan::Group& group = plan.groups()[g];
      for (std::size_t k = 0; k < Plan::kKinds && group.cube != nullptr; ++k)
        faces_[g][k].resize(group.has(k) ? face_place(*group.cube, k, views, 0) : 0);
      if (group.has(Plan::kNormal) && !group.has(Plan::kDepth))
        seen_[g].resize(views * plan.size(group.buffer[Plan::kNormal]) / 3);
    }
  }

  /// Allocates scratch for the passes of semantic sensors.
  void prepare_shares(const Plan& plan, std::span<const SensorView> views) {
    shares_.clear();
    share_configs_.clear();
    if (!plan.any(Plan::kSemantic)) return;
    std::size_t most = 0;
    for (const SensorView& v : views) {
      for (const GaussianSet& set : v.sets) most = std::max(most, set.gaussians.size());
      share_configs_.push_back(*v.config);
      share_configs_.back().background = {};
    }
    semantic_.reserve(most);
  }

  void add(const SensorView& view, const Camera& camera, const std::array<float*, Plan::kKinds>& at) {
    FrameImages<float> images;
    images.rgb = at[static_cast<std::size_t>(SensorKind::rgb)];
    images.median_depth = at[Plan::kDepth];
    images.alpha = at[static_cast<std::size_t>(SensorKind::alpha)];
    requests_.push_back(
        {{view.sets, &camera, view.config, images, view.meshes}, view.levels, view.bodies});
  }

  /// Adds the images of pinhole group `g` for view number `v`; `camera`: its index in cameras_.
  void add_pinhole(const Plan& plan, const SensorView& view, std::size_t v, std::size_t g,
                   SensorImages<B>& images, std::size_t camera) {
    const Plan::Group& group = plan.groups()[g];
    std::array<float*, Plan::kKinds> at{};
    bool any = group.has(Plan::kNormal);
    for (std::size_t k = 0; k < Plan::kSemantic; ++k) {
      if (group.has(k)) at[k] = images.row(plan, group.buffer[k], view.row).data();
      any = any || group.has(k);
    }
    if (group.has(Plan::kNormal)) {
      if (!group.has(Plan::kDepth))
        at[Plan::kDepth] = seen_[g].data() + v * plan.size(group.buffer[Plan::kNormal]) / 3;
      normals_.push_back({v, g, camera, at[Plan::kDepth]});
    }
    if (group.has(Plan::kSemantic)) add_shares(plan, view, v, group, cameras_[camera]);
    if (!any) return;
    ++render_count_;
    add(view, cameras_[camera], at);
  }

  void add_cube(const Plan& plan, const SensorView& view, std::size_t v, std::size_t g,
                std::size_t& camera) {
    const Plan::Group& group = plan.groups()[g];
    ++render_count_;
    for (const std::size_t face : group.cube->faces()) {
      std::array<float*, Plan::kKinds> at{};
      for (std::size_t k = 0; k < Plan::kKinds; ++k) {
        if (group.has(k)) at[k] = faces_[g][k].data() + face_place(*group.cube, k, v, face);
      }
      add(view, cameras_[camera++], at);
    }
  }

  void add_shares(const Plan& plan, const SensorView& view, std::size_t v, const Plan::Group& group,
                  const Camera& camera) {
    Shares s{v, group.buffer[Plan::kSemantic], {}, {}, {}};
    for (std::size_t pass = 0; pass < SemanticPasses<B>::count(view.things()); ++pass) {
      s.sets.push_back(semantic_.recolored(view.sets, pass));
      s.meshes.push_back(semantic_.recolored(view.meshes.instances, view.sets.size(), pass));
      FrameImages<float> out;
      out.rgb = s.images.emplace_back(SemanticPasses<B>::kChannels * plan.size(s.buffer)).data();
      requests_.push_back(
          {{s.sets.back(), &camera, &share_configs_[v], out, {s.meshes.back(), view.meshes.light}},
           {},
           {}});
      ++render_count_;
    }
    shares_.push_back(std::move(s));
  }

  SemanticPasses<B> semantic_;
  std::vector<Camera> cameras_;
  std::vector<ImageRequest> requests_;
  std::vector<Normals> normals_;
  std::vector<Shares> shares_;
  std::vector<RenderConfig> share_configs_;  // One per view.
  // Indexed [group][kind][view][face].
  std::vector<std::array<HostArray<float, B>, Plan::kKinds>> faces_;
  std::vector<HostArray<float, B>> seen_;  // Indexed [group][view][pixel], if no sensor of the group has
                                           // depth.
  std::size_t render_count_ = 0;
};

}  // namespace gsnav
