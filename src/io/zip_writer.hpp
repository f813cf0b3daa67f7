// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// Builds a zip archive in memory, without dates, so that the same entries give the same bytes.
class ZipWriter {
 public:
  /// `source` names the archive in messages.
  explicit ZipWriter(std::string source) : source_(std::move(source)) {}

  /// Errors: invalid_argument (a name that ZipReader would refuse, or one twice); unsupported (the
  /// archive would reach 4 GiB or 65535 entries); out_of_memory.
  Status add(const std::string& name, std::string_view content, bool deflated);

  /// What has been added so far.
  const std::string& entries() const noexcept { return entries_; }
  /// What comes behind the entries at the end of the archive.
  std::string finish() const;

 private:
  std::string source_, entries_, directory_;
  std::set<std::string> names_;
};

}  // namespace gsnav::io::detail
