// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "casters.hpp"

namespace gsnav::python {

void bind_errors(nb::module_& m);
void bind_device(nb::module_& m);
void bind_camera(nb::module_& m);
void bind_navmesh(nb::module_& m);
void bind_scene(nb::module_& m);
void bind_cloud(nb::module_& m);
void bind_edits(nb::module_& m);
void bind_lod_tree(nb::module_& m);
void bind_visible_sets(nb::module_& m);
void bind_scene_files(nb::module_& m);
void bind_levels(nb::module_& m);
void bind_eval(nb::module_& m);
void bind_render_settings(nb::module_& m);
void bind_renderer(nb::module_& m);
void bind_noise(nb::module_& m);
void bind_task(nb::module_& m);
void bind_episodes(nb::module_& m);
void bind_planned_scene(nb::module_& m);
void bind_settings(nb::module_& m);
void bind_world(nb::module_& m);
void bind_simulator(nb::module_& m);
void bind_device_array(nb::module_& m);
void bind_batch(nb::module_& m);
void bind_avatar_tracker(nb::module_& m);
void bind_habitat(nb::module_& m);
/// Gives the functions of a module better errors for wrong arguments.
void mend_call_errors(nb::module_& m);

}  // namespace gsnav::python
