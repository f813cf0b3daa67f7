// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// How load_spz reads.
struct LoadSpzOptions {
  /// Keep the file's axes. Without it they are taken for SPZ's own (x right, y up, z backwards) and
  /// turned to those of a PLY (x right, y down, z forward) by half a turn about x, SH bands included.
  bool keep_axes = false;
};

/// Reads Niantic's SPZ, versions 1 to 3 (a gzip stream): positions of 24 bits (float16 in version 1),
/// log-scales of 8 bits in steps of 1/16, quaternions of 3 x 8 bits or of 3 x 10 (version 3), colours,
/// opacities and SH bands of 8 bits. Of SH degree 4 the bands up to degree 3 are read, with a warning;
/// the antialiased flag sets the filter to mip; extensions are skipped with a warning. Versions 1 and 2
/// are untested on a real file; version 3 is tested on bytes that Niantic's own library wrote.
///
/// Errors: file_not_found; invalid_file (no gzip stream or one that is damaged, a header that is none,
/// fewer bytes than the count needs, more Gaussians than so few bytes are believed to hold);
/// unsupported (other versions; version 4 is compressed by zstd); out_of_memory. Never throws.
Result<LoadedCloud> load_spz(const std::filesystem::path& path, const LoadSpzOptions& options = {});

/// The same for a file's bytes; `source` names them in messages and in the report.
Result<LoadedCloud> parse_spz(std::span<const std::byte> bytes, std::string source,
                              const LoadSpzOptions& options = {});

}  // namespace gsnav::io
