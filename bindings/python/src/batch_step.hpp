// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "casters.hpp"

namespace gsnav::python {

/// BatchStep whose spans are numpy arrays.
struct PythonStep {
  nb::object rewards, terminated, truncated, infos, point_goals, times, finished, final_metrics,
      final_point_goals;
  nb::dict images, final_images, on_backend, final_on_backend;
};

/// Binds PythonStep as BatchStep.
void bind_step(nb::module_& m);

}  // namespace gsnav::python
