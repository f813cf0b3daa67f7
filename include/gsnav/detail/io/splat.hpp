// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// Reads antimatter15's `.splat`: records of 32 bytes and nothing else. Three float32 of position
/// (metres), three of scale (linear, metres), colour and opacity as four bytes, the quaternion w, x, y,
/// z as four bytes around 128. There are no SH bands, and nothing tells a file cut between two records
/// (save_splat leaves none: its files take their name when they are whole).
/// Untested on a real file.
///
/// Rows that hold no drawable Gaussian (also those of negative scale) are dropped and counted in the
/// report. Errors: file_not_found; invalid_file (an empty file, a size that is no multiple of 32);
/// out_of_memory. Never throws.
Result<LoadedCloud> load_splat(const std::filesystem::path& path);

/// The same for a file's bytes; `source` names them in messages and in the report.
Result<LoadedCloud> parse_splat(std::span<const std::byte> bytes, std::string source);

/// Writes a cloud as `.splat`, rows in the order in which they were read. What the format has no place
/// for is lost: SH bands, the filter, float64 positions. Colours are clamped to [0, 1]; read back,
/// colours and opacities are within 1/510, positions and scales within float32's rounding, quaternion
/// components within 1/64. Errors: file_not_found (the parent folder is missing, or the file cannot be
/// written); invalid_argument (arrays of different lengths, an empty cloud). Never throws.
Status save_splat(const std::filesystem::path& path, const GaussianCloud& cloud);

}  // namespace gsnav::io
