// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "casters.hpp"
#include "gsnav/detail/sim/task.hpp"

namespace gsnav::python {

/// Actions of a batch: all discrete or all velocities.
using BatchActions = std::variant<std::vector<Action>, std::vector<VelocityCommand>>;

/// Reads an action from an Action, an integer, or an integer array without dimensions. Throws if it is
/// anything else or out of range.
Action action_from(nb::handle value, const char* what);

/// Reads one action per environment from an array of integers [N], or a sequence of actions, integers or
/// velocities. Throws a Python exception or gsnav::Error that names the environment and the value.
BatchActions batch_actions(nb::handle source, std::size_t environments);

/// Reads actions below `count` from a contiguous array [N] of int64 or int32. Returns nothing for any
/// other object or value, and sets no error. It is quick when Python's own functions have left the
/// caches.
std::optional<std::vector<Action>> plain_actions(nb::handle source, std::size_t environments,
                                                 std::size_t count) noexcept;

/// Reads a mask: None (empty) or an array of bool [N].
std::vector<std::uint8_t> reset_mask(nb::handle source, std::size_t environments);

}  // namespace gsnav::python
