// SPDX-License-Identifier: Apache-2.0
// The compiled module gsnav._gsnav. Types are bound before the functions that use them.
#include <cstdlib>

#include "bind.hpp"

namespace {
bool loaded = false;  // The module has been made in this process.
}

NB_MODULE(_gsnav_of_main, m) {
  using namespace gsnav::python;
  // Objects that a daemon thread or a caller's own circle holds at exit are no error of this module.
  nb::set_leak_warnings(std::getenv("GSNAV_LEAK_WARNINGS") != nullptr);
  nb::module_::import_("numpy");  // Without it, this is an ImportError.
  is_masked(nb::none());          // It remembers a type of numpy, before there are threads.
  loaded = true;
  m.doc() = "Compiled part of gsnav. Import gsnav instead.";
  bind_errors(m);
  bind_device(m);
  bind_camera(m);
  bind_navmesh(m);
  bind_render_settings(m);
  bind_cloud(m);
  bind_edits(m);
  bind_scene(m);
  bind_scene_files(m);
  bind_levels(m);
  bind_eval(m);
  bind_renderer(m);
  bind_noise(m);
  bind_task(m);
  bind_episodes(m);
  bind_settings(m);
  bind_world(m);
  bind_simulator(m);
  bind_device_array(m);
  bind_batch(m);
  bind_habitat(m);
  bind_avatar_tracker(m);
  mend_call_errors(m);
}

/// Python calls this function to import the module. nanobind keeps its types per process, and replaces
/// them at the start of an import. A subinterpreter and a second import are therefore refused here.
extern "C" NB_EXPORT PyObject* PyInit__gsnav() {
  if (PyInterpreterState_GetID(PyInterpreterState_Get()) != 0) {
    PyErr_SetString(PyExc_ImportError,
                    "gsnav does not support subinterpreters. Use processes of the start method spawn");
    return nullptr;
  }
  if (loaded) {
    PyErr_SetString(PyExc_ImportError,
                    "gsnav cannot be loaded twice in a process: keep gsnav._gsnav in sys.modules");
    return nullptr;
  }
  return PyInit__gsnav_of_main();
}
