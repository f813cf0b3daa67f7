// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "gsnav/backends/cuda.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// OpenGL texture that device images are written to, without a copy through the host. Link
/// gsnav::cuda_gl.
///
/// @code
/// // The texture's OpenGL context is current in this thread.
/// GlImage image = GlImage::create(cuda, texture, 640, 480).value();
/// batch.render(sets, cameras, images).throw_if_error();
/// image.write_rgb8(images.rgb8).throw_if_error();
/// // OpenGL can draw with the texture from here on.
/// @endcode
///
/// Images have their first row on top, textures at the bottom. Rows are therefore flipped, so that
/// OpenGL shows the image upright. All calls need the texture's context to be current in their thread.
/// None waits for the device: OpenGL commands are ordered after the write.
class GlImage {
 public:
  /// Registers a texture.
  /// @param backend Backend whose images are written. It must outlive this object.
  /// @param texture Name of a GL_TEXTURE_2D of width x height texels with format GL_RGBA8 (for
  /// write_rgb8) or GL_R32F (for write_depth). It must outlive this object.
  /// @param width, height Size of the texture in texels.
  /// @return invalid_argument for another size or format; backend_failure, with the driver's message,
  /// for example if no context is current or it belongs to another GPU.
  static Result<GlImage> create(CudaBackend& backend, unsigned texture, int width, int height);

  /// Moves the registration.
  GlImage(GlImage&&) noexcept;
  /// Moves the registration.
  GlImage& operator=(GlImage&&) noexcept;
  /// Unregisters the texture.
  ~GlImage();

  /// Writes bytes of shape [height][width][3] from device memory. Alpha is set to 255.
  /// @return invalid_argument for a texture of another format; backend_failure.
  Status write_rgb8(const std::uint8_t* rgb8);
  /// Writes floats of shape [height][width] from device memory, for example depth or alpha.
  /// @return invalid_argument for a texture of another format; backend_failure.
  Status write_depth(const float* depth);

 private:
  struct State;
  explicit GlImage(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace gsnav
