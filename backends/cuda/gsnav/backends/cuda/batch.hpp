// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "gsnav/backends/cuda.hpp"

namespace gsnav {

/// One camera of a batch and the sets that it sees.
struct BatchCamera {
  /// The camera.
  Camera camera;
  /// Indices into the sets of the call, each at most once. They are blended in one depth order; equal
  /// depths are ordered by position in this list. Empty: all sets in order. Read during the call only.
  std::span<const std::uint32_t> sets;
  /// Meshes to composite with these Gaussians (docs/reference/composition.md). Arrays are in device
  /// memory.
  MeshFrame meshes{};
  /// Selection::seen of each of `sets` (of all sets if that is empty) for this camera. It lets cameras
  /// at different positions share one set. Empty: use the sets' own. Read during the call; the bits are
  /// in device memory.
  std::span<const View<const std::uint32_t>> seen{};
};

/// Output images of a batch in device memory, shape [cameras][height][width], row-major. Null pointers
/// are not written. A learner on the same stream can read the images without a copy.
struct BatchImages {
  FrameImages<float> floats;  ///< Float images. `rgb` has shape [cameras][height][width][3] and is not
                              ///< clamped.
  std::uint8_t* rgb8 = nullptr;  ///< Shape [cameras][height][width][3]: round(255 clamp(c, 0, 1)). May
                                 ///< be combined with floats.rgb.
};

/// Statistics of a batch, summed over all cameras.
struct BatchStats {
  std::uint64_t tile_intersections =
      0;  ///< Number of (tile, Gaussian) pairs. See docs/notes/cuda.md for the size of tiles.
          ///< With lists of regions, of (region, Gaussian) pairs.
  std::uint64_t parts_read = 0;  ///< Number of parts (kChunkPart rows) that may be in view, counted once
                                 ///< per 32 cameras. With lists of regions, 0.
  std::uint64_t scratch_bytes = 0;  ///< Device memory for scratch, in bytes, without scene and images.
  std::uint32_t parts_given = 0;  ///< Parts of tiles that a warp began and another one finished. Depends
                                  ///< on timing. Without lists of regions, 0.
  int reruns = 0;                 ///< How often the batch was drawn again because scratch had to grow.
  bool replayed = false;    ///< True if a recorded CUDA graph was replayed. Calls that differ only in
                            ///< their cameras are replayed.
  bool by_regions = false;  ///< True if the batch was drawn by lists of regions (docs/notes/cuda.md).
  MeshStats meshes;         ///< Statistics of the meshes.
};

/// Renders many cameras in one call on one GPU, or one (docs/notes/cuda.md). Images are bit-identical to
/// those of draw_frame for each camera alone, whatever the batch. `BasicRenderer<float, CudaBackend>`
/// draws by it.
///
/// @code
/// gsnav::CudaBatchRenderer batch(cuda, config);
/// batch.render(sets, cameras, images).throw_if_error();  // returns at once
/// // more work on cuda.stream() may follow
/// batch.finish().throw_if_error();                       // images are complete
/// @endcode
///
/// `RenderConfig::outputs` and `RenderConfig::tuning` are ignored. The pointers in BatchImages select
/// the images. Tiles are 8 or 16 pixels wide, depending on the number of cameras.
///
/// Meshes are drawn into a layer per camera, and the batch is then blended over it. If any camera of a
/// call has meshes, `fast` uses the exponential of `exact` for all its cameras. With
/// Composite::hard_depth, the batch is drawn without meshes, and then each pixel takes one of both.
/// There, all cameras of a call have meshes or none has. `supports` tells which frames can be part of a
/// batch, and `capacity` how many fit into one call. `render` rejects other frames as unsupported.
class CudaBatchRenderer {
 public:
  /// Type of a camera of a batch.
  using camera_type = BatchCamera;
  /// Type of the output images.
  using images_type = BatchImages;

  /// Creates a renderer. The backend must outlive it. Work goes to the backend's stream.
  explicit CudaBatchRenderer(CudaBackend& backend, const RenderConfig& config = {});
  /// Waits for the work and frees the resources.
  ~CudaBatchRenderer();
  CudaBatchRenderer(const CudaBatchRenderer&) = delete;
  CudaBatchRenderer& operator=(const CudaBatchRenderer&) = delete;

  /// Checks whether a frame with these sets and meshes can be part of a batch.
  /// @return unsupported, with the reason, if a set has another colour space than the frame or more than
  /// 2^32 Gaussians, or, with meshes, for a Response other than ewa, a Compat, or MeshAlpha::blend.
  static Status supports(const RenderConfig& config, std::span<const GaussianSet> sets,
                         const MeshFrame& meshes = {});

  /// Number of cameras, from the first on, that one call should render. It is limited by 32-bit counts
  /// and by the free device memory, assuming the mean consumption of the last call's cameras.
  /// At least 1 if there are cameras. `render` accepts more if it can.
  std::size_t capacity(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras) const;

  /// Renders the sets from all cameras, which must have one size. Arrays are in device memory. Enqueues
  /// the work and returns; images are complete when finish() has returned ok.
  /// @return invalid_argument, with camera, set or field, or if more than three calls are in progress
  /// without finish(); unsupported; backend_failure.
  /// Throws gsnav::Error (out_of_memory) if scratch cannot be allocated.
  Status render(std::span<const GaussianSet> sets, std::span<const BatchCamera> cameras,
                const BatchImages& images);

  /// Measures, in place of images, the largest share of a pixel's light that each Gaussian of a set
  /// contributes to any image of a group of cameras (add_row_weights, with the same bits if `config` is
  /// weighing_config(), detail/render/row_weights.hpp). Like render(), it enqueues the work and returns.
  /// @param set one that draws all its chunks. Arrays are in device memory.
  /// @param cameras groups of `cameras_of_group` cameras, one after the other. All have one size.
  /// @param most [groups][set.gaussians.size()], shares in [0, 1], in device memory; it is overwritten.
  /// @return the errors of render(); invalid_argument if `most` is null, if the number of cameras is no
  /// multiple of cameras_of_group, if a camera has meshes, or for another Response than ewa or a Compat.
  /// Throws like render().
  Status weigh(const GaussianSet& set, std::span<const BatchCamera> cameras,
               std::size_t cameras_of_group, float* most);

  /// Waits for all calls of render() and weigh() since the last finish(). If scratch was too small for
  /// the last of them, it grows and that batch is rendered again, so its arrays and images must still
  /// exist.
  /// @return out_of_memory if scratch was too small for an earlier call, or for the last one and a later
  /// render() failed. Those images are incomplete; scratch is large enough now. Also backend_failure, or
  /// unsupported if a count exceeds 32 bits.
  /// Throws like render().
  Status finish();

  /// Sets the fewest cameras of a call that is drawn by lists of regions, and the fewest Gaussians that
  /// each of them must see on average. It changes the time of a call and no bit of an image. Default:
  /// policy::Regions::kLeastCameras and kLeastGaussians.
  void set_least_of_regions(std::size_t cameras, std::uint64_t gaussians) noexcept;

  /// Sets when a warp that draws a tile of such a call gives half of it to an idle warp: the fewest
  /// pairs of pixels that are open (2 or more), and the fewest rows of its list that are left. `always`:
  /// even if no warp is idle. It changes the time of a call and no bit of an image. Default:
  /// policy::Regions::kLeastPairs and kLeastRows.
  void set_least_of_parts(std::uint32_t pairs, std::uint32_t rows, bool always = false) noexcept;

  /// Statistics of the last batch that finish() has completed.
  const BatchStats& stats() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gsnav
