// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// Builds a zip archive in memory. It has no dates, so that the same entries give the same bytes.
class ZipWriter {
 public:
  /// `source` names the archive in messages.
  explicit ZipWriter(std::string source) : source_(std::move(source)) {}

  /// Adds an entry. Errors: invalid_argument (a name that ZipReader would refuse, or that occurs twice);
  /// unsupported (the archive would reach 4 GiB or 65535 entries); out_of_memory.
  Status add(const std::string& name, std::string_view content, bool deflated);

  /// The bytes of all entries so far.
  const std::string& entries() const noexcept { return entries_; }
  /// The bytes that end the archive, after the entries.
  std::string finish() const;

 private:
  std::string source_, entries_, directory_;
  std::set<std::string> names_;
};

}  // namespace gsnav::io::detail
