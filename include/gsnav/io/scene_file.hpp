// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/lod_set.hpp"
#include "gsnav/detail/io/read_limits.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/packed_cloud.hpp"

namespace gsnav::io {

/// How a cloud is kept in memory.
enum class Storage : std::uint8_t {
  full,     ///< float32
  compact,  ///< SH bands from 1 on as binary16 (compact_sh): 146 bytes a Gaussian of degree 3 in place
            ///< of 236
};

/// How load_scene reads.
struct LoadSceneOptions {
  int level = 0;     ///< of streamed LOD sets, 0 is the finest
  bool sort = true;  ///< in space, as rendering wants it; false: rows stay as they were read
  double time = 0;   ///< seconds, of scenes that move (detail/io/temporal_file.hpp)
  Storage storage = Storage::full;  ///< How Gaussians are kept in memory.
  /// Whether SH bands that are zero in every Gaussian are held. They change no bit of an image; a cloud
  /// that is written to a file again keeps its degree by them. The report says what was let go.
  bool keep_zero_bands = false;
  /// What compact storage may change a coefficient by; a cloud that it changes by more stays as it is,
  /// with a warning. The report has the error. A colour changes by at most 4.3 times that: 15 basis
  /// functions whose squares sum to 15 / (4 pi).
  double most_sh_error = 2e-3;
  PackLimits pack{};    ///< of load_packed_scene
  ReadLimits limits{};  ///< json_depth, of glTF and lod-meta.json
};

/// A packed scene with the report of how it was read; `report.packing` has what packing changed.
struct LoadedPackedCloud {
  PackedCloud cloud;  ///< The Gaussians.
  LoadReport report;  ///< What the reader found, changed and left out.
};

/// Reads a scene of Gaussians by what its path names: a `.ply`, `.splat`, `.ksplat`, `.spz`, `.sog`,
/// `.glb` or `.gltf`, a `meta.json` or a `lod-meta.json`, or a folder with one of these two. Of scenes
/// that move (a `.ply` with t, t_scale or motion_*, a `.4dgs.npz`) it gives the moment `options.time`.
///
/// A comma names sibling tiles, which are merged into one cloud: `scenes/flat/2_0,2_1` reads
/// scenes/flat/2_0 and scenes/flat/2_1. Their reports are summed, their warnings carry the tile's path.
///
/// Rows come sorted in space (detail/scene/spatial_order.hpp) unless the options say otherwise;
/// `row_ids` has their places as they were read. Errors: what the loaders of these formats return;
/// unsupported (an extension that is not in the list, named with the list); invalid_argument (an empty
/// name or a tile twice). Never throws.
Result<LoadedCloud> load_scene(const std::string& spec, const LoadSceneOptions& options = {});

/// The same, packed: a third of the memory, to be rendered. Large binary PLY files are read five times,
/// so that never more than twice that memory is needed; of others both clouds are there while one is
/// packed. `options.storage` must be full. Errors: load_scene's.
Result<LoadedPackedCloud> load_packed_scene(const std::string& spec,
                                            const LoadSceneOptions& options = {});

/// A scene that ships its levels of detail, with them, as load_lod_levels reads it; nothing where `spec`
/// is no streamed set, where no level above its finest is there, or where its nodes are too small to be
/// drawn one by one. Rows are in chunks whatever `options.sort` says. Errors: load_lod_levels'.
Result<std::optional<LoadedLodSet>> load_shipped_levels(const std::string& spec,
                                                        const LoadSceneOptions& options = {});

/// The report as text for people, a line for each thing there is to say, each ended.
std::string report_text(const LoadReport& report);

/// Writes a scene by its name: `.compressed.ply`, `.ply` (INRIA's layout), `.splat`, `.spz` (version 4),
/// `.sog`, a folder's `meta.json` (SOG), `.glb`. What each format loses is said where its writer is
/// declared. Rows are written in the order in which they were read (`row_ids`), by which renderers break
/// ties of depth; in a `.compressed.ply` in the cloud's own. A compact cloud is widened first. The file
/// is written aside and renamed: a failure leaves what was there, the cloud's own file too. Errors: the
/// writer's; check_scene_output's. Never throws.
Status save_scene(const std::filesystem::path& path, const GaussianCloud& cloud);

/// Checks before a scene is loaded or made that save_scene can write it to `path`: unsupported (a name
/// of no format that is written, with the list), file_not_found (check_output_path).
Status check_scene_output(const std::filesystem::path& path);

/// Values of a cloud that a format cannot hold.
struct ClampedValues {
  std::uint64_t colours = 0;     ///< of degree 0, drawn; clamped to the nearer end
  std::uint64_t scales = 0;      ///< standard deviations; clamped
  std::uint64_t bands = 0;       ///< SH coefficients from band 1 on; clamped
  std::uint64_t lost_bands = 0;  ///< of these, such as are not zero, where the format has none
  /// All values that were changed.
  std::uint64_t all() const noexcept { return colours + scales + bands + lost_bands; }
};

/// What save_scene would clamp or leave out. `cloud` must not be compact.
ClampedValues count_clamped(const std::filesystem::path& path, const GaussianCloud& cloud);

}  // namespace gsnav::io
