// SPDX-License-Identifier: Apache-2.0
#include "gsnav/image/camera.hpp"

#include <nanobind/stl/filesystem.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/detail/image/field_of_view.hpp"
#include "gsnav/io.hpp"

namespace gsnav::python {
namespace {

nb::object viewmat(const Camera& c) {
  std::vector<double> m(16, 0.0);
  for (std::size_t i = 0; i < 3; ++i) {
    const int row = static_cast<int>(i);
    for (std::size_t j = 0; j < 3; ++j) m[4 * i + j] = c.viewmat.linear(row, static_cast<int>(j));
    m[4 * i + 3] = c.viewmat.translation[row];
  }
  m[15] = 1;
  return array_from(std::move(m), {4, 4});
}

void set_viewmat(Camera& c, nb::handle value) {
  double m[4][4] = {{}, {}, {}, {0, 0, 0, 1}};
  const Py_ssize_t rows = PySequence_Check(value.ptr()) ? PySequence_Size(value.ptr()) : -1;
  bool good = rows == 3 || rows == 4;
  for (Py_ssize_t i = 0; good && i < rows; ++i) good = read_numbers(value[i], m[i], 4);
  good = good && m[3][0] == 0 && m[3][1] == 0 && m[3][2] == 0 && m[3][3] == 1;
  if (!good) {
    drop_mistake();
    const std::string text =
        "Camera.viewmat: expected numbers of shape (4, 4) with the last row 0 0 0 1, or of shape (3, "
        "4), got " +
        shown(value);
    throw nb::value_error(text.c_str());
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) c.viewmat.linear(i, j) = m[i][j];
    c.viewmat.translation[i] = m[i][3];
  }
}

}  // namespace

void bind_camera(nb::module_& m) {
  // Camera::viewmat is an array in Python, so the fields that can be keywords are bound one by one.
  Struct<Camera> camera(m, "Camera",
                        "Pinhole camera. Camera axes are x right, y down, z forward (OpenCV). The pixel "
                        "in column j, row i "
                        "has its centre at (j + 0.5, i + 0.5); row 0 is the top.");
  camera.field("fx", &Camera::fx, "Horizontal focal length in pixels, > 0.")
      .field("fy", &Camera::fy, "Vertical focal length in pixels, > 0.")
      .field("cx", &Camera::cx, "Column of the principal point in pixels; may be off-centre.")
      .field("cy", &Camera::cy, "Row of the principal point in pixels; may be off-centre.")
      .field("width", &Camera::width, "Image width in pixels.")
      .field("height", &Camera::height, "Image height in pixels.")
      .field("near_plane", &Camera::near_plane,
             "Metres. A Gaussian whose centre has z <= near_plane is not drawn.")
      .field("near_sigma", &Camera::near_sigma,
             "Also skip a Gaussian whose centre has z <= near_sigma times its standard deviation along "
             "the view axis.")
      .extra(
          "viewmat",
          "collections.abc.Sequence[collections.abc.Sequence[float]] | "
          "numpy.typing.NDArray[numpy.float64]",
          viewmat, set_viewmat,
          "World to camera, rigid, metres: a new array of shape [4][4]. Assign an array of shape [4][4] "
          "or [3][4].");
  camera.done()
      .def_static(
          "look_at",
          [](const Vec3d& eye, const Vec3d& target, const Vec3d& up, int width, int height,
             double hfov) {
            detail::validate_hfov("Camera.look_at: ", hfov).throw_if_error();
            return Camera::look_at(eye, target, up, width, height, hfov);
          },
          nb::arg("eye"), nb::arg("target"), nb::arg("up"), nb::arg("width"), nb::arg("height"),
          nb::arg("hfov_degrees"),
          "Camera at `eye` that looks at `target`, in metres. `up` points upwards in the image and "
          "must not be parallel to the view direction. Image size in pixels. Raises InvalidArgument for "
          "a field of view outside (0, 180) degrees.")
      .def(
          "set_hfov",
          [](Camera& c, int width, int height, double hfov) -> Camera& {
            detail::validate_hfov("Camera.set_hfov: ", hfov).throw_if_error();
            return c.set_hfov(width, height, hfov);
          },
          nb::arg("width"), nb::arg("height"), nb::arg("hfov_degrees"), nb::rv_policy::none,
          "Sets an image size with square pixels, a horizontal field of view in degrees and a centred "
          "principal point. Returns the camera. Raises InvalidArgument as look_at does.")
      .def_prop_ro("position", &Camera::position, "Camera position in the world, metres, shape [3].");

  // The module gsnav.io has these two.
  m.def(
      "load_cameras",
      [](const std::filesystem::path& path, int width, int height) {
        const ReleaseGil release;
        return io::load_cameras(path, width, height).value();
      },
      nb::arg("path"), nb::arg("width") = 0, nb::arg("height") = 0,
      "Reads INRIA's cameras.json. A positive width and height replace the sizes and keep the "
      "horizontal "
      "field of view. Raises FileNotFound, or InvalidFile naming the camera and the field.");
  m.def(
      "save_cameras",
      [](const std::filesystem::path& path, const std::vector<Camera>& cameras) {
        const ReleaseGil release;
        io::save_cameras(path, cameras).throw_if_error();
      },
      nb::arg("path"), nb::arg("cameras"),
      "Writes cameras in the same layout, without near planes. Raises Unsupported for a principal point "
      "off the centre.");
}

}  // namespace gsnav::python
