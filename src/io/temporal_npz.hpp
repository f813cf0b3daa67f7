// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/detail/io/temporal_file.hpp"

namespace gsnav::io::detail {

/// Implements load_temporal for an `.npz`.
Result<LoadedTemporalCloud> load_temporal_npz(const std::filesystem::path& path);

}  // namespace gsnav::io::detail
