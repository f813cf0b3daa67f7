// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io::detail {

/// Rows [first, first + count) of a file.
struct RowRange {
  std::uint64_t first = 0, count = 0;
};

/// load_sog for some rows, in the order of the ranges. Error beside load_sog's: invalid_file (a range
/// that ends behind the file's count).
Result<LoadedCloud> load_sog_rows(const std::filesystem::path& path, const std::vector<RowRange>& ranges);

}  // namespace gsnav::io::detail
