// SPDX-License-Identifier: Apache-2.0
#include <GL/gl.h>
#include <cuda_gl_interop.h>
#include <cuda_runtime.h>

#include <string>
#include <utility>

#include "gsnav/backends/cuda/gl_image.hpp"
#include "gsnav/backends/cuda/policy.hpp"
#include "gsnav/core/buffer.hpp"

namespace gsnav {

namespace {

/// Converts an image to texels. The first row of a texture is the last one of the image.
__global__ void rgba_of_rgb(const std::uint8_t* rgb, uchar4* to, int width, int height) {
  const int x = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x),
            y = static_cast<int>(blockIdx.y);
  if (x >= width) return;
  const std::size_t from =
      3 * (static_cast<std::size_t>(height - 1 - y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x));
  to[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
      make_uchar4(rgb[from], rgb[from + 1], rgb[from + 2], 255);
}
__global__ void turned_round(const float* values, float* to, int width, int height) {
  const int x = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x),
            y = static_cast<int>(blockIdx.y);
  if (x >= width) return;
  const std::size_t line = static_cast<std::size_t>(width), column = static_cast<std::size_t>(x);
  to[static_cast<std::size_t>(y) * line + column] =
      values[static_cast<std::size_t>(height - 1 - y) * line + column];
}

constexpr unsigned kThreads = cuda::policy::GlImage::kThreads;

Status failed(const char* what, cudaError_t e) {
  cudaGetLastError();
  return {Errc::backend_failure,
          std::string("GlImage: ") + what + " failed: " + cudaGetErrorString(e) +
              "; the texture's context must be current in this thread, and on the backend's GPU"};
}

}  // namespace

struct GlImage::State {
  State(CudaBackend& b, int w, int h) : backend(&b), texels(b), width(w), height(h) {}
  ~State() {
    if (resource != nullptr) cudaGraphicsUnregisterResource(resource);
  }

  dim3 blocks() const {
    return {(static_cast<unsigned>(width) + kThreads - 1) / kThreads, static_cast<unsigned>(height), 1};
  }

  /// Calls f(array) while the texture is mapped. Earlier OpenGL commands are finished first, and later
  /// ones wait.
  template <class F>
  Status mapped(const F& f) {
    const cudaStream_t stream = backend->stream();
    cudaError_t e = cudaGraphicsMapResources(1, &resource, stream);
    if (e != cudaSuccess) return failed("mapping the texture", e);
    cudaArray_t array = nullptr;
    e = cudaGraphicsSubResourceGetMappedArray(&array, resource, 0, 0);
    Status status = e == cudaSuccess ? f(array) : failed("finding the texture's memory", e);
    e = cudaGraphicsUnmapResources(1, &resource, stream);
    if (status.ok() && e != cudaSuccess) status = failed("giving the texture back", e);
    return status;
  }
  /// Copies `texels` to the texture, with this number of bytes each.
  Status fill(std::size_t bytes) {
    return mapped([&](cudaArray_t array) -> Status {
      const std::size_t line = static_cast<std::size_t>(width) * bytes;
      cudaError_t e = cudaGetLastError();
      if (e == cudaSuccess) {
        e = cudaMemcpy2DToArrayAsync(array, 0, 0, texels.data(), line, line,
                                     static_cast<std::size_t>(height), cudaMemcpyDeviceToDevice,
                                     backend->stream());
      }
      return e == cudaSuccess ? Status{} : failed("the copy to the texture", e);
    });
  }

  CudaBackend* backend;
  Buffer<std::uint32_t, CudaBackend> texels;  // Elements of 4 bytes of either format.
  int width, height;
  bool depth = false;  ///< True for GL_R32F.
  cudaGraphicsResource_t resource = nullptr;
};

GlImage::GlImage(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
GlImage::GlImage(GlImage&&) noexcept = default;
GlImage& GlImage::operator=(GlImage&&) noexcept = default;
GlImage::~GlImage() = default;

Result<GlImage> GlImage::create(CudaBackend& backend, unsigned texture, int width, int height) {
  const auto bad = [](const std::string& what) {
    return Status(Errc::invalid_argument, "GlImage: " + what);
  };
  if (width <= 0 || height <= 0 || height > 65535) {
    return bad("size " + std::to_string(width) + " x " + std::to_string(height) +
               ": must be positive, and the height at most 65535");
  }
  auto state = std::make_unique<State>(backend, width, height);
  const cudaError_t e = cudaGraphicsGLRegisterImage(&state->resource, texture, GL_TEXTURE_2D,
                                                    cudaGraphicsRegisterFlagsWriteDiscard);
  if (e != cudaSuccess) {
    state->resource = nullptr;
    return failed(("registering texture " + std::to_string(texture)).c_str(), e);
  }
  Status status = state->mapped([&](cudaArray_t array) -> Status {
    cudaChannelFormatDesc format{};
    cudaExtent extent{};
    unsigned flags = 0;
    const cudaError_t asked = cudaArrayGetInfo(&format, &extent, &flags, array);
    if (asked != cudaSuccess) return failed("asking for the texture's format", asked);
    if (extent.width != static_cast<std::size_t>(width) ||
        extent.height != static_cast<std::size_t>(height)) {
      return bad("the texture has " + std::to_string(extent.width) + " x " +
                 std::to_string(extent.height) + " texels; given are " + std::to_string(width) + " x " +
                 std::to_string(height));
    }
    const bool bytes = format.x == 8 && format.y == 8 && format.z == 8 && format.w == 8 &&
                       format.f == cudaChannelFormatKindUnsigned;
    state->depth = format.x == 32 && format.y == 0 && format.f == cudaChannelFormatKindFloat;
    if (!bytes && !state->depth) return bad("the texture's format is neither GL_RGBA8 nor GL_R32F");
    return {};
  });
  if (!status.ok()) return status;
  state->texels.resize_discard(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  return GlImage(std::move(state));
}

Status GlImage::write_rgb8(const std::uint8_t* rgb8) {
  State& s = *state_;
  if (s.depth)
    return {Errc::invalid_argument, "GlImage: colours need a texture of GL_RGBA8, not GL_R32F"};
  rgba_of_rgb<<<s.blocks(), kThreads, 0, s.backend->stream()>>>(
      rgb8, reinterpret_cast<uchar4*>(s.texels.data()), s.width, s.height);
  return s.fill(sizeof(uchar4));
}

Status GlImage::write_depth(const float* depth) {
  State& s = *state_;
  if (!s.depth)
    return {Errc::invalid_argument, "GlImage: depths need a texture of GL_R32F, not GL_RGBA8"};
  turned_round<<<s.blocks(), kThreads, 0, s.backend->stream()>>>(
      depth, reinterpret_cast<float*>(s.texels.data()), s.width, s.height);
  return s.fill(sizeof(float));
}

}  // namespace gsnav
