// SPDX-License-Identifier: Apache-2.0
#include "frames.hpp"

#include <span>

#include "arrays.hpp"
#include "fields.hpp"

namespace gsnav::python {

void FrameArrays::add(const Frames<float>& part) {
  using P = PythonFrames;
  constexpr nb::object P::*kArrays[] = {&P::rgb,
                                        &P::alpha,
                                        &P::median_depth,
                                        &P::expected_depth,
                                        &P::accumulated_depth,
                                        &P::first_hit_depth};
  static_assert(std::size(kArrays) == std::size(Frames<float>::kVectors));
  const std::size_t before = made_.stats.size();  // Cameras that are there.
  made_.height = part.height;
  made_.width = part.width;
  for (std::size_t i = 0; i < std::size(kArrays); ++i) {
    const std::vector<float>& values = part.*Frames<float>::kVectors[i];
    if (values.empty()) {
      made_.*kArrays[i] = nb::none();
      continue;
    }
    if (data_[i] == nullptr) {
      std::vector<std::size_t> shape;
      if (!single_) shape.push_back(made_.cameras);
      shape.insert(shape.end(), {part.height, part.width});
      if (i == 0) shape.push_back(3);
      made_.*kArrays[i] = new_array(shape, data_[i]);
    }
    copy_numbers(std::span(values), data_[i] + values.size() / part.cameras * before);
  }
  made_.stats.insert(made_.stats.end(), part.stats.begin(), part.stats.end());
}

PythonFrames python_frames(const Frames<float>& frames, bool single) {
  FrameArrays arrays(frames.cameras, single);
  arrays.add(frames);
  return arrays.take();
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
      .def_ro("visible", &RenderStats::visible,
              "Gaussians whose footprint bounds reach the image. 0 on a GPU.")
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
