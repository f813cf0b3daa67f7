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

/// Reads Niantic's SPZ, versions 1 to 3 (a gzip stream) and 4 (a zstd stream for each field): positions
/// of 24 bits (float16 in version 1), log-scales of 8 bits in steps of 1/16, quaternions of 3 x 8 bits
/// or of 3 x 10 (from version 3), colours, opacities and SH bands of 8 bits. Of SH degree 4 the bands up
/// to degree 3 are read, with a warning; the antialiased flag sets the filter to mip; extensions are
/// skipped with a warning. Versions 1 and 2 are untested on a real file; 3 and 4 are tested on bytes
/// that Niantic's own library wrote.
///
/// Memory is bounded by 100 times the file's size and the cloud that comes out of it. Errors:
/// file_not_found; invalid_file (a stream that is damaged or holds another size, a header that is none,
/// fewer bytes than the count needs, more Gaussians than so few bytes are believed to hold); unsupported
/// (other versions); out_of_memory. Never throws.
Result<LoadedCloud> load_spz(const std::filesystem::path& path, const LoadSpzOptions& options = {});

/// The same for a file's bytes; `source` names them in messages and in the report.
Result<LoadedCloud> parse_spz(std::span<const std::byte> bytes, std::string source,
                              const LoadSpzOptions& options = {});

/// How save_spz writes.
struct SaveSpzOptions {
  /// Keep the cloud's axes. Without it they are taken for those of a PLY and turned to SPZ's own.
  bool keep_axes = false;
  /// Positions are in steps of 2^-fractional_bits metres, 0 to 23; fewer bits are used where the
  /// farthest mean would not fit into 24 bits (at 12 bits: beyond 2047.9 m).
  int fractional_bits = 12;
  /// Bits kept of the SH bands of degree 1 and of higher ones, 1 to 8. Fewer make smaller files;
  /// Niantic's own writer keeps 5 and 4.
  int sh1_bits = 8, sh_rest_bits = 8;
};

/// Writes a cloud as SPZ version 4, rows in the order in which they were read; the mip filter becomes
/// the antialiased flag. Read back, a mean is within half of its step, a log-scale within 1/32 (where it
/// is in [-10, 5.9]), an opacity within 1/510, a degree-0 SH coefficient within 1/76 (where it is
/// within 3.3 of zero), another one within 2^-bits (where its magnitude is at most 1 - 2^(1 - bits)),
/// the quaternion's smaller components within 0.0007. What lies outside of these ranges becomes their
/// nearer end. Errors: file_not_found (the parent folder is missing), write_failed;
/// invalid_argument (arrays of different lengths, options out of range, a mean beyond 8388 km);
/// out_of_memory. Never throws.
Status save_spz(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SaveSpzOptions& options = {});

}  // namespace gsnav::io
