// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_limits.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// Options of load_gltf.
struct LoadGltfOptions {
  /// Keep the file's axes. Otherwise they are taken for glTF's (x left, y up, z forward) and turned to
  /// those of a PLY (x right, y down, z forward), by half a turn about z that includes SH bands.
  bool keep_axes = false;
  /// Also read primitives compressed by the draft extension KHR_gaussian_splatting_compression_spz_2.
  /// The SPZ data are taken to have the axes of the file. Untested on a real file.
  bool spz_compression = false;
  ReadLimits limits{};  ///< Only json_depth is used.
};

/// Reads the Gaussians of a glTF 2.0 file, GLB or JSON, by KHR_gaussian_splatting (release candidate).
/// Every primitive of the scene with kernel "ellipse" is read, its node's transform applied, and merged
/// into one cloud. Transforms may scale unevenly, shear and mirror: covariances follow exactly, SH bands
/// by the transform's orthogonal factor (`transform` in detail/scene/edit_cloud.hpp). Opacities and
/// scales are linear in the file. The sign of a scale has no meaning and is dropped with a warning. The
/// sort order becomes camera_distance, as the extension demands.
///
/// Rows that are not drawable Gaussians are dropped and counted in the report. Colours of another space
/// than sRGB are read unchanged, with a warning. Memory is at most 260 bytes for each byte of the file
/// and its buffers. Never throws.
/// @return the result, or an error that names the node or accessor:
/// - file_not_found.
/// - invalid_file: indices, offsets and sizes that do not fit each other or the data, attributes that
///   are missing or of other types, or no Gaussian primitive.
/// - unsupported: other kernels, sparse accessors, nodes with a flat transform, compressed primitives,
///   or JSON nested deeper than `limits` allow.
/// - invalid_argument: `limits` out of range.
/// - out_of_memory.
Result<LoadedCloud> load_gltf(const std::filesystem::path& path, const LoadGltfOptions& options = {});

/// Whether a glTF file has Gaussians: its JSON names the extension. False if it cannot be read.
bool gltf_holds_gaussians(const std::filesystem::path& path);

/// Reads the bytes of a file that contains all its buffers. `source` names them in messages.
Result<LoadedCloud> parse_gltf(std::span<const std::byte> bytes, std::string source,
                               const LoadGltfOptions& options = {});

/// Options of save_glb.
struct SaveGlbOptions {
  /// Keep the cloud's axes. Otherwise they are taken for those of a PLY and turned to the axes of glTF.
  bool keep_axes = false;
};

/// Writes a cloud as GLB, with one KHR_gaussian_splatting primitive of float32 attributes and sRGB
/// colours. Nothing is quantised. The extension has a single sort order (camera distance) and no filter,
/// so the cloud's own are lost. If the cloud has origins other than zero, positions are relative to the
/// first origin in use, which becomes the node's translation. Errors: file_not_found (the parent folder
/// is missing); write_failed; invalid_argument (arrays of different lengths, an empty cloud);
/// unsupported (2 GiB or more); out_of_memory. Never throws.
Status save_glb(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SaveGlbOptions& options = {});

}  // namespace gsnav::io
