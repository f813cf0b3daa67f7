// SPDX-License-Identifier: Apache-2.0
// Levels of detail and visible sets of clouds: building, reading and writing them.
#include <nanobind/stl/filesystem.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/io.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/scene/lod_tree.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "guard.hpp"
#include "progress.hpp"

namespace gsnav::python {
namespace {

using Cloud = GaussianCloud;
using Release = nb::call_guard<ReleaseGil>;

std::shared_ptr<LodTree> make_lod(const DeviceArg& device, const Cloud& cloud, LodSettings settings,
                                  const nb::object& progress) {
  const Device chosen = device.value();
  check_fork(chosen, "build_lod");
  settings.progress = stopping_progress(progress);
  const ReleaseGil release;
  return std::make_shared<LodTree>(build_lod(chosen, cloud, settings).value());
}

std::shared_ptr<VisibleSets> make_visible_sets(const DeviceArg& device, const Cloud& cloud,
                                               const std::vector<Vec3d>& viewpoints,
                                               VisibleSettings settings, Similarity placed,
                                               const nb::object& progress) {
  const Device chosen = device.value();
  check_fork(chosen, "build_visible_sets");
  settings.progress = stopping_progress(progress);
  const ReleaseGil release;
  return std::make_shared<VisibleSets>(
      build_visible_sets(chosen, cloud, viewpoints, settings, placed).value());
}

void check_cell(const VisibleSets& sets, std::size_t cell) {
  if (cell < sets.cells()) return;
  throw nb::index_error(
      ("VisibleSets: cell " + std::to_string(cell) + " of " + std::to_string(sets.cells())).c_str());
}

void bind_viewpoints(nb::module_& m) {
  m.def(
      "navmesh_viewpoints",
      [](const NavMesh& mesh, const std::vector<double>& heights, double spacing) {
        std::vector<Vec3d> found;
        {
          const ReleaseGil release;
          found = navmesh_viewpoints(mesh, heights, spacing).value();
        }
        return point_array(found);
      },
      nb::arg("navmesh"), nb::arg("heights"), nb::arg("spacing"),
      nb::sig("def navmesh_viewpoints(navmesh: NavMesh, heights: collections.abc.Sequence[float], "
              "spacing: float) -> numpy.typing.NDArray[numpy.float64]"),
      "Positions of sensors `heights` metres above a NavMesh, about `spacing` metres apart: float64 "
      "[viewpoints][3], metres. Raises InvalidArgument naming the argument.");
}

}  // namespace

void bind_lod_tree(nb::module_& m) {
  using S = LodSettings;
  Struct<S>(m, "LodSettings", "Settings of build_lod.")
      .field("sh_degree", &S::sh_degree,
             "SH degree of merged Gaussians, 0 to 3, at most that of the cloud.")
      .field("neighbours", &S::neighbours, "Neighbours that each Gaussian may merge with, 1 to 16.")
      .done();
  using T = LodTree;
  nb::class_<T> c(m, "LodTree",
                  "A cloud at every level of detail. Leaves are chunks of the cloud; a node above them "
                  "shows what its children show, with half of the Gaussians. It does not change.");
  c.def_prop_ro("levels", &T::levels, "Number of levels, with the leaves.")
      .def_prop_ro("leaves", &T::leaves, "Number of leaves.")
      .def_prop_ro("bytes", &T::bytes, "Bytes of the tree, without the cloud.")
      .def_ro("merged", &T::merged, nb::rv_policy::reference_internal,
              "Gaussians of the nodes above the leaves.")
      .def_ro("level_begin", &T::level_begin,
              "First node of each level, leaves first, and the number of nodes.");
  const auto array = [&c](const char* name, float LodNode::*member, const char* doc) {
    array_property(c, name, "float32", doc, [member](const T& t) {
      std::vector<float> made;
      for (const LodNode& node : t.nodes) made.push_back(node.*member);
      return array_from(std::move(made), {t.nodes.size()});
    });
  };
  array("errors", &LodNode::error,
        "Distance between each node's Gaussians and those of the cloud that they stand for, metres "
        "(root mean square over mass), [nodes]. 0 for leaves. A parent has at least the error of its "
        "children.");
  array("grains", &LodNode::grain, "Size of the cloud's Gaussians below each node, metres, [nodes].");
}

void bind_visible_sets(nb::module_& m) {
  using S = VisibleSettings;
  Struct<S>(m, "VisibleSettings", "Settings of build_visible_sets. Lengths are metres in the world.")
      .field("cell", &S::cell, "Side of a cell.")
      .field(
          "margin", &S::margin,
          "A viewpoint counts for a cell at most this far outside of it. With less than the side of a "
          "cell, single pixels are far off.")
      .field("min_weight", &S::min_weight,
             "Least share of a pixel that a Gaussian must have to count as seen.")
      .field("rows", &S::rows,
             "Consecutive rows that are seen or not together: 1, 2, 4, 8, 16 or 32. 0: all of a chunk.")
      .field("face", &S::face, "Side of the six images per viewpoint, pixels.")
      .field("near_plane", &S::near_plane, "Near plane of these images.")
      .field("near_sigma", &S::near_sigma, "Camera.near_sigma of these images.")
      .field("most_share", &S::most_share,
             "Largest mean share of the Gaussians that a cell may see. 1: never refuse.")
      .done()
      .def("spacing", &S::spacing, "Recommended distance between viewpoints (navmesh_viewpoints).")
      .def("serve", &S::serve, nb::arg("camera"),
           "Raises `face` where the camera needs more, and sets `near_plane` and `near_sigma`, so that "
           "the sets apply to this camera.");
  using V = VisibleSets;
  nb::class_<V>(m, "VisibleSets",
                "For each cell of space, the Gaussians that can be seen from it. They are sampled from "
                "viewpoints. A cell is a cube in the asset's frame. It does not change.")
      .def_ro("cell", &V::cell, "Side of a cell, in the asset's frame.")
      .def_ro("focal", &V::focal, "The sets apply to cameras with at most this focal length, pixels.")
      .def_ro("near_plane", &V::near_plane, "The sets apply to cameras with at most this near plane.")
      .def_ro("near_sigma", &V::near_sigma, "The sets apply to cameras with this `near_sigma`.")
      .def_ro("min_weight", &V::min_weight, "VisibleSettings.min_weight.")
      .def_ro("viewpoints", &V::viewpoints, "Number of viewpoints that were used.")
      .def_ro("cloud_chunks", &V::cloud_chunks, "Number of chunks of the cloud.")
      .def_ro("refused_share", &V::refused_share,
              "If the sets would gain nothing: mean share of the Gaussians that the sampled cells see. "
              "There "
              "are no cells then, and everything is drawn. Otherwise 0.")
      .def_prop_ro("cells", &V::cells, "Number of cells.")
      .def_prop_ro("bytes", &V::bytes, "Bytes of the sets.")
      .def_prop_ro(
          "keys",
          [](const V& v) {
            std::vector<std::int32_t> made;
            for (const V::Key& key : v.keys) made.insert(made.end(), key.begin(), key.end());
            return array_from(std::move(made), {v.cells(), 3});
          },
          nb::sig("def keys(self) -> numpy.typing.NDArray[numpy.int32]"),
          "The cells, [cells][3]. Cell k spans [k, k + 1) times `cell` along each axis.")
      .def("mean_share", &V::mean_share, "Mean share of the chunks that a cell sees.")
      .def("mean_row_share", &V::mean_row_share, nb::arg("cloud_rows"),
           "Mean share of the Gaussians that a cell sees, for a cloud of this many.")
      .def(
          "count_seen_rows",
          [](const V& v, std::size_t cell, std::size_t rows) {
            check_cell(v, cell);
            return v.count_seen_rows(cell, rows);
          },
          nb::arg("cell_index"), nb::arg("cloud_rows"),
          "Number of Gaussians that a cell sees, for a cloud of `cloud_rows` Gaussians.")
      .def("cell_of", &V::cell_of, nb::arg("camera"), nb::arg("world_from_asset") = Similarity{},
           "Index of the cell whose set applies to a camera. None: everything may be seen.");
}

void bind_levels(nb::module_& m) {
  m.def("build_lod", make_lod, nb::arg("device"), nb::arg("cloud"), nb::arg("settings") = LodSettings{},
        nb::arg("progress") = nb::none(),
        nb::sig("def build_lod(device: Device | str, cloud: GaussianCloud, settings: LodSettings = ..., "
                "progress: collections.abc.Callable[[float], object] | None = None) -> LodTree"),
        "Builds the levels of detail of a cloud, on the device's threads (for a GPU, on those of the "
        "CPU). It takes about 15 s for each million Gaussians on one core.\n\n"
        "`progress(share)` is called some hundred times with the share that is done. Its exceptions and "
        "Ctrl-C end the call. Raises InvalidArgument naming the setting.");
  m.def("build_visible_sets", make_visible_sets, nb::arg("device"), nb::arg("cloud"),
        nb::arg("viewpoints"), nb::arg("settings") = VisibleSettings{},
        nb::arg("world_from_asset") = Similarity{}, nb::arg("progress") = nb::none(),
        nb::sig("def build_visible_sets(device: Device | str, cloud: GaussianCloud, viewpoints: "
                "numpy.typing.NDArray[numpy.float64] | "
                "collections.abc.Sequence[collections.abc.Sequence[float]], "
                "settings: VisibleSettings = ..., world_from_asset: Similarity = ..., "
                "progress: collections.abc.Callable[[float], object] | None = None) -> VisibleSets"),
        "Finds the Gaussians that are seen from each cell. Each of the viewpoints, [V][3] in metres in "
        "the world, costs six frames.\n\n"
        "`progress(share)` is called after each viewpoint. Its exceptions and Ctrl-C end the call. "
        "Raises InvalidArgument naming the setting or viewpoint. If the sets would gain nothing, they "
        "have "
        "no cells, and `refused_share` says why.");
  bind_viewpoints(m);
  // The module gsnav.io has these four.
  m.def(
      "save_lod",
      [](const std::filesystem::path& path, const LodTree& tree, const Cloud& cloud,
         LodSettings settings) { io::save_lod(path, tree, cloud, settings).throw_if_error(); },
      nb::arg("path"), nb::arg("tree"), nb::arg("cloud"), nb::arg("settings") = LodSettings{}, Release(),
      "Writes a tree with a hash of the cloud and settings that it was built from.");
  m.def(
      "load_lod",
      [](const std::filesystem::path& path, const Cloud& cloud, LodSettings settings) {
        return std::make_shared<LodTree>(io::load_lod(path, cloud, settings).value());
      },
      nb::arg("path"), nb::arg("cloud"), nb::arg("settings") = LodSettings{}, Release(),
      "Reads a tree that was built from `cloud` with `settings`. Raises FileNotFound, InvalidArgument "
      "(of another cloud or settings) or InvalidFile.");
  m.def(
      "save_visible_sets",
      [](const std::filesystem::path& path, const VisibleSets& sets, const Cloud& cloud) {
        io::save_visible_sets(path, sets, cloud).throw_if_error();
      },
      nb::arg("path"), nb::arg("sets"), nb::arg("cloud"), Release(),
      "Writes the visible sets of a cloud, with a hash of it.");
  m.def(
      "load_visible_sets",
      [](const std::filesystem::path& path, const Cloud& cloud) {
        return std::make_shared<VisibleSets>(io::load_visible_sets(path, cloud).value());
      },
      nb::arg("path"), nb::arg("cloud"), Release(),
      "Reads the visible sets of `cloud`. Raises FileNotFound, InvalidArgument (of another cloud) or "
      "InvalidFile.");
}

}  // namespace gsnav::python
