// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "journal.hpp"

namespace gsnav_eval {

/// A picture inside the page; no bytes: there is none.
struct Picture {
  const char* type = "png";
  std::string bytes;
};
/// A PNG file for the page: as a JPEG, a tenth as large, where the build has libjpeg. Errors: those of
/// reading it.
gsnav::Result<Picture> page_picture(const std::string& png_file);

/// An episode on the page.
struct Entry {
  const Record* record = nullptr;
  Picture strip, map;
};

/// The evaluation as one HTML page that needs nothing else.
std::string page(const Options& options, const gsnav::MetricsSummary& summary,
                 const std::vector<Entry>& entries);

}  // namespace gsnav_eval
