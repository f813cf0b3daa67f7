// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "casters.hpp"
#include "gsnav/sim.hpp"

namespace gsnav::python {

/// BatchStep whose spans are numpy arrays. Those with a row per environment are views, made when they
/// are asked for: the memory of `info` belongs to `owner`, and does not move.
struct PythonStep {
  BatchInfo info;
  nb::object owner, finished, final_metrics, final_point_goals;
  nb::dict images, final_images, on_backend, final_on_backend;
};

/// Binds PythonStep as BatchStep.
void bind_step(nb::module_& m);

}  // namespace gsnav::python
