// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// Reads `.ksplat` (version 0, GaussianSplats3D): sections of records with compression level 0
/// (float32), 1 (16 bits) or 2 (8 bits for SH), and SH degree 0 to 3. Positions of levels 1 and 2 are
/// steps from the centre of their bucket. Scales are linear in the file. Untested on a real file.
///
/// Rows that are not drawable Gaussians are dropped and counted in the report. Errors name the section,
/// the field and its value: file_not_found; invalid_file
/// (counts, buckets or sections that do not fit each other or the data); unsupported (other versions and
/// levels); out_of_memory. Never throws.
Result<LoadedCloud> load_ksplat(const std::filesystem::path& path);

/// Reads the bytes of a file. `source` names them in messages and in the report.
Result<LoadedCloud> parse_ksplat(std::span<const std::byte> bytes, std::string source);

}  // namespace gsnav::io
