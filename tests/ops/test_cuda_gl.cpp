// SPDX-License-Identifier: Apache-2.0
// Frames that go to OpenGL's textures on the device, by a headless context of the same GPU.
#include <doctest/doctest.h>

#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <GL/glext.h>

#include <cstdio>
#include <string>
#include <vector>

#include "gsnav/backends/cuda/batch.hpp"
#include "gsnav/backends/cuda/gl_image.hpp"
#include "ops/backends.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr EGLint kCudaDevice = 0x323A;  // EGL_CUDA_DEVICE_NV

/// OpenGL without a window on the GPU that CUDA calls 0; `why` says what is missing where there is none.
class Context {
 public:
  Context() { why = make(); }
  ~Context() {
    if (display_ == EGL_NO_DISPLAY) return;
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
    eglTerminate(display_);
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  std::string why;

 private:
  std::string make() {
    if (CudaBackend::device_count() == 0) return "no GPU";
    const auto devices =
        reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
    const auto attribute =
        reinterpret_cast<PFNEGLQUERYDEVICEATTRIBEXTPROC>(eglGetProcAddress("eglQueryDeviceAttribEXT"));
    const auto display_of =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
    if (devices == nullptr || attribute == nullptr || display_of == nullptr)
      return "EGL knows no devices";
    std::vector<EGLDeviceEXT> found(16);
    EGLint n = 0;
    if (devices(static_cast<EGLint>(found.size()), found.data(), &n) == EGL_FALSE)
      return "EGL lists no devices";
    EGLDeviceEXT gpu = nullptr;
    for (EGLint i = 0; i < n; ++i) {
      EGLAttrib number = -1;
      if (attribute(found[static_cast<std::size_t>(i)], kCudaDevice, &number) != EGL_FALSE &&
          number == 0) {
        gpu = found[static_cast<std::size_t>(i)];
      }
    }
    if (gpu == nullptr) return "none of EGL's " + std::to_string(n) + " devices is a CUDA device";
    EGLDisplay display = display_of(EGL_PLATFORM_DEVICE_EXT, gpu, nullptr);
    if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) == EGL_FALSE)
      return "no EGL display";
    display_ = display;
    if (eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) return "EGL has no OpenGL";
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                             EGL_NONE};
    EGLConfig config = nullptr;
    if (eglChooseConfig(display_, wanted, &config, 1, &n) == EGL_FALSE || n == 0)
      return "no EGL configuration";
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, nullptr);
    if (context_ == EGL_NO_CONTEXT) return "no EGL context";
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE)
      return "no context without a surface";
    return {};
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

constexpr int kWidth = 149, kHeight = 101;  // rows of RGB8 are of no round length
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

GLuint texture_of(GLint format, GLenum channels, GLenum type) {
  GLuint name = 0;
  glGenTextures(1, &name);
  glBindTexture(GL_TEXTURE_2D, name);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTexImage2D(GL_TEXTURE_2D, 0, format, kWidth, kHeight, 0, channels, type, nullptr);
  return name;
}

}  // namespace

TEST_CASE("cuda_gl: frames stand in textures, upright, as they were drawn") {
  const Context context;
  if (!context.why.empty()) {
    std::printf("SKIP: cuda_gl: %s\n", context.why.c_str());
    return;
  }
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  const GLuint colors = texture_of(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE);
  const GLuint depths = texture_of(GL_R32F, GL_RED, GL_FLOAT);
  const GLuint halves = texture_of(GL_R16F, GL_RED, GL_FLOAT);
  REQUIRE(glGetError() == GL_NO_ERROR);
  {
    CudaBackend cuda;
    const GaussianCloud cloud = random_cloud(51, {.count = 4000});
    const GaussianArrays<CudaBackend> arrays(cuda, cloud);
    const std::vector<GaussianSet> sets{arrays.set()};
    Buffer<std::uint8_t, CudaBackend> rgb8(cuda);
    Buffer<float, CudaBackend> depth(cuda);
    rgb8.resize_discard(3 * kPixels);
    depth.resize_discard(kPixels);
    BatchImages to;
    to.rgb8 = rgb8.data();
    to.floats.median_depth = depth.data();
    CudaBatchRenderer renderer(cuda);
    GlImage color_image = GlImage::create(cuda, colors, kWidth, kHeight).value();
    GlImage depth_image = GlImage::create(cuda, depths, kWidth, kHeight).value();
    for (const double turn : {0.0, 0.2, -0.1}) {
      const std::vector<BatchCamera> camera{
          {Camera::look_at({0, 0, 0}, {turn, 0.1, 4}, {0, -1, 0}, kWidth, kHeight, 80), {}}};
      renderer.render(sets, camera, to).throw_if_error();
      renderer.finish().throw_if_error();
      REQUIRE(color_image.write_rgb8(rgb8.data()).ok());
      REQUIRE(depth_image.write_depth(depth.data()).ok());
      std::vector<std::uint8_t> texels(4 * kPixels), drawn(3 * kPixels);
      std::vector<float> values(kPixels), planar(kPixels);
      glBindTexture(GL_TEXTURE_2D, colors);
      glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
      glBindTexture(GL_TEXTURE_2D, depths);
      glGetTexImage(GL_TEXTURE_2D, 0, GL_RED, GL_FLOAT, values.data());
      REQUIRE(glGetError() == GL_NO_ERROR);
      rgb8.download(drawn.data(), drawn.size());
      depth.download(planar.data(), planar.size());
      REQUIRE(cuda.synchronize().ok());
      std::size_t wrong = 0, seen = 0;
      for (std::size_t y = 0; y < kHeight; ++y) {
        for (std::size_t x = 0; x < kWidth; ++x) {
          const std::size_t texel = (kHeight - 1 - y) * kWidth + x, pixel = y * kWidth + x;
          for (std::size_t k = 0; k < 3; ++k)
            wrong += texels[4 * texel + k] == drawn[3 * pixel + k] ? 0u : 1u;
          wrong += texels[4 * texel + 3] == 255 ? 0u : 1u;
          wrong += values[texel] == planar[pixel] ? 0u : 1u;
          seen += planar[pixel] > 0 ? 1u : 0u;
        }
      }
      CHECK(wrong == 0);
      CHECK(seen > kPixels / 10);
    }
    const auto message = [&](GLuint texture, int width, int height) {
      const auto r = GlImage::create(cuda, texture, width, height);
      REQUIRE_FALSE(r.ok());
      return r.status().message();
    };
    CHECK(message(colors, kWidth + 1, kHeight).find("149 x 101") != std::string::npos);
    CHECK(message(colors, 0, kHeight).find("size 0 x 101") != std::string::npos);
    CHECK(message(halves, kWidth, kHeight).find("neither GL_RGBA8 nor GL_R32F") != std::string::npos);
    CHECK(message(12345, kWidth, kHeight).find("registering texture 12345") != std::string::npos);
    CHECK(color_image.write_depth(depth.data()).message().find("GL_R32F") != std::string::npos);
    CHECK(depth_image.write_rgb8(rgb8.data()).message().find("GL_RGBA8") != std::string::npos);
    REQUIRE(cuda.synchronize().ok());
  }
  const GLuint names[] = {colors, depths, halves};
  glDeleteTextures(3, names);
}
