// SPDX-License-Identifier: Apache-2.0
#include "gsnav/device/renderer.hpp"

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "frames.hpp"
#include "guard.hpp"

namespace gsnav::python {
namespace {

/// A Renderer that one thread may use at a time.
struct PythonRenderer {
  Renderer renderer;
  Frames<float> frames;  ///< Images of the last call. Their memory is used again.
  Busy busy;
};

void make(PythonRenderer* self, const DeviceArg& device, const SceneArg& scene, RenderOptions options) {
  const Device chosen = device.value();
  check_fork(chosen, "Renderer");
  const ReleaseGil release;
  new (self) PythonRenderer{Renderer::create(chosen, scene.scene, options).value(), {}, {}};
}

PythonFrames render(PythonRenderer& self, const std::vector<Camera>& cameras, double time, bool single) {
  const Busy::Hold hold(self.busy, "Renderer.render");
  check_fork(self.renderer.device(), "Renderer.render");
  check_finite("Renderer.render: time", time);
  {
    const ReleaseGil release;
    self.renderer.render(std::span<const Camera>(cameras), self.frames, time).throw_if_error();
  }
  return python_frames(self.frames, single);
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
          "Renders C cameras of one image size. Images have the shape [C][H][W] or [C][H][W][3].")
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
