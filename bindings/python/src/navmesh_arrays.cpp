// SPDX-License-Identifier: Apache-2.0
#include "navmesh_arrays.hpp"

#include <limits>
#include <string>
#include <vector>

#include "arrays.hpp"

namespace gsnav::python {
namespace {

/// The argument as a C-contiguous array of T with shape [rows][3]. Copies only if it has another type.
template <class T>
nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu> rows_of_three(nb::handle source,
                                                                               const char* name,
                                                                               const char* kinds,
                                                                               const char* type) {
  const nb::module_ numpy = nb::module_::import_("numpy");
  const nb::object array = numpy.attr("asarray")(source);
  const std::string kind = nb::cast<std::string>(array.attr("dtype").attr("kind"));
  if (std::string(kinds).find(kind) == std::string::npos) {
    const std::string dtype = nb::cast<std::string>(nb::str(array.attr("dtype")));
    throw nb::type_error(
        ("NavMesh.build: " + std::string(name) + " have dtype " + dtype + "; " + type + " is needed")
            .c_str());
  }
  const nb::object shape = array.attr("shape");
  if (nb::len(shape) != 2 || nb::cast<std::size_t>(shape[1]) != 3) {
    const std::string text = nb::cast<std::string>(nb::str(shape));
    throw nb::value_error(
        ("NavMesh.build: " + std::string(name) + " have shape " + text + "; (n, 3) is needed").c_str());
  }
  if (kind != "f" && nb::cast<std::size_t>(array.attr("size")) > 0 &&
      nb::cast<bool>(array.attr("min")() < nb::int_(0))) {
    throw nb::value_error(("NavMesh.build: " + std::string(name) + " have a negative index").c_str());
  }
  if (kind != "f" && nb::cast<std::size_t>(array.attr("size")) > 0 &&
      nb::cast<bool>(array.attr("max")() > nb::int_(std::numeric_limits<std::uint32_t>::max()))) {
    throw nb::value_error(("NavMesh.build: " + std::string(name) + " have an index over 2^32").c_str());
  }
  return nb::cast<nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>>(
      numpy.attr("ascontiguousarray")(array, type));
}

}  // namespace

std::shared_ptr<NavMesh> build_navmesh(const NavMeshSettings& settings, nb::handle vertices,
                                       nb::handle triangles, int threads) {
  const auto v = rows_of_three<double>(vertices, "vertices", "f", "float64");
  const auto t = rows_of_three<std::uint32_t>(triangles, "triangles", "iu", "uint32");
  std::vector<Vec3d> points(v.shape(0));
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = {v(i, 0), v(i, 1), v(i, 2)};
  std::vector<NavMesh::Triangle> faces(t.shape(0));
  for (std::size_t i = 0; i < faces.size(); ++i) faces[i] = {t(i, 0), t(i, 1), t(i, 2)};
  nb::gil_scoped_release release;
  return std::make_shared<NavMesh>(NavMesh::build(settings, points, faces, threads).value());
}

nb::tuple navmesh_surface(const NavMesh& mesh, std::optional<std::size_t> island) {
  NavMeshTriangles surface;
  {
    nb::gil_scoped_release release;
    surface = mesh.surface(island);
  }
  std::vector<std::uint32_t> indices;
  indices.reserve(3 * surface.triangles.size());
  for (const auto& t : surface.triangles) indices.insert(indices.end(), t.begin(), t.end());
  return nb::make_tuple(point_array(surface.vertices),
                        array_from(std::move(indices), {surface.triangles.size(), 3}));
}

}  // namespace gsnav::python
