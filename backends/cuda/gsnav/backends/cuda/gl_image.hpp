// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "gsnav/backends/cuda.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// An OpenGL texture that images on the device are written into, without a way through the host. Link
/// gsnav::cuda_gl.
///
///     GlImage image = GlImage::create(cuda, texture, 640, 480).value();   // its context is current in
///     this thread batch.render(sets, cameras, images).throw_if_error();
///     image.write_rgb8(images.rgb8).throw_if_error();                     // OpenGL draws with it from
///     here on
///
/// Row 0 of an image is its top; that of a texture its bottom: rows are turned round, so that what
/// OpenGL draws stands upright. All calls want the texture's context current in their thread, and none
/// waits for the device: OpenGL's own commands are put behind what was written.
class GlImage {
 public:
  /// `texture`: the name of a GL_TEXTURE_2D of width x height texels in GL_RGBA8 (for write_rgb8) or
  /// GL_R32F (for write_depth), which must live longer. Errors: invalid_argument where size or format
  /// are others; backend_failure with what the driver said (no current context; another GPU's).
  static Result<GlImage> create(CudaBackend& backend, unsigned texture, int width, int height);

  GlImage(GlImage&&) noexcept;
  GlImage& operator=(GlImage&&) noexcept;
  ~GlImage();

  /// [H][W][3] bytes in device memory; alpha becomes 255. Errors: invalid_argument (a texture of another
  /// format), backend_failure.
  Status write_rgb8(const std::uint8_t* rgb8);
  /// [H][W] floats in device memory: a depth, or alpha. Errors as above.
  Status write_depth(const float* depth);

 private:
  struct State;
  explicit GlImage(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace gsnav
