// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "arrays.hpp"
#include "gsnav/sim/metrics.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav::python {

/// numpy's dtype of a StepInfo, with the names of its fields.
nb::object step_info_dtype();
/// numpy's dtype of an EpisodeMetrics, with the names of its fields.
nb::object metrics_dtype();

/// A read-only structured array [n] of memory that belongs to `owner`, which it keeps alive.
template <class T>
nb::object structured_view(std::span<const T> rows, nb::handle dtype, nb::handle owner) {
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(rows.data());
  return array_view(bytes, {rows.size_bytes()}, owner).attr("view")(dtype);
}

/// A structured array [n] with a copy of the rows.
template <class T>
nb::object structured_copy(std::span<const T> rows, nb::handle dtype) {
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(rows.data());
  return array_copy(std::span(bytes, rows.size_bytes()), {rows.size_bytes()}).attr("view")(dtype);
}

}  // namespace gsnav::python
