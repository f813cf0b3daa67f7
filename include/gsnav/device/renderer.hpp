// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/lod_settings.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/render/frames.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/lod_tree.hpp"
#include "gsnav/sim/scene.hpp"

namespace gsnav {

struct VisibleSettings;

namespace detail {
class RendererEngine;
}

/// Settings of a Renderer.
struct RenderOptions {
  RenderConfig render{};  ///< Settings of each frame. Its sort order is ignored: the scene has one.
  DetailChoice detail{};  ///< Levels of detail and visible sets to use. The scene must have them.
};

/// Renders a scene on any device: Gaussians, meshes and avatars in one image.
///
/// The renderer keeps the scene in the device's memory, and its scratch memory between calls. It owns or
/// shares all that it needs, so arguments need not outlive a call (docs/reference/ownership.md). Images
/// have the same bits as those of `BasicRenderer<float, B>`, where B is the device's backend. Not
/// thread-safe: calls of one renderer must not overlap. After a move, the old object returns
/// invalid_argument.
///
/// @code
/// auto device = gsnav::Device::parse("best").value();
/// auto renderer = gsnav::Renderer::create(device, cloud).value();
/// auto frames = renderer.render(camera).value();   // frames.rgb, frames.median_depth, ...
/// @endcode
class Renderer {
 public:
  /// Creates a renderer that shares `scene`. The scene needs no NavMesh.
  /// @return invalid_argument naming the part or field; unsupported if the device is not available;
  ///   out_of_memory; backend_failure.
  static Result<Renderer> create(const Device& device, std::shared_ptr<const SimulatorScene> scene,
                                 RenderOptions options = {});
  /// Creates a renderer that owns `cloud`, placed at the world's origin. Pass std::move(cloud) to avoid
  /// a copy.
  /// @return the errors of the overload above.
  static Result<Renderer> create(const Device& device, GaussianCloud cloud, RenderOptions options = {});
  /// Takes over the renderer of the argument.
  Renderer(Renderer&&) noexcept;
  /// Takes over the renderer of the argument.
  Renderer& operator=(Renderer&&) noexcept;
  /// Frees the device's memory.
  ~Renderer();

  /// Renders one frame per camera. Makes the images named by RenderConfig::outputs. On CPUs it also
  /// fills Frames::stats.
  /// @param cameras at least one, all of the same image size
  /// @param out images, resized as needed
  /// @param time seconds on the scene's clock, at which avatars are posed
  /// @return invalid_argument naming the field, or if there are no cameras or their sizes differ;
  ///   unsupported; out_of_memory; backend_failure.
  Status render(std::span<const Camera> cameras, Frames<float>& out, double time = 0);
  /// Renders one frame per camera and returns the images. Errors as above.
  Result<Frames<float>> render(std::span<const Camera> cameras, double time = 0);
  /// Renders one camera and returns its images. Errors as above.
  Result<Frames<float>> render(const Camera& camera, double time = 0);

  /// Device that the renderer runs on.
  const Device& device() const noexcept { return device_; }
  /// Replaces the settings of all later frames.
  /// @return invalid_argument naming the field.
  Status set_config(const RenderConfig& config);
  /// Replaces SimulatorScene::light as the light on the scene's meshes, for all later frames.
  /// @return invalid_argument naming the field.
  Status set_light(const MeshLight& light);

 private:
  Renderer(const Device& device, std::unique_ptr<detail::RendererEngine> engine) noexcept;

  Device device_;
  std::unique_ptr<detail::RendererEngine> engine_;
};

/// Builds a level-of-detail tree: build_lod (scene/lod_tree.hpp), compiled. It runs on the device's
/// threads; for a GPU, on the threads of the CPU.
/// @return the errors of build_lod.
Result<LodTree> build_lod(const Device& device, const GaussianCloud& cloud,
                          const LodSettings& settings = {});
/// Builds visible sets: build_visible_sets (scene/visible_sets.hpp), compiled. A GPU weighs the
/// Gaussians of each viewpoint. The sets have the same bits on every device.
/// @return the errors of build_visible_sets.
Result<VisibleSets> build_visible_sets(const Device& device, const GaussianCloud& cloud,
                                       std::span<const Vec3d> viewpoints,
                                       const VisibleSettings& settings,
                                       const Similarity& world_from_asset = {});

namespace eval {

struct OracleConfig;
struct OracleFrames;

/// Renders the float64 reference image of sets of Gaussians: oracle_render (eval/oracle.hpp), compiled.
/// It runs on the device's threads; for a GPU, on the threads of the CPU.
/// @return the errors of oracle_render.
Result<OracleFrames> oracle_render(const Device& device, std::span<const GaussianSet> sets,
                                   const Camera& camera, const OracleConfig& config);
/// Renders the reference image with k times the resolution and averages it: oracle_photo, compiled. It
/// runs where oracle_render does.
/// @return the errors of oracle_photo.
Result<OracleFrames> oracle_photo(const Device& device, std::span<const GaussianSet> sets,
                                  const Camera& camera, int k, const OracleConfig& config);

}  // namespace eval

}  // namespace gsnav
