// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "journal.hpp"

namespace gsnav_eval {

/// An episode on the page; pictures are PNG files' bytes, empty where there is none.
struct Entry {
  const Record* record = nullptr;
  std::string strip, map;
};

/// The evaluation as one HTML page that needs nothing else.
std::string page(const Options& options, const gsnav::MetricsSummary& summary, const std::vector<Entry>& entries);

}  // namespace gsnav_eval
