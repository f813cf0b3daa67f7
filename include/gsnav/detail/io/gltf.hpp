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

/// How load_gltf reads.
struct LoadGltfOptions {
  /// Keep the file's axes. Without it they are taken for glTF's own (x left, y up, z forward) and turned
  /// to those of a PLY (x right, y down, z forward) by half a turn about z, SH bands included.
  bool keep_axes = false;
  /// Also read primitives that KHR_gaussian_splatting_compression_spz_2 compresses, a draft: the SPZ's
  /// axes are taken for the file's own. Untested on a real file.
  bool spz_compression = false;
  ReadLimits limits{};  ///< json_depth is looked at
};

/// Reads the Gaussians of a glTF 2.0 file, GLB or JSON, by KHR_gaussian_splatting (release candidate):
/// every primitive of the scene with kernel "ellipse", its node's transform applied, merged into one
/// cloud. Transforms may scale unevenly, shear and mirror: covariances follow exactly, SH bands by the
/// transform's orthogonal factor (`transform` in detail/scene/edit_cloud.hpp). Opacities and scales are
/// linear in the file; the sign of a scale, which means nothing, is left out with a warning. The sort
/// order becomes camera_distance, which is the extension's.
///
/// Rows that hold no drawable Gaussian are dropped and counted in the report; colours of another space
/// than sRGB are read as they are, with a warning. Memory is bounded by 260 bytes for each byte of the
/// file and its buffers. Errors name the node or accessor: file_not_found; invalid_file (indices,
/// offsets and sizes that do not fit each other or the bytes there are, attributes missing or of other
/// types, no Gaussian primitive); unsupported (other kernels, sparse accessors, nodes whose transform is
/// flat, compressed primitives, JSON nested deeper than `limits` allow); invalid_argument (`limits`);
/// out_of_memory. Never throws.
Result<LoadedCloud> load_gltf(const std::filesystem::path& path, const LoadGltfOptions& options = {});

/// Whether a glTF file has Gaussians: its JSON names the extension. False where it cannot be read.
bool gltf_holds_gaussians(const std::filesystem::path& path);

/// The same for a file's bytes, all of whose buffers are inside; `source` names them in messages.
Result<LoadedCloud> parse_gltf(std::span<const std::byte> bytes, std::string source,
                               const LoadGltfOptions& options = {});

/// How save_glb writes.
struct SaveGlbOptions {
  /// Keep the cloud's axes. Without it they are taken for those of a PLY and turned to glTF's own.
  bool keep_axes = false;
};

/// Writes a cloud as GLB with one KHR_gaussian_splatting primitive of float32 attributes, sRGB colours:
/// nothing is quantised. The extension knows one sort order, camera distance, and no filter: the cloud's
/// own are lost. Positions of a cloud with other origins than zero are relative to the first one that is
/// used, which becomes the node's translation.
/// Errors: file_not_found (the parent folder is missing), write_failed;
/// invalid_argument (arrays of different lengths, an empty cloud); unsupported (2 GiB or more);
/// out_of_memory. Never throws.
Status save_glb(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SaveGlbOptions& options = {});

}  // namespace gsnav::io
