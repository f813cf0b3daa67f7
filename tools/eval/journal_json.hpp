// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "gsnav/core/status.hpp"

namespace gsnav_eval {

using Json = nlohmann::ordered_json;

/// Parses a line of JSON. Nesting is limited, because copies and dump() recurse.
inline Json parse_line(const std::string& line) {
  constexpr int kDepth = 4;  // Lines of a journal have two levels.
  return Json::parse(line, [](int depth, Json::parse_event_t, const Json&) {
    if (depth > kDepth)
      throw gsnav::Error(gsnav::Errc::invalid_file,
                         "is JSON nested more than " + std::to_string(kDepth) + " deep");
    return true;
  });
}

}  // namespace gsnav_eval
