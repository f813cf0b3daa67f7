// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gsnav/avatar/skinned_gaussians.hpp"
#include "gsnav/detail/scene/temporal_gaussians.hpp"
#include "gsnav/detail/sim/scene_on_backend.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/mesh_scene.hpp"
#include "gsnav/scene/packed_cloud.hpp"

// Scenes in every storage and with every selection of rows, and how they come to a backend.

namespace gsnav_test {

/// One set of Gaussians. Exactly one of cloud, packed and moving is there.
struct Stored {
  std::shared_ptr<const gsnav::GaussianCloud> cloud{};
  std::shared_ptr<const gsnav::PackedCloud> packed{};
  std::shared_ptr<const gsnav::TemporalCloud> moving{};  ///< drawn as it is at 0.4 s, on host backends
  gsnav::Similarity place{};
  bool as_factors = false;            ///< shapes by ShapeRows::axes in place of quats and scales
  std::vector<std::uint32_t> seen{};  ///< Selection::seen
};

/// What is drawn, and how.
struct ImageScene {
  std::string name;
  std::vector<Stored> sets{};
  std::vector<gsnav::AvatarActor> people{};
  std::shared_ptr<const gsnav::SimulatorScene>
      detailed{};  ///< in place of sets and people: drawn by `choice`
  gsnav::DetailChoice choice{};
  std::shared_ptr<const gsnav::MeshScene> meshes{};
  gsnav::Camera camera{};
  gsnav::RenderConfig config{};
  bool on_device = true;
  bool in_batches = true;  ///< CudaBatchRenderer draws it
};

/// Every scene there is; made once.
const std::vector<ImageScene>& image_scenes();

/// A scene in the memory of a backend.
template <gsnav::Backend B>
class SceneThere {
 public:
  SceneThere(B& backend, const ImageScene& scene) : backend_(backend), chunks_(backend) {
    using namespace gsnav;
    for (const Stored& s : scene.sets) sets_.push_back(load(s));
    for (const AvatarActor& actor : scene.people) {
      people_.push_back(std::make_unique<SkinnedGaussians<B>>(backend, actor.asset()));
      people_.back()->pose(actor, 0.4).throw_if_error();
      sets_.push_back(people_.back()->set());
    }
    for (std::size_t i = 0; scene.meshes != nullptr && i < scene.meshes->size(); ++i) {
      mesh_arrays_.push_back(std::make_unique<MeshArrays<B>>(backend, scene.meshes->view(i)));
      instances_.push_back(mesh_arrays_.back()->instance({}, static_cast<std::uint32_t>(i)));
    }
    config_ = scene.config;
    if (scene.detailed == nullptr) return;
    detailed_ = std::make_unique<SceneOnBackend<B>>(backend, scene.detailed, scene.choice);
    detailed_->pose(0, 0.4).throw_if_error();
    chosen_.select(*detailed_->levels(), detailed_->sets(0), scene.camera);
    config_ = chosen_.rules(config_);
    chunks_.place(std::span(&chosen_, 1));
    sets_.assign(chosen_.sets().begin(), chosen_.sets().end());
  }

  const std::vector<gsnav::GaussianSet>& sets() const noexcept { return sets_; }
  const std::vector<gsnav::MeshInstance>& meshes() const noexcept { return instances_; }
  const gsnav::RenderConfig& config() const noexcept { return config_; }

 private:
  gsnav::GaussianSet load(const Stored& s) {
    using namespace gsnav;
    GaussianSet set;
    if (s.moving != nullptr) {
      set = load_moving(*s.moving, s.place);
    } else {
      arrays_.push_back(s.packed != nullptr ? std::make_unique<GaussianArrays<B>>(backend_, *s.packed)
                                            : std::make_unique<GaussianArrays<B>>(backend_, *s.cloud));
      set = arrays_.back()->set(s.place);
    }
    if (s.as_factors) give_factors(*s.cloud, set.gaussians.shape);
    if (!s.seen.empty()) set.selection.seen = there(words_, s.seen);
    return set;
  }
  gsnav::GaussianSet load_moving(const gsnav::TemporalCloud& cloud, const gsnav::Similarity& place) {
    if constexpr (gsnav::is_host_backend<B>) {
      moving_.push_back(std::make_unique<gsnav::TemporalGaussians<B>>(backend_, cloud));
      moving_.back()->set_time(0.4).throw_if_error();
      return moving_.back()->set(place);
    } else {
      gsnav::Status(gsnav::Errc::unsupported, "tests: a moving scene is drawn on host backends")
          .throw_if_error();
      return {};
    }
  }
  void give_factors(const gsnav::GaussianCloud& cloud, gsnav::ShapeRows& shape) {
    const gsnav::ShapeRows rows = cloud.view().shape;
    for (std::size_t k = 0; k < 9; ++k) {
      std::vector<float> plane(rows.size);
      for (std::size_t i = 0; i < rows.size; ++i) {
        plane[i] = gsnav::rotation_matrix(gsnav::quat_of(rows, i)).row[k / 3][static_cast<int>(k % 3)] *
                   rows.scales[k % 3][i];
      }
      shape.axes.set(k, there(floats_, plane));
    }
  }
  /// A copy in the backend's memory.
  template <class T>
  gsnav::View<const T> there(std::vector<gsnav::Buffer<T, B>>& held, const std::vector<T>& values) {
    held.emplace_back(backend_).upload(values.data(), values.size());
    return {held.back().data(), values.size()};
  }

  B& backend_;
  std::vector<std::unique_ptr<gsnav::GaussianArrays<B>>> arrays_;
  std::vector<std::unique_ptr<gsnav::TemporalGaussians<B>>> moving_;
  std::vector<std::unique_ptr<gsnav::SkinnedGaussians<B>>> people_;
  std::vector<std::unique_ptr<gsnav::MeshArrays<B>>> mesh_arrays_;
  std::vector<gsnav::Buffer<float, B>> floats_;
  std::vector<gsnav::Buffer<std::uint32_t, B>> words_;
  std::unique_ptr<gsnav::SceneOnBackend<B>> detailed_;
  gsnav::CutSets chosen_;
  gsnav::ChosenChunks<B> chunks_;
  std::vector<gsnav::GaussianSet> sets_;
  std::vector<gsnav::MeshInstance> instances_;
  gsnav::RenderConfig config_;
};

}  // namespace gsnav_test
