// SPDX-License-Identifier: Apache-2.0
#include "gsnav/sim/scene.hpp"

#include <nanobind/stl/shared_ptr.h>

#include "bind.hpp"
#include "fields.hpp"
#include "gsnav/open.hpp"
#include "gsnav/scene/lod_tree.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "guard.hpp"

namespace gsnav::python {
namespace {

void bind_options(nb::module_& m) {
  nb::enum_<CloudStorage>(m, "CloudStorage", "How a scene's Gaussians are kept in memory.")
      .value("full", CloudStorage::full, "Float32.")
      .value("compact", CloudStorage::compact, "SH bands 1 to 3 as binary16: about half of the memory.")
      .value("packed", CloudStorage::packed, "Everything in fewer bits: a third of the memory.");
  nb::enum_<SceneLevels>(m, "SceneLevels", "Levels of detail of a scene's Gaussians.")
      .value("none", SceneLevels::none, "No levels.")
      .value("shipped", SceneLevels::shipped, "Those that a streamed set ships, or else built ones.")
      .value("built", SceneLevels::built, "Built from the finest level.");

  using O = OpenOptions;
  Struct<O>(m, "OpenOptions",
            "What open_scene reads and builds. By default it reads what exists and builds nothing.")
      .field("device", &O::device, "Device that builds levels of detail and visible sets.")
      .field("up", &O::up,
             "Axis of the file that points up: \"x\", \"y\", \"z\" with an optional sign, "
             "\"auto\" or \"keep\".")
      .field("time", &O::time, "Seconds: the moment of a scene that moves (4D Gaussians).")
      .field("level", &O::level, "Level of a streamed set that is opened without `levels`.")
      .field("storage", &O::storage, "How Gaussians are kept in memory.")
      .field("unseen_color", &O::unseen_color,
             "Largest change of a colour for which SH bands are dropped.")
      .field("keep_zero_bands", &O::keep_zero_bands, "Keep all SH bands of the file.")
      .field("levels", &O::levels, "Levels of detail.")
      .field("meshes", &O::meshes, "Paths of triangle meshes to draw among the Gaussians.")
      .field("navmesh", &O::navmesh,
             "The NavMesh: \"\" (the one next to the file), \"none\", \"auto\", "
             "\"build\", \"mesh\", \"gaussians\" or a file.")
      .field(
          "navmesh_settings", &O::navmesh_settings,
          "Settings of a built NavMesh, instead of cell_size, agent_radius and agent_height. Gaussians "
          "get voxels of at most 0.05 m height, or of cell_size if that is larger.")
      .field("cell_size", &O::cell_size, "Edge of the voxels of a built NavMesh, metres.")
      .field("crop", &O::crop,
             "Builds the NavMesh in this box only; world frame, metres. May be infinite.")
      .field("agent_radius", &O::agent_radius, "Radius of the agent of a built NavMesh, metres.")
      .field("agent_height", &O::agent_height, "Height of the agent of a built NavMesh, metres.")
      .field("visible_sets", &O::visible_sets, "Visible sets: \"\" (none), \"auto\" or a file.")
      .field("eye", &O::eye, "A camera like those that will render, for computed visible sets.")
      .field("people", &O::people, "Number of procedural people who walk on the NavMesh.")
      .field("seed", &O::seed, "Seed of the people's paths and looks.")
      .field("density", &O::density, "Factor on the number of Gaussians of \"default\" and of people.")
      .done();
}

/// A name or path as text. Throws TypeError for anything else.
std::string name_from(nb::handle name) {
  const nb::object text = nb::steal(PyOS_FSPath(name.ptr()));
  if (!text.is_valid()) drop_mistake();
  if (!text.is_valid() || !PyUnicode_Check(text.ptr())) {
    throw nb::type_error(
        ("open_scene: name must be a str or an os.PathLike, got " + type_of(name)).c_str());
  }
  return text_of(text);
}

OpenedScene open(nb::handle named, OpenOptions options, const nb::object& progress) {
  const std::string name = name_from(named);
  if (options.levels != SceneLevels::none || options.visible_sets == "auto") {
    check_fork(options.device, "open_scene");  // Other options do not compute on the device.
  }
  options.progress = [&progress](const std::string& task, double share) {
    const HoldGil gil;
    // Signals are handled by the thread that called, if it is the main one.
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    if (progress.is_none()) return;
    try {
      progress(task, share);
    } catch (nb::python_error& e) {
      if (!e.matches(PyExc_Exception)) throw;  // Such as Ctrl-C.
      e.discard_as_unraisable("gsnav.open_scene: progress");
    }
  };
  const ReleaseGil release;
  return open_scene(name, options).value();
}

nb::object itself(nb::handle self) { return nb::borrow(self); }
nb::object itself_with_memo(nb::handle self, nb::handle) { return nb::borrow(self); }

std::vector<AvatarActor> chosen(const std::vector<AvatarActor>& all,
                                const std::vector<std::size_t>& numbers) {
  std::vector<AvatarActor> out;
  for (const std::size_t i : numbers) {
    if (i >= all.size()) {
      throw nb::index_error(
          ("SimulatorScene: people: " + std::to_string(i) + " of " + std::to_string(all.size()))
              .c_str());
    }
    out.push_back(all[i]);
  }
  return out;
}

void bind_opened_scene(nb::module_& m) {
  nb::class_<OpenedScene>(
      m, "OpenedScene",
      "A scene with everything that was found or asked for. World frame: metres, Y up.")
      .def("__copy__", itself, nb::sig("def __copy__(self) -> OpenedScene"), "Returns this object.")
      .def("__deepcopy__", itself_with_memo, nb::arg("memo"),
           nb::sig("def __deepcopy__(self, memo: dict[int, object]) -> OpenedScene"),
           "Returns this object.")
      .def_ro("name", &OpenedScene::name, "The name that was opened.")
      .def_ro("scene", &OpenedScene::scene, "The scene, for renderers and simulators.")
      .def_prop_ro(
          "gaussian_count", [](const OpenedScene& s) { return s.report.kept; },
          "Number of Gaussians that were read.")
      .def_prop_ro(
          "bounds", [](const OpenedScene& s) { return s.report.bounds; },
          "Box of the Gaussians' means in the frame of the file, metres.")
      .def_ro("up", &OpenedScene::up, "The file's up axis.")
      .def_ro("up_guessed", &OpenedScene::up_guessed, "Whether `up` was guessed from the ground.")
      .def_ro("navmesh_source", &OpenedScene::navmesh_source,
              "Origin of the NavMesh; empty without one.")
      .def_ro("notes", &OpenedScene::notes, "A line for each thing that was found or built.")
      .def_ro("warnings", &OpenedScene::warnings, "A line for each thing that was left out.")
      .def_ro("load_seconds", &OpenedScene::load_seconds, "Seconds that reading took.")
      .def_ro("navmesh_seconds", &OpenedScene::navmesh_seconds, "Seconds that the NavMesh took.");
}

}  // namespace

void bind_scene(nb::module_& m) {
  nb::class_<SimulatorScene>(m, "SimulatorScene",
                             "Everything that a simulator runs in. It does not change, so renderers and "
                             "simulators share it.")
      .def(
          "__init__",
          [](SimulatorScene* self, const std::optional<SceneArg>& scene,
             std::shared_ptr<const NavMesh> navmesh, std::optional<std::vector<SceneAsset>> assets,
             const std::optional<std::vector<std::size_t>>& people) {
            SimulatorScene made = scene ? *scene->scene : SimulatorScene{};
            if (navmesh != nullptr) made.navmesh = std::move(navmesh);
            if (assets) made.assets = std::move(*assets);
            if (people) made.avatars = chosen(made.avatars, *people);
            new (self) SimulatorScene(std::move(made));
          },
          nb::arg("scene") = nb::none(), nb::arg("navmesh") = nb::none(), nb::arg("assets") = nb::none(),
          nb::arg("people") = nb::none(),
          "A scene that shares the parts of `scene` (None: nothing), with another NavMesh or other sets "
          "of Gaussians if they are given. `people`: numbers of the people that it keeps; None keeps "
          "all. Raises IndexError for a number that is out of range.")
      .def_ro("assets", &SimulatorScene::assets, nb::rv_policy::copy,
              "Sets of static Gaussians: a new list of copies that share their parts.")
      .def_ro("navmesh", &SimulatorScene::navmesh, "Surface that agents walk on, or None.")
      .def("__copy__", itself, nb::sig("def __copy__(self) -> SimulatorScene"), "Returns this object.")
      .def("__deepcopy__", itself_with_memo,
           nb::sig("def __deepcopy__(self, memo: dict[int, object]) -> SimulatorScene"),
           "Returns this object, because scenes do not change. Gymnasium copies arguments of "
           "environments.")
      .def_prop_ro(
          "avatar_count", [](const SimulatorScene& s) { return s.avatars.size(); }, "Number of people.")
      .def_prop_ro(
          "asset_count", [](const SimulatorScene& s) { return s.assets.size(); },
          "Number of sets of static Gaussians.")
      .def_prop_ro(
          "mesh_count", [](const SimulatorScene& s) { return s.meshes.size(); },
          "Number of triangle meshes.");
  bind_options(m);

  bind_opened_scene(m);
  m.def(
      "open_scene", open, nb::arg("name").none(), nb::arg("options") = OpenOptions{},
      nb::arg("progress") = nb::none(),
      nb::sig("def open_scene(name: str | os.PathLike[str], options: OpenOptions = ..., "
              "progress: collections.abc.Callable[[str, float], object] | None = None) -> OpenedScene"),
      "Opens a scene by its name: \"default\" (the flat that gsnav makes without data), a file (PLY, "
      "SOG, "
      "SPZ, glTF, ...), a folder, or a scene of a Habitat dataset.\n\n"
      "`progress(task, share)` is called from time to time, from any thread. Its errors are printed, "
      "and "
      "Ctrl-C ends the work, also without `progress`. Raises FileNotFound, InvalidFile, Unsupported, "
      "InvalidArgument or NothingNavigable, naming the file or the option.");
  m.def(
      "views_around",
      [](const OpenedScene& scene, int count, int width, int height, double hfov) {
        return views_around(scene, count, width, height, hfov).value();
      },
      nb::arg("scene"), nb::arg("count"), nb::arg("width"), nb::arg("height"), nb::arg("hfov") = 60.0,
      nb::call_guard<ReleaseGil>(),
      "`count` cameras on a circle around a scene, looking at its middle. `count` is 1 to 100000, "
      "`hfov` in degrees.");
  m.def(
      "framing_camera",
      [](const OpenedScene& scene, int width, int height, double hfov) {
        return framing_camera(scene, width, height, hfov).value();
      },
      nb::arg("scene"), nb::arg("width"), nb::arg("height"), nb::arg("hfov") = 75.0,
      nb::call_guard<ReleaseGil>(),
      "A camera that shows a scene. With a NavMesh it stands at eye height on the largest island.");
}

}  // namespace gsnav::python
