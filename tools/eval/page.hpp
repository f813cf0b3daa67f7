// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "journal.hpp"

namespace gsnav_eval {

/// Picture embedded in the page. No bytes: there is none.
struct Picture {
  const char* type = "png";
  std::string bytes;
};
/// Converts a PNG file for the page. If the build has libjpeg, the result is a JPEG of about a tenth of
/// the size.
/// @return an error of reading the file.
gsnav::Result<Picture> page_picture(const std::string& png_file);

/// An episode on the page.
struct Entry {
  const Record* record = nullptr;
  Picture strip, map;
};

/// The evaluation as one self-contained HTML page.
std::string page(const Options& options, const gsnav::MetricsSummary& summary,
                 const std::vector<Entry>& entries);

}  // namespace gsnav_eval
