// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/shared_ptr.h>

#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/demo.hpp"
#include "progress.hpp"

namespace gsnav::python {

void bind_planned_scene(nb::module_& m) {
  nb::enum_<SurfaceKind>(m, "SurfaceKind", "Material of a generated scene.")
      .value("gaussians", SurfaceKind::gaussians, "Gaussians.")
      .value("mesh", SurfaceKind::mesh, "Triangles with the colours that Gaussians have there.");
  using O = FloorPlanOptions;
  Struct<O>(m, "FloorPlanOptions", "Settings of the flat that planned_simulator_scene makes.")
      .field("seed", &O::seed, "Seed of all random choices.")
      .field("rooms", &O::rooms, "Number of rooms, 1 to 12.")
      .field("clearance", &O::clearance,
             "A disc of this radius passes through every doorway, metres, in [0.1, 0.35].")
      .done();
  m.def(
      "planned_simulator_scene",
      [](O plan, std::size_t people, std::uint64_t seed, double density, TaskConfig task,
         SurfaceKind kind) {
        return std::make_shared<SimulatorScene>(
            planned_simulator_scene(plan, people, seed, density, task, kind, stop_after_signal).value());
      },
      nb::arg("plan") = O{}, nb::arg("people") = 0, nb::arg("seed") = 1, nb::arg("density") = 1.0,
      nb::arg("task") = TaskConfig{}, nb::arg("kind") = SurfaceKind::gaussians,
      nb::call_guard<ReleaseGil>(),
      "A random furnished flat with its NavMesh for the body of `task`, and people who walk in it. The "
      "same arguments give the same scene. `density` is the factor on the number of Gaussians of the "
      "flat and of the people, in [0.05, 20]. With SurfaceKind.mesh the flat has triangles in place of "
      "Gaussians, with an equal NavMesh and equal people. There are at most 1000 people. Ctrl-C ends "
      "the call "
      "at the next one.");
}

}  // namespace gsnav::python
