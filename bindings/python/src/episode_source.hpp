// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "casters.hpp"
#include "gsnav/detail/sim/batch_world.hpp"

namespace gsnav::python {

/// A Python function that returns episodes, and the exception that it raised last.
struct PythonSource {
  nb::object function;
  std::optional<nb::python_error> error;
};

/// An EpisodeSource that calls `source` while it holds the GIL. An exception becomes an error of C++ and
/// is kept in `source`.
EpisodeSource episode_source(std::shared_ptr<PythonSource> source);

}  // namespace gsnav::python
