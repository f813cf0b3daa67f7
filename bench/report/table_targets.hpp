// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table.hpp"

namespace gsnav_report {

/// A target for one setting relative to another, for one scene, size and backend. No single row shows
/// whether it is reached.
struct TargetCheck {
  std::string scene, size, backend;
  std::string measure;  ///< "lod: times faster than fast"
  double limit = 0.0;   ///< in the unit that `measure` names
  double value = 0.0;
  bool at_least = false;  ///< `limit` is a lower limit
  std::string note;       ///< further remarks
  std::size_t views = 0;  ///< number of views that `value` comes from

  bool met() const noexcept { return at_least ? value >= limit : value <= limit; }
};

/// Checks of all targets that the table has rows for: levels of detail compared with `fast`, culling by
/// chunks, frames of depths alone, memory of packed scenes.
std::vector<TargetCheck> check_targets(const Table& table);

/// The checks as lines of text.
std::string targets_text(const std::vector<TargetCheck>& checks);

}  // namespace gsnav_report
