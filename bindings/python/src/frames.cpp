// SPDX-License-Identifier: Apache-2.0
#include "frames.hpp"

#include <span>

#include "arrays.hpp"
#include "fields.hpp"

namespace gsnav::python {

PythonFrames python_frames(const Frames<float>& frames, bool single) {
  PythonFrames out;
  out.cameras = frames.cameras;
  out.height = frames.height;
  out.width = frames.width;
  const auto image = [&](const std::vector<float>& values, std::size_t channels) -> nb::object {
    if (values.empty()) return nb::none();
    std::vector<std::size_t> shape;
    if (!single) shape.push_back(frames.cameras);
    shape.insert(shape.end(), {frames.height, frames.width});
    if (channels > 1) shape.push_back(channels);
    return array_copy(std::span(values), shape);
  };
  out.rgb = image(frames.rgb, 3);
  out.alpha = image(frames.alpha, 1);
  out.median_depth = image(frames.median_depth, 1);
  out.expected_depth = image(frames.expected_depth, 1);
  out.accumulated_depth = image(frames.accumulated_depth, 1);
  out.first_hit_depth = image(frames.first_hit_depth, 1);
  out.stats = frames.stats;
  return out;
}

void bind_frames(nb::module_& m) {
  nb::class_<MeshStats>(m, "MeshStats", "Counts of the triangles in a frame.")
      .def_ro("triangles", &MeshStats::triangles, "Triangles of all instances.")
      .def_ro("not_finite", &MeshStats::not_finite,
              "Triangles that are left out: a corner is not finite.")
      .def_ro("drawn", &MeshStats::drawn, "Triangles that may cover a pixel centre.")
      .def_ro("fragments", &MeshStats::fragments, "Pixels of see-through surfaces.");
  nb::class_<RenderStats>(m, "RenderStats", "Counts of one camera's frame.")
      .def_ro("gaussians", &RenderStats::gaussians, "Gaussians in all sets.")
      .def_ro("visible", &RenderStats::visible, "Gaussians whose footprint bounds reach the image.")
      .def_ro("tile_intersections", &RenderStats::tile_intersections, "(tile, Gaussian) pairs.")
      .def_ro("meshes", &RenderStats::meshes, "Counts of the meshes.");

  using F = PythonFrames;
  const auto getter = [](const char* name) {
    return std::string("def ") + name + "(self) -> numpy.typing.NDArray[numpy.float32] | None";
  };
  nb::class_<F> c(
      m, "Frames",
      "Images of one render call, float32 arrays that own their memory, aligned to 64 bytes. An image "
      "that was not requested is None. Shapes have a first axis of cameras if a list of cameras was "
      "rendered.");
  c.def_ro("cameras", &F::cameras, "Number of cameras, C.");
  c.def_ro("height", &F::height, "Rows of an image, H.");
  c.def_ro("width", &F::width, "Columns of an image, W.");
  const auto image = [&](const char* name, nb::object F::*member, const char* doc) {
    const std::string signature = getter(name);
    c.def_prop_ro(
        name, [member](const F& f) { return f.*member; }, nb::sig(signature.c_str()), doc);
  };
  image("rgb", &F::rgb, "Colours over the background, [H][W][3] or [C][H][W][3].");
  image("alpha", &F::alpha, "1 - transmittance, [H][W] or [C][H][W].");
  image("median_depth", &F::median_depth, "Metres, [H][W] or [C][H][W]; 0 where the ray hits nothing.");
  image("expected_depth", &F::expected_depth, "Metres, [H][W] or [C][H][W].");
  image("accumulated_depth", &F::accumulated_depth, "Metres, [H][W] or [C][H][W].");
  image("first_hit_depth", &F::first_hit_depth, "Metres, [H][W] or [C][H][W].");
  c.def_ro("stats", &F::stats, "Counts per camera.");
}

}  // namespace gsnav::python
