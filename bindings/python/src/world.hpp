// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "casters.hpp"
#include "gsnav/sim/world.hpp"
#include "guard.hpp"

namespace gsnav::python {

/// A World of a simulator, which it keeps alive. Each use holds the simulator's flag.
struct WorldView {
  nb::object owner;                  ///< Keeps the simulator alive.
  Busy* busy = nullptr;              ///< Flag of the simulator.
  std::function<const World&()> of;  ///< Returns the world. Throws gsnav::Error if there is none.
};

}  // namespace gsnav::python
