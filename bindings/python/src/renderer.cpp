// SPDX-License-Identifier: Apache-2.0
#include "gsnav/device/renderer.hpp"

#include <algorithm>
#include <string>
#include <thread>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "frames.hpp"
#include "gsnav/detail/frame/output.hpp"
#include "gsnav/detail/image/validate_camera.hpp"
#include "guard.hpp"

namespace gsnav::python {
namespace {

/// A Renderer that one thread may use at a time.
struct PythonRenderer {
  Renderer renderer;
  Frames<float> frames;  ///< Images of the last call. Their memory is used again.
  bool one_choice;       ///< The cameras of a call share a choice of detail, so they stay together.
  unsigned outputs;      ///< Images that are made, see RenderConfig::outputs.
  Busy busy;
};

void make(PythonRenderer* self, const DeviceArg& device, const SceneArg& scene, RenderOptions options) {
  const Device chosen = device.value();
  check_fork(chosen, "Renderer");
  const ReleaseGil release;
  const bool one_choice = options.detail.lod.has_value() || options.detail.visible_sets;
  new (self) PythonRenderer{Renderer::create(chosen, scene.scene, options).value(),
                            {},
                            one_choice,
                            options.render.outputs,
                            {}};
}

/// True if the renderer will refuse the cameras.
bool refused(std::span<const Camera> cameras) {
  return cameras.empty() || std::any_of(cameras.begin(), cameras.end(), [&](const Camera& c) {
           return c.width != cameras[0].width || c.height != cameras[0].height || !validate(c);
         });
}

/// Number of cameras that are rendered at a time. Between the parts, Ctrl-C ends a call. A part has
/// enough pixels and cameras for all threads. All cameras are one part if one of them is wrong, so that
/// the renderer refuses them before it renders any.
std::size_t part_of(const PythonRenderer& self, std::span<const Camera> cameras) {
  constexpr double kPixels = 1 << 23;
  if (self.one_choice || refused(cameras)) return cameras.size();
  const Device& device = self.renderer.device();
  std::size_t threads = 1;
  if (device.kind() != DeviceKind::serial) {
    threads = device.threads() > 0 ? static_cast<std::size_t>(device.threads())
                                   : std::max(1u, std::thread::hardware_concurrency());
  }
  const double pixels = static_cast<double>(cameras[0].width) * cameras[0].height;
  return std::min(std::max(static_cast<std::size_t>(kPixels / pixels), 2 * threads), cameras.size());
}

/// Checks that there is memory for the images of all cameras, and once more for those of a part.
void check_memory(const PythonRenderer& self, std::span<const Camera> cameras, std::size_t part) {
  constexpr double kUnchecked = 1 << 26;  // bytes that any process may use
  if (refused(cameras)) return;
  std::size_t values = 0;
  for (const ImageKind<float>& k : kImages<float>) {
    values += (self.outputs & k.output) != 0 ? k.channels : 0;
  }
  const double image =
      static_cast<double>(sizeof(float) * values) * cameras[0].width * cameras[0].height;
  const double bytes = image * static_cast<double>(cameras.size() + part);
  if (bytes <= kUnchecked) return;
  const std::string lack = text_of(nb::module_::import_("gsnav._memory").attr("lack")(bytes));
  if (lack.empty()) return;
  throw Error(Errc::out_of_memory, "Renderer.render: cameras: no memory for the images of " +
                                       std::to_string(cameras.size()) + " of " +
                                       std::to_string(cameras[0].width) + " x " +
                                       std::to_string(cameras[0].height) + " pixels: " + lack);
}

PythonFrames render(PythonRenderer& self, const std::vector<Camera>& cameras, double time, bool single) {
  const Busy::Hold hold(self.busy, "Renderer.render");
  check_fork(self.renderer.device(), "Renderer.render");
  check_finite("Renderer.render: time", time);
  if (cameras.empty()) {
    throw Error(Errc::invalid_argument,
                "Renderer.render: cameras = []: there is no camera; give one or more");
  }
  FrameArrays arrays(cameras.size(), single);
  std::span<const Camera> left(cameras);
  const std::size_t most = part_of(self, left);
  check_memory(self, left, most);
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
          "ends the call after about eight million pixels, unless the renderer chooses detail. Raises "
          "OutOfMemory if the images need more memory than the machine has, or than the container may "
          "use.")
      .def(
          "set_config",
          [](PythonRenderer& r, const RenderConfig& config) {
            const Busy::Hold hold(r.busy, "Renderer.set_config");
            r.renderer.set_config(config).throw_if_error();
            r.outputs = config.outputs;
          },
          nb::arg("config"), "Replaces the settings of all later frames.")
      .def_prop_ro(
          "device", [](const PythonRenderer& r) { return r.renderer.device(); },
          "Device that the renderer runs on.");
}

}  // namespace gsnav::python
