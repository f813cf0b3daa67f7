// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// Reads `.ksplat` (version 0, GaussianSplats3D): sections of records, compression levels 0 (float32),
/// 1 (16 bits) and 2 (8 bits for SH), SH degree 0 to 3. Positions of levels 1 and 2 are steps around
/// the centre of their bucket. Scales are linear in the file. Untested on a real file.
///
/// Rows that hold no drawable Gaussian are dropped and counted in the report. Errors name the section,
/// the field and its value: file_not_found; invalid_file (counts, buckets or sections that do not fit
/// each other or the bytes there are); unsupported (other versions and levels); out_of_memory. Never
/// throws.
Result<LoadedCloud> load_ksplat(const std::filesystem::path& path);

/// The same for a file's bytes; `source` names them in messages and in the report.
Result<LoadedCloud> parse_ksplat(std::span<const std::byte> bytes, std::string source);

}  // namespace gsnav::io
