// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "casters.hpp"
#include "gsnav/sim/config.hpp"

namespace gsnav::python {

/// A Python function that gives memory for images, the arrays that it gave for the last call, and the
/// exception that it raised last.
struct PythonImageSource {
  nb::object function;  ///< None: the simulator has memory of its own.
  nb::list given;
  std::optional<nb::python_error> error;
};

/// An ImageSource that calls `source` while it holds the GIL. The arrays must lie where `config` leaves
/// images of `device`.
ImageSource image_source(std::shared_ptr<PythonImageSource> source, const Device& device,
                         const BatchConfig& config);

}  // namespace gsnav::python
