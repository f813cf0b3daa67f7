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
/// (natural logarithm), rot_0..3 (w, x, y, z, any length), and f_rest_* for SH degree 1 to 3.
///
/// Properties may come in any order and any scalar type; others (nx ny nz, ...) and other elements are
/// skipped. Binary of either byte order and ascii. f_rest is channel-major with 0, 9, 24 or 45
/// properties; of 72 (degree 4) the bands up to degree 3 are read, with a warning. A comment
/// `SplatRenderMode: mip` or `antialiased 1` sets the cloud's filter to mip.
///
/// PlayCanvas' compressed PLY (`.compressed.ply`) is told by its header and read too: `chunk` with 12 or
/// 18 float properties, `vertex` with four packed uint, and optionally `sh` with 9, 24, 45 or 72 uchar.
///
/// Where f_dc is missing and `red green blue` are there, colours come from these (bytes, 16 bits, or
/// floats in [0, 1]). A PLY of points with such colours and no shapes at all is read too, as round
/// Gaussians of opacity 0.99 whose standard deviation is the root mean square distance to the three
/// nearest points, as training begins with them.
///
/// Rows that hold no drawable Gaussian are dropped and counted in the report. Errors: file_not_found;
/// invalid_file (malformed header, fewer rows than promised, a property missing or twice, a count of
/// f_rest that is none of the above, chunks that do not fit the vertices); unsupported (list properties
/// of a vertex, a compressed PLY with lists or in another format than binary_little_endian);
/// out_of_memory. Never throws.
Result<LoadedCloud> load_ply(const std::filesystem::path& path);

/// The same for a file's bytes; `source` names them in messages and in the report.
Result<LoadedCloud> parse_ply(std::span<const std::byte> bytes, std::string source);

/// How save_ply writes.
struct SavePlyOptions {
  /// x y z as float64. INRIA's layout has float32, which far from zero (from some kilometres on) is
  /// coarser than what a GaussianCloud holds; several readers accept nothing else.
  bool double_positions = false;
};

/// Writes a cloud in INRIA's layout, little endian, float32, f_rest as the cloud's degree needs, rows in
/// the order in which they were read (`row_ids`). What was read from such a file is read back bit for
/// bit, so that images are equal, ties of depth included. Opacities of other origin come back as the
/// nearest that a float32 logit has. The mip filter becomes a comment; eps2d and sort_order have no
/// place in the file. Logits are finite: an opacity of 1 is written as 18, which is 1 again in float32.
/// A scale of 0 is written as -infinity, which load_ply reads back. Errors: file_not_found (the parent
/// folder is missing, or the file cannot be written: what had its name is unchanged); invalid_argument
/// (arrays of different lengths).
Status save_ply(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SavePlyOptions& options = {});

/// Writes a cloud as PlayCanvas' compressed PLY with 18 properties a chunk, rows in the cloud's order
/// and not in that in which they were read: chunks of 256 share their bounds, so sort_spatially first.
/// Ties of depth are therefore drawn in another order. Read back, a value is within half of its step:
/// positions and log-scales 1/2047 (y: 1/1023) of the chunk's range, colours and opacities 1/255 of it
/// (opacities: of 1), quaternion components 0.0014, SH coefficients 1/32 (where they are in [-4, 4]; the
/// outermost cells are read at their ends). Log-scales are clamped to [-20, 20], -infinity too. Errors:
/// as save_ply.
Status save_compressed_ply(const std::filesystem::path& path, const GaussianCloud& cloud);

}  // namespace gsnav::io
