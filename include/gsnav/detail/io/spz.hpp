// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// Options of load_spz.
struct LoadSpzOptions {
  /// Keep the file's axes. Otherwise they are taken for SPZ's (x right, y up, z backwards) and turned to
  /// those of a PLY (x right, y down, z forward), by half a turn about x that includes SH bands.
  bool keep_axes = false;
};

/// Reads Niantic's SPZ, versions 1 to 3 (one gzip stream) and 4 (one zstd stream for each field).
/// Positions have 24 bits (float16 in version 1), log-scales 8 bits in steps of 1/16, quaternions 3 x 8
/// bits (from version 3 on 3 x 10), and colours, opacities and SH bands 8 bits. The fourth SH band is
/// left out, with a warning. The antialiased flag sets the filter to mip. Extensions are skipped with a
/// warning. Versions 3 and 4 are tested on bytes that Niantic's own library wrote; versions 1 and 2 are
/// untested on a real file.
///
/// No allocation exceeds 1 MiB plus 1000 times the file's size: streams may grow 100 times, and bytes
/// become floats. Never throws. Errors: file_not_found; invalid_file (a stream that is damaged or has
/// another size, a bad header, fewer bytes than the count needs, more Gaussians than the number of bytes
/// makes plausible); unsupported (other versions); out_of_memory.
Result<LoadedCloud> load_spz(const std::filesystem::path& path, const LoadSpzOptions& options = {});

/// Reads the bytes of a file. `source` names them in messages and in the report.
Result<LoadedCloud> parse_spz(std::span<const std::byte> bytes, std::string source,
                              const LoadSpzOptions& options = {});

/// Options of save_spz.
struct SaveSpzOptions {
  /// Keep the cloud's axes. Otherwise they are taken for those of a PLY and turned to the axes of SPZ.
  bool keep_axes = false;
  /// Positions are stored in steps of 2^-fractional_bits metres, 0 to 23. Fewer bits are used if the
  /// farthest mean does not fit into 24 bits (at 12 bits: beyond 2047.9 m).
  int fractional_bits = 12;
  /// Bits kept of SH bands of degree 1 and of higher ones, 1 to 8. Fewer bits make smaller files;
  /// Niantic's own writer keeps 5 and 4.
  int sh1_bits = 8, sh_rest_bits = 8;
};

/// Writes a cloud as SPZ version 4, rows in the order in which they were read. The mip filter becomes
/// the antialiased flag. Values outside of the format's ranges are clamped. Errors on reading back:
///
/// - mean: half of a step.
/// - log-scale in [-10, 5.9]: 1/32.
/// - opacity: 1/510.
/// - SH coefficient of degree 0, in [-3.3, 3.3]: 1/76.
/// - other SH coefficients of magnitude up to 1 - 2^(1 - bits): 2^-bits.
/// - the three smaller components of a quaternion: 0.0007.
///
/// Errors: file_not_found (the parent folder is missing); write_failed; invalid_argument (arrays of
/// different lengths, options out of range, a mean beyond 8388 km); out_of_memory. Never throws.
Status save_spz(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SaveSpzOptions& options = {});

}  // namespace gsnav::io
