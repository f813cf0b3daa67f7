// SPDX-License-Identifier: Apache-2.0
#include "gsnav/device/renderer.hpp"

#include <unistd.h>

#include <algorithm>
#include <thread>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "frames.hpp"
#include "gsnav/detail/image/validate_camera.hpp"
#include "guard.hpp"

namespace gsnav::python {
namespace {

/// A Renderer that one thread may use at a time.
struct PythonRenderer {
  Renderer renderer;
  Frames<float> frames;  ///< Images of the last call. Their memory is used again.
  bool one_choice;       ///< The cameras of a call share a choice of detail, so they stay together.
  Busy busy;
};

void make(PythonRenderer* self, const DeviceArg& device, const SceneArg& scene, RenderOptions options) {
  const Device chosen = device.value();
  check_fork(chosen, "Renderer");
  const ReleaseGil release;
  const bool one_choice = options.detail.lod.has_value() || options.detail.visible_sets;
  new (self) PythonRenderer{Renderer::create(chosen, scene.scene, options).value(), {}, one_choice, {}};
}

/// Number of cameras that are rendered at a time. Between the parts, Ctrl-C ends a call. A part has
/// enough pixels and cameras for all threads. All cameras are one part if one of them is wrong or if
/// memory is short, so that the renderer refuses them before it renders any.
std::size_t part_of(const PythonRenderer& self, std::span<const Camera> cameras) {
  constexpr double kPixels = 1 << 23, kBytesPerPixel = 32;
  if (self.one_choice || cameras.empty()) return cameras.size();
  for (const Camera& c : cameras) {
    const bool fits = c.width == cameras[0].width && c.height == cameras[0].height;
    if (!fits || !validate(c)) return cameras.size();
  }
  const double pixels = static_cast<double>(cameras[0].width) * cameras[0].height;
  const double memory =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  if (kBytesPerPixel * pixels * static_cast<double>(cameras.size()) > memory) return cameras.size();
  const Device& device = self.renderer.device();
  std::size_t threads = 1;
  if (device.kind() != DeviceKind::serial) {
    threads = device.threads() > 0 ? static_cast<std::size_t>(device.threads())
                                   : std::max(1u, std::thread::hardware_concurrency());
  }
  return std::max(static_cast<std::size_t>(kPixels / pixels), 2 * threads);
}

PythonFrames render(PythonRenderer& self, const std::vector<Camera>& cameras, double time, bool single) {
  const Busy::Hold hold(self.busy, "Renderer.render");
  check_fork(self.renderer.device(), "Renderer.render");
  check_finite("Renderer.render: time", time);
  FrameArrays arrays(cameras.size(), single);
  std::span<const Camera> left(cameras);
  const std::size_t most = part_of(self, left);
  do {
    const auto part = left.first(std::min(most, left.size()));
    left = left.subspan(part.size());
    {
      const ReleaseGil release;
      self.renderer.render(part, self.frames, time).throw_if_error();
    }
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    arrays.add(self.frames);
  } while (!left.empty());
  return arrays.take();
}

}  // namespace

void bind_renderer(nb::module_& m) {
  bind_frames(m);
  nb::class_<PythonRenderer>(
      m, "Renderer",
      "Renders a scene on any device: Gaussians, meshes and avatars in one image. It keeps the scene in "
      "the "
      "device's memory. One thread may use it at a time; a call during another call raises an error.")
      .def("__init__", make, nb::arg("device"), nb::arg("scene"), nb::arg("options") = RenderOptions{},
           "Creates a renderer that shares `scene`. The scene needs no NavMesh. Raises InvalidArgument "
           "naming "
           "the part or field.")
      .def(
          "render",
          [](PythonRenderer& r, const Camera& camera, double time) {
            return render(r, {camera}, time, true);
          },
          nb::arg("camera"), nb::arg("time") = 0.0,
          "Renders one camera. Images have the shape [H][W] or [H][W][3]. `time` is in seconds on the "
          "scene's clock, at which avatars are posed.")
      .def(
          "render",
          [](PythonRenderer& r, const std::vector<Camera>& cameras, double time) {
            return render(r, cameras, time, false);
          },
          nb::arg("cameras"), nb::arg("time") = 0.0,
          "Renders C cameras of one image size. Images have the shape [C][H][W] or [C][H][W][3]. Ctrl-C "
          "ends the call after about eight million pixels, unless the renderer chooses detail.")
      .def(
          "set_config",
          [](PythonRenderer& r, const RenderConfig& config) {
            const Busy::Hold hold(r.busy, "Renderer.set_config");
            r.renderer.set_config(config).throw_if_error();
          },
          nb::arg("config"), "Replaces the settings of all later frames.")
      .def_prop_ro(
          "device", [](const PythonRenderer& r) { return r.renderer.device(); },
          "Device that the renderer runs on.");
}

}  // namespace gsnav::python
