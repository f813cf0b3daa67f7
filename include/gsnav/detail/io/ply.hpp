// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// Reads a Gaussian PLY in INRIA's layout: x y z (metres), f_dc_0..2, opacity (logit), scale_0..2
/// (natural logarithm), rot_0..3 (w, x, y, z, of any length), and f_rest_* for SH degree 1 to 3.
///
/// The file is ascii or binary of either byte order. Properties may have any order and any scalar type;
/// others (nx ny nz, ...) and other elements are skipped. f_rest is channel-major with 0, 9, 24 or 45
/// properties; of 72 (degree 4) the bands up to degree 3 are read, with a warning. A comment
/// `SplatRenderMode: mip` or `antialiased 1` sets the cloud's filter to mip.
///
/// Two other layouts are read too:
///
/// - PlayCanvas' compressed PLY (`.compressed.ply`), recognised by its header: `chunk` with 12 or 18
///   float properties, `vertex` with four packed uint, and optionally `sh` with 9, 24, 45 or 72 uchar.
/// - Points with `red green blue` (bytes, 16 bits, or floats in [0, 1]) and no shapes. They become round
///   Gaussians of opacity 0.99 whose standard deviation is the root mean square distance to the three
///   nearest points, the usual start of training. In a file with shapes, these colours replace a missing
///   f_dc.
///
/// Rows that are not drawable Gaussians are dropped and counted in the report. Never throws.
/// @return the result, or one of these errors:
/// - file_not_found.
/// - invalid_file: malformed header, fewer rows than promised, a property that is missing or occurs
///   twice, a wrong number of f_rest, or chunks that do not fit the vertices.
/// - unsupported: list properties of a vertex, or a compressed PLY with lists or in another format than
///   binary_little_endian.
/// - out_of_memory.
Result<LoadedCloud> load_ply(const std::filesystem::path& path);

/// Reads the bytes of a file. `source` names them in messages and in the report.
Result<LoadedCloud> parse_ply(std::span<const std::byte> bytes, std::string source);

/// Options of save_ply.
struct SavePlyOptions {
  /// Write x y z as float64. INRIA's float32 is coarser than a GaussianCloud from some kilometres away
  /// from zero on, but several readers accept nothing else.
  bool double_positions = false;
};

/// Writes a cloud in INRIA's layout: little endian, float32, f_rest as needed by the cloud's degree,
/// rows in the order in which they were read (`row_ids`). A cloud read from such a file is read back bit
/// for bit, so that images are equal, ties of depth included. Other opacities are read back as the
/// nearest that a float32 logit can express. An opacity of 1 is written as logit 18, which is 1 again in
/// float32. A scale of 0 is written as -infinity, which load_ply reads. The mip filter becomes a
/// comment; eps2d and sort_order are lost.
///
/// Errors: file_not_found (the parent folder is missing, or the file cannot be written; an existing file
/// is unchanged); invalid_argument (arrays of different lengths).
Status save_ply(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SavePlyOptions& options = {});

/// Writes a cloud as PlayCanvas' compressed PLY, with 18 properties for each chunk. Rows are in the
/// cloud's order, because the 256 rows of a chunk share their bounds: call sort_spatially first. They
/// are not in the order in which they were read, so ties of depth are drawn in another order.
///
/// Values are read back within half of their step. Steps are, of the chunk's range, 1/2047 (y: 1/1023)
/// for positions and log-scales and 1/255 for colours; 1/255 for opacities; 0.0014 for quaternion
/// components; 1/32 for SH coefficients in [-4, 4] (the outermost codes are read at their ends).
/// Log-scales are clamped to [-20, 20], -infinity too. Errors: those of save_ply.
Status save_compressed_ply(const std::filesystem::path& path, const GaussianCloud& cloud);

}  // namespace gsnav::io
