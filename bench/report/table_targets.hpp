// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "table.hpp"

namespace gsnav_report {

/// Something that is to be reached by one setting beside another, of one scene, size and backend: what
/// no row says alone.
struct TargetCheck {
  std::string scene, size, backend;
  std::string measure;  ///< "lod: times faster than fast"
  double limit = 0.0;   ///< in the unit that `measure` names
  double value = 0.0;
  bool at_least = false;  ///< the limit is a lower one
  std::string note;       ///< what else there is to know
  std::size_t views = 0;  ///< that it was found from

  bool met() const noexcept { return at_least ? value >= limit : value <= limit; }
};

/// Every target that the table has rows for: levels of detail beside `fast`, culling by chunks, frames
/// of depths alone, memory of packed scenes.
std::vector<TargetCheck> check_targets(const Table& table);

/// The same as lines of text.
std::string targets_text(const std::vector<TargetCheck>& checks);

}  // namespace gsnav_report
