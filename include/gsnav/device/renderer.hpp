// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "gsnav/core/status.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/render/frames.hpp"
#include "gsnav/sim/scene.hpp"

namespace gsnav {

struct VisibleSettings;

namespace detail {
class RendererEngine;
}

/// How a scene is drawn.
struct RenderOptions {
  RenderConfig render{};  ///< its sort order is the scene's
  DetailChoice detail{};  ///< levels of detail, visible sets: the scene must have them
};

/// Renders a scene on any device: Gaussians, meshes and avatars in one image. It holds the scene in the
/// device's memory and keeps its scratch between calls. Images have the bits of BasicRenderer<float, B>,
/// where B is the device's backend. It may be moved; one that was moved from answers with
/// invalid_argument. Calls of one renderer must not overlap. Nothing that it is given must outlive a
/// call (docs/ownership.md).
///
///     auto device = gsnav::Device::parse("best").value();
///     auto renderer = gsnav::Renderer::create(device, cloud).value();
///     auto frames = renderer.render(camera).value();   // frames.rgb, frames.median_depth, ...
class Renderer {
 public:
  /// Shares the scene, which needs no NavMesh. Errors: invalid_argument naming the part or the field;
  /// unsupported where the device is not there; out_of_memory; backend_failure.
  static Result<Renderer> create(const Device& device, std::shared_ptr<const SimulatorScene> scene,
                                 RenderOptions options = {});
  /// Owns a cloud, placed at the world's origin: pass std::move(cloud) to save the copy. Errors: the
  /// same as above.
  static Result<Renderer> create(const Device& device, GaussianCloud cloud, RenderOptions options = {});
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  /// Renders from each camera, which have one size, with avatars where they are at `time`, seconds on
  /// the scene's clock. Images are those that RenderConfig::outputs names; CPUs fill Frames::stats.
  /// Errors: invalid_argument naming the field, no camera, or cameras of several sizes; unsupported;
  /// out_of_memory; backend_failure.
  Status render(std::span<const Camera> cameras, Frames<float>& out, double time = 0);
  Result<Frames<float>> render(std::span<const Camera> cameras, double time = 0);
  Result<Frames<float>> render(const Camera& camera, double time = 0);

  /// The device that it runs on.
  const Device& device() const noexcept { return device_; }
  /// The rules that frames are drawn by from now on.
  Status set_config(const RenderConfig& config);
  /// The light on the scene's meshes from now on, in place of SimulatorScene::light.
  Status set_light(const MeshLight& light);

 private:
  Renderer(const Device& device, std::unique_ptr<detail::RendererEngine> engine) noexcept;

  Device device_;
  std::unique_ptr<detail::RendererEngine> engine_;
};

/// build_lod, and build_visible_sets (scene/visible_sets.hpp), compiled: by the device's threads, or of
/// a GPU by the CPU's. Errors: theirs.
Result<LodTree> build_lod(const Device& device, const GaussianCloud& cloud,
                          const LodSettings& settings = {});
/// Finds what can be seen of a cloud from around the viewpoints. Errors: invalid_argument, unsupported,
/// out_of_memory.
Result<VisibleSets> build_visible_sets(const Device& device, const GaussianCloud& cloud,
                                       std::span<const Vec3d> viewpoints,
                                       const VisibleSettings& settings,
                                       const Similarity& world_from_asset = {});

}  // namespace gsnav
