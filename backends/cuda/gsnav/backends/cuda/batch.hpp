// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "gsnav/backends/cuda.hpp"

namespace gsnav {

/// One camera of a batch and what it sees.
struct BatchCamera {
  Camera camera;  ///< The camera.
  /// Indices into the call's sets, each at most once; blended as one list, ties by place in this list.
  /// Empty: all sets, in order. Read during the call only.
  std::span<const std::uint32_t> sets;
  /// Meshes among these Gaussians (docs/reference/composition.md), arrays on the device.
  MeshFrame meshes{};
  /// Selection::seen of each of `sets` (of all sets, where that is empty) for this camera:
  /// cameras that look at one set from several places still share it. Empty: those of the sets. Read
  /// during the call, the bits by the device.
  std::span<const View<const std::uint32_t>> seen{};
};

/// Images of a batch in device memory, [C][H][W] row-major; null: not asked for. They stay on the
/// device: a learner on the same stream reads them without a copy.
struct BatchImages {
  FrameImages<float> floats;  ///< rgb is [C][H][W][3], unclamped
  std::uint8_t* rgb8 =
      nullptr;  ///< [C][H][W][3], round(255 clamp(c, 0, 1)); may stand beside floats.rgb
};

/// What a batch was made of; all cameras together.
struct BatchStats {
  std::uint64_t tile_intersections =
      0;  ///< (tile, Gaussian) pairs; docs/notes/cuda.md says how large tiles are
  std::uint64_t parts_read =
      0;  ///< kChunkPart rows each, that may be in view, counted once for 32 cameras
  std::uint64_t scratch_bytes = 0;  ///< held on the device, without scene and images
  int reruns = 0;                   ///< how often the batch was drawn again because scratch had to grow
  bool replayed = false;  ///< by a recorded CUDA graph: calls that differ in their cameras alone are
  MeshStats meshes;       ///< Counts of the triangles.
};

/// Draws many cameras in one call on one GPU; docs/notes/cuda.md says how. Images have the bits that
/// `BasicRenderer<float, CudaBackend>` gives each camera alone, whatever the batch.
///
///     gsnav::CudaBatchRenderer batch(cuda, config);
///     batch.render(sets, cameras, images).throw_if_error();   // returns at once
///     ...                                                      // work on cuda.stream() may follow
///     batch.finish().throw_if_error();                         // images are there, and whole
///
/// `RenderConfig::outputs` and `RenderConfig::tuning` are not read: pointers say which images, and
/// tiles are of 8 or 16 pixels, as the number of cameras has it.
///
/// Meshes are drawn into a layer for each camera, over which the batch is then blended. As everywhere,
/// `fast` has the exponential of `exact` where there are meshes: in a call with any, for all of its
/// cameras. `supports` tells which frames it can draw, and `capacity` how many at once; `render` refuses
/// the others as unsupported.
class CudaBatchRenderer {
 public:
  using camera_type = BatchCamera;  ///< What the renderer takes for each camera.
  using images_type = BatchImages;  ///< What the renderer returns.

  /// The backend must outlive it; work goes to its stream.
  explicit CudaBatchRenderer(CudaBackend& backend, const RenderConfig& config = {});
  ~CudaBatchRenderer();
  CudaBatchRenderer(const CudaBatchRenderer&) = delete;
  CudaBatchRenderer& operator=(const CudaBatchRenderer&) = delete;

  /// Whether a frame of these sets and meshes can be one of a batch: unsupported, saying why, where a
  /// set has another colour space than the frame, where it has more than 2^32 Gaussians, and of meshes
  /// with Composite::hard_depth, a Response other than ewa, a Compat, or MeshAlpha::blend.
  static Status supports(const RenderConfig& config, std::span<const GaussianSet> sets,
                         const MeshFrame& meshes = {});

  /// How many of `cameras`, from the first on, one call should draw: what counts of 32 bits have room
  /// for and, where each camera takes what those of the last call took, the device's free memory. At
  /// least 1 where there is a camera. `sets` and `cameras` are as for `render`, which draws more where
  /// it can.
  std::size_t capacity(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras) const;

  /// Draws the sets (arrays on the device) from all cameras, which have one size. Enqueues and returns;
  /// images are whole once `finish()` has said ok. Errors: invalid_argument naming camera, set or field,
  /// or where more than three calls would be under way without `finish()`; unsupported; backend_failure.
  /// Throws gsnav::Error (out_of_memory) where scratch cannot be allocated.
  Status render(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                const BatchImages& images);

  /// Waits for every `render` since the last `finish`. Where scratch was too small for the last of them,
  /// grows it and draws that batch again: arrays and images of that call must still be there. Errors:
  /// out_of_memory where it was too small for an earlier one, or for the last and `render` has failed
  /// since: those images are not whole, and there is room for them now; backend_failure; unsupported
  /// naming counts that 32 bits do not hold. Throws as `render` does.
  Status finish();

  /// Of the last batch that `finish()` saw.
  const BatchStats& stats() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gsnav
