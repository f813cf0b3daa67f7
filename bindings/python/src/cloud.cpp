// SPDX-License-Identifier: Apache-2.0
// Clouds of Gaussians, their placement in scenes, and the files that they are written to.
#include <nanobind/stl/filesystem.h>

#include <algorithm>
#include <numeric>

#include "arrays.hpp"
#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/io.hpp"
#include "gsnav/scene/lod_tree.hpp"
#include "gsnav/scene/visible_sets.hpp"

namespace gsnav::python {
namespace {

using Cloud = GaussianCloud;
using Release = nb::call_guard<ReleaseGil>;

/// Planes of numbers [N] as a new array [N][planes].
template <std::size_t P>
nb::object columns(const std::array<std::vector<float>, P>& planes) {
  const std::size_t n = planes[0].size();
  std::vector<float> made(n * P);
  {
    const ReleaseGil release;
    for (std::size_t k = 0; k < P; ++k) {
      for (std::size_t i = 0; i < n; ++i) made[i * P + k] = planes[k][i];
    }
  }
  return array_from(std::move(made), {n, P});
}

nb::object means(const Cloud& c) {
  std::vector<double> made(3 * c.size());
  {
    const ReleaseGil release;
    for (std::size_t i = 0; i < c.size(); ++i) {
      const Vec3d mean = c.mean(i);
      for (int k = 0; k < 3; ++k) made[3 * i + static_cast<std::size_t>(k)] = mean[k];
    }
  }
  return array_from(std::move(made), {c.size(), 3});
}

nb::object higher_bands(const Cloud& c) {
  const auto bands = static_cast<std::size_t>(sh_coefficient_count(c.sh_degree) - 1);
  if (!c.compact()) return array_copy(std::span<const float>(c.shN), {c.size(), bands, 3});
  std::vector<float> made(c.shN_half.size());
  {
    const ReleaseGil release;
    std::transform(c.shN_half.begin(), c.shN_half.end(), made.begin(), half_to_float);
  }
  return array_from(std::move(made), {c.size(), bands, 3});
}

nb::object reading_order(const Cloud& c) {
  if (!c.row_ids.empty()) return array_copy(std::span<const std::uint32_t>(c.row_ids), {c.size()});
  std::vector<std::uint32_t> made(c.size());
  std::iota(made.begin(), made.end(), 0u);
  return array_from(std::move(made), {c.size()});
}

void bind_cloud_class(nb::module_& m) {
  nb::class_<Cloud> c(
      m, "GaussianCloud",
      "N Gaussians in host memory. Scales are linear, opacities lie after the sigmoid, and quaternions "
      "have the length 1. It does not change, and each array is a new one. Rows lie along a curve "
      "through space.");
  c.def("__len__", &Cloud::size)
      .def_prop_ro("size", &Cloud::size, "Number of Gaussians, N.")
      .def_ro("sh_degree", &Cloud::sh_degree, "SH degree of the colours, 0 to 3.")
      .def_ro("sort_order", &Cloud::sort_order, "Order in which Gaussians are blended.")
      .def_ro("color_space", &Cloud::color_space, "Space in which colours are blended.")
      .def_prop_ro("bytes", &Cloud::bytes, "Bytes of the arrays in memory.");
  array_property(c, "means", "float64", "Centres in the asset's frame, metres, [N][3].", means);
  array_property(c, "quats", "float32", "Unit quaternions w, x, y, z, [N][4].",
                 [](const Cloud& g) { return columns(g.quats); });
  array_property(c, "scales", "float32", "Standard deviations along the axes, metres, [N][3].",
                 [](const Cloud& g) { return columns(g.scales); });
  array_property(c, "opacities", "float32", "Opacities, [N], 0 to 1.", [](const Cloud& g) {
    return array_copy(std::span<const float>(g.opacities), {g.size()});
  });
  array_property(c, "sh0", "float32", "SH coefficients of degree 0, [N][3].", [](const Cloud& g) {
    return array_copy(std::span<const float>(g.sh0), {g.size(), 3});
  });
  array_property(c, "shN", "float32",
                 "SH coefficients of higher degrees, [N][(sh_degree + 1)^2 - 1][3].", higher_bands);
  array_property(c, "row_ids", "uint32", "Place of each row in the order of its file, [N].",
                 reading_order);
}

void bind_placement(nb::module_& m) {
  Struct<Similarity>(m, "Similarity",
                     "Placement x_world = scale * rotation * x_asset + translation, in double.")
      .field("rotation", &Similarity::rotation, "Unit quaternion w, x, y, z, shape [4].")
      .field("translation", &Similarity::translation, "Metres, shape [3].")
      .field("scale", &Similarity::scale, "Factor, positive.")
      .done();
}

void bind_assets(nb::module_& m) {
  using A = SceneAsset;
  const auto itself = [](const A& a) { return A(a); };
  nb::class_<A> c(
      m, "SceneAsset",
      "Static Gaussians of a scene, with their placement, levels of detail and visible sets.");
  c.def(
       "__init__",
       [](A* self, std::shared_ptr<const Cloud> cloud, const Similarity& placed,
          std::shared_ptr<const LodTree> lod, std::shared_ptr<const VisibleSets> visible) {
         new (self) A{std::move(cloud), placed, std::move(lod), std::move(visible), {}, {}};
       },
       nb::arg("cloud"), nb::arg("world_from_asset") = Similarity{}, nb::arg("lod") = nb::none(),
       nb::arg("visible") = nb::none(), "Shares its parts with other assets.")
      .def_ro("cloud", &A::cloud, nb::for_getter(nb::sig("def cloud(self) -> GaussianCloud | None")),
              "The Gaussians, or None if they are packed (CloudStorage.packed).");
  bind_member(c, "SceneAsset", "world_from_asset", "Similarity", &A::world_from_asset,
              "Placement in the world.");
  bind_member(c, "SceneAsset", "lod", "LodTree | None", &A::lod,
              "Levels of detail of `cloud` (build_lod), or None.");
  bind_member(c, "SceneAsset", "visible", "VisibleSets | None", &A::visible,
              "Visible sets of `cloud` (build_visible_sets), or None.");
  c.def("__copy__", itself, nb::sig("def __copy__(self) -> SceneAsset"),
        "An asset that shares the parts of this one.")
      .def(
          "__deepcopy__", [itself](const A& a, nb::handle) { return itself(a); }, nb::arg("memo"),
          nb::sig("def __deepcopy__(self, memo: dict[int, object]) -> SceneAsset"),
          "An asset that shares the parts of this one, because they do not change.");
}

}  // namespace

void bind_cloud(nb::module_& m) {
  bind_placement(m);
  bind_cloud_class(m);
  bind_lod_tree(m);
  bind_visible_sets(m);
  bind_assets(m);
}

void bind_scene_files(nb::module_& m) {
  using V = io::ClampedValues;
  Struct<V>(m, "ClampedValues", "Counts of values of a cloud that a format cannot hold.")
      .field("colours", &V::colours, "Colours of degree 0, clamped.")
      .field("scales", &V::scales, "Standard deviations, clamped.")
      .field("bands", &V::bands, "SH coefficients of degrees 1 to 3 that are stored, clamped.")
      .field("lost_bands", &V::lost_bands,
             "Other coefficients, not zero, of degrees that are not stored.")
      .done()
      .def("all", &V::all, "Sum of the four counts.");
  m.def(
      "save_scene",
      [](const std::filesystem::path& path, const Cloud& cloud) {
        io::save_scene(path, cloud).throw_if_error();
      },
      nb::arg("path"), nb::arg("cloud"), Release(),
      "Writes a cloud, in the frame of the asset. The name chooses the format: .compressed.ply, .ply, "
      ".splat, .spz, .sog, DIR/meta.json (SOG) or .glb.\n\n"
      "Rows are written in the order of `row_ids`, except in .compressed.ply. The file gets its name "
      "when it is complete, so a failure leaves the one that was there. Raises Unsupported for another "
      "name, FileNotFound or WriteFailed.");
  m.def(
      "check_scene_output",
      [](const std::filesystem::path& path) { io::check_scene_output(path).throw_if_error(); },
      nb::arg("path"),
      "Raises Unsupported or FileNotFound if save_scene cannot write to `path`. For use before long "
      "work.");
  m.def(
      "count_clamped",
      [](const std::filesystem::path& path, const Cloud& cloud) {
        if (!cloud.compact()) return io::count_clamped(path, cloud);
        Cloud wide = cloud;
        expand_sh(wide);
        return io::count_clamped(path, wide);
      },
      nb::arg("path"), nb::arg("cloud"), Release(),
      "Counts the values that save_scene would clamp or leave out for `path`.");
}

}  // namespace gsnav::python
