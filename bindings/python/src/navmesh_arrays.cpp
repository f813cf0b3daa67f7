// SPDX-License-Identifier: Apache-2.0
#include "navmesh_arrays.hpp"

#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "arrays.hpp"
#include "progress.hpp"

namespace gsnav::python {
namespace {

/// The argument as a C-contiguous array of T with shape [rows][3]. Copies if it has another
/// type or order, or is not aligned.
template <class T>
nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu> rows_of_three(nb::handle source,
                                                                               const char* name,
                                                                               const char* kinds,
                                                                               const char* type) {
  if (!nb::hasattr(source, "shape") && nb::hasattr(source, "__len__") && nb::len(source) > 50'000'000) {
    throw nb::value_error(("NavMesh.build: " + std::string(name) +
                           ": a sequence of more than 50 million rows; pass an array of numpy")
                              .c_str());
  }
  const nb::object array = numpy_array(source);
  const nb::object dtype = array.attr("dtype"), shape = array.attr("shape");
  const std::string where = "NavMesh.build: " + std::string(name) + " have ";
  if (std::string(kinds).find(text_of(dtype.attr("kind"))) == std::string::npos) {
    throw nb::type_error((where + "dtype " + text_of(dtype) + "; " + type + " is needed").c_str());
  }
  if (nb::len(shape) != 2 || nb::cast<std::size_t>(shape[1]) != 3) {
    throw nb::value_error((where + "shape " + text_of(shape) + "; (n, 3) is needed").c_str());
  }
  if (nb::cast<std::size_t>(shape[0]) > std::numeric_limits<std::int32_t>::max()) {
    throw nb::value_error((where + "shape " + text_of(shape) + "; at most 2^31 - 1 rows").c_str());
  }
  if (std::is_integral_v<T> && nb::cast<std::size_t>(shape[0]) > 0) {
    const std::string low = text_of(array.attr("min")()), high = text_of(array.attr("max")());
    if (low[0] == '-' || high.size() > 10 ||
        std::stoull(high) > std::numeric_limits<std::uint32_t>::max()) {
      throw nb::value_error(
          (where + "indices from " + low + " to " + high + "; 0 to 2^32 - 1 are valid").c_str());
    }
  }
  return nb::cast<nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>>(
      nb::module_::import_("numpy").attr("require")(array, type, "CA"));
}

}  // namespace

std::shared_ptr<NavMesh> build_navmesh(NavMeshSettings settings, nb::handle vertices,
                                       nb::handle triangles, int threads, const nb::object& progress) {
  const auto v = rows_of_three<double>(vertices, "vertices", "f", "float64");
  const auto t = rows_of_three<std::uint32_t>(triangles, "triangles", "iu", "uint32");
  const auto stopping = stopping_progress(progress);
  const ReleaseGil release;
  std::vector<Vec3d> points(v.shape(0));
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = {v(i, 0), v(i, 1), v(i, 2)};
  std::vector<NavMesh::Triangle> faces(t.shape(0));
  for (std::size_t i = 0; i < faces.size(); ++i) faces[i] = {t(i, 0), t(i, 1), t(i, 2)};
  return std::make_shared<NavMesh>(NavMesh::build(settings, points, faces, threads, stopping).value());
}

nb::tuple navmesh_surface(const NavMesh& mesh, std::optional<std::size_t> island) {
  std::vector<double> numbers;
  std::vector<std::uint32_t> indices;
  {
    const ReleaseGil release;
    const NavMeshTriangles surface = mesh.surface(island);
    numbers.reserve(3 * surface.vertices.size());
    for (const Vec3d& p : surface.vertices) numbers.insert(numbers.end(), {p.x, p.y, p.z});
    indices.reserve(3 * surface.triangles.size());
    for (const auto& t : surface.triangles) indices.insert(indices.end(), t.begin(), t.end());
  }
  const std::size_t points = numbers.size() / 3, triangles = indices.size() / 3;
  return nb::make_tuple(array_from(std::move(numbers), {points, 3}),
                        array_from(std::move(indices), {triangles, 3}));
}

}  // namespace gsnav::python
