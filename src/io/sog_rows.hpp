// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io::detail {

/// The rows [first, first + count) of a file.
struct RowRange {
  std::uint64_t first = 0, count = 0;
  bool operator==(const RowRange&) const = default;
};

/// Reads some rows of a SOG, in the order of the ranges. If `kept` is not null, it gets 1 for each row
/// of the ranges that is in the cloud, else 0. Errors: those of load_sog; invalid_file (a range that
/// ends beyond the file's count).
Result<LoadedCloud> load_sog_rows(const std::filesystem::path& path, const std::vector<RowRange>& ranges,
                                  std::vector<std::uint8_t>* kept = nullptr);

}  // namespace gsnav::io::detail
