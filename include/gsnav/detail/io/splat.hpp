// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// Reads antimatter15's `.splat`: records of 32 bytes without a header. A record has three float32 of
/// position (metres), three of scale (linear, metres), colour and opacity as four bytes, and the
/// quaternion w, x, y, z as four bytes around 128. There are no SH bands. A file that is truncated
/// between two records cannot be detected; save_splat never leaves one, as it renames files once they
/// are complete. Untested on a real file.
///
/// Rows that are not drawable Gaussians (also those with a negative scale) are dropped and counted in
/// the report. Errors: file_not_found; invalid_file (an empty file, a size that is not a multiple of
/// 32); out_of_memory. Never throws.
Result<LoadedCloud> load_splat(const std::filesystem::path& path);

/// Reads the bytes of a file. `source` names them in messages and in the report.
Result<LoadedCloud> parse_splat(std::span<const std::byte> bytes, std::string source);

/// Writes a cloud as `.splat`, rows in the order in which they were read. SH bands, the filter and
/// float64 positions are lost. Colours are clamped to [0, 1]. Errors on reading back: 1/510 for colours
/// and opacities, float32 rounding for positions and scales, 1/64 for quaternion components. Errors:
/// file_not_found (the parent folder is missing, or the file cannot be written); invalid_argument
/// (arrays of different lengths, an empty cloud). Never throws.
Status save_splat(const std::filesystem::path& path, const GaussianCloud& cloud);

}  // namespace gsnav::io
