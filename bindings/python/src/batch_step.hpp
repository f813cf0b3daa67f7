// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "batch_core.hpp"
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

/// New arrays of images, by their addresses, that are filled when the images are complete.
using Unfilled = std::vector<std::pair<std::span<const float>, float*>>;

/// Arrays of a step. Those of the episodes that ended are copies, because their sizes change from step
/// to step. `unfilled` gets images to be copied later: those of `s` need not be complete.
/// @param owner Keeps the memory of `s` alive.
PythonStep step_arrays(const BatchStep& s, const BatchCore& b, nb::handle owner, Unfilled& unfilled);

/// Binds PythonStep as BatchStep.
void bind_step(nb::module_& m);

}  // namespace gsnav::python
