// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/lod_set.hpp"
#include "gsnav/detail/io/read_limits.hpp"
#include "gsnav/detail/scene/packed_rows.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// How load_scene keeps a cloud in memory.
enum class Storage : std::uint8_t {
  full,     ///< Float32.
  compact,  ///< SH bands 1 to 3 as binary16 (compact_sh): 146 instead of 236 bytes for a Gaussian of
            ///< degree 3.
};

/// Options of load_scene and the loaders related to it.
struct LoadSceneOptions {
  int level = 0;     ///< Level of a streamed LOD set to read; 0 is the finest.
  bool sort = true;  ///< Sort rows in spatial order, which rendering needs to be fast. false: rows stay
                     ///< in file order.
  double time = 0;   ///< Seconds: the moment that is read of a scene that moves
                     ///< (detail/io/temporal_file.hpp).
  /// How the cloud is kept in memory.
  Storage storage = Storage::full;
  /// Keep SH bands that are zero in every Gaussian. They change no bit of an image. Keep them to write
  /// the cloud with the degree of its file. The report counts the bytes that were dropped.
  bool keep_zero_bands = false;
  /// Largest change of an SH coefficient that compact storage may make. A cloud that would change by
  /// more stays in full storage, with a warning. The report has the error. A colour changes by at most
  /// 4.3 times this value, since the squares of the 15 basis functions sum to 15 / (4 pi).
  double most_sh_error = 2e-3;
  PackLimits pack{};    ///< Limits of packing, for load_packed_scene.
  ReadLimits limits{};  ///< Limits of readers; json_depth applies to glTF and lod-meta.json.
};

/// A packed cloud and the report of how it was read. `report.packing` has what packing changed.
struct LoadedPackedCloud {
  PackedCloud cloud;  ///< The cloud.
  LoadReport report;  ///< What reading found, changed and left out.
};

/// Reads a scene of Gaussians. The format follows from the name: `.ply`, `.splat`, `.ksplat`, `.spz`,
/// `.sog`, `.glb`, `.gltf`, a `meta.json` or `lod-meta.json`, or a folder that holds one of these two. A
/// scene that moves (a `.ply` with t, t_scale or motion_*, a `.4dgs.npz`) is read at the moment
/// `options.time`.
///
/// A comma separates sibling tiles, which are merged into one cloud: `scenes/flat/2_0,2_1` reads
/// scenes/flat/2_0 and scenes/flat/2_1. Their reports are summed; a warning begins with the path of its
/// tile.
///
/// Rows are in spatial order (detail/scene/spatial_order.hpp) unless `options.sort` is false; `row_ids`
/// has the place of each row in the file. Never throws.
/// @return the cloud, or an error of the format's loader; unsupported for an unknown extension, with the
/// list of known ones; invalid_argument for an empty name or a tile that is named twice.
Result<LoadedCloud> load_scene(const std::string& spec, const LoadSceneOptions& options = {});

/// Reads a scene and packs it, to a third of the memory. Packed clouds can be rendered, but not edited.
/// A large binary PLY file is read five times, so that at no time more than twice the packed memory is
/// needed. With other formats the full and the packed cloud coexist while one is packed.
/// @param options storage must be Storage::full.
/// @return the cloud, or an error of load_scene.
Result<LoadedPackedCloud> load_packed_scene(const std::string& spec,
                                            const LoadSceneOptions& options = {});

/// Reads a streamed set with all the levels of detail that it ships, as load_lod_levels does. Returns
/// nothing where `spec` is no streamed set, where it has no level but the finest, or where its nodes are
/// too small to be drawn one by one. Rows are in chunks whatever `options.sort` says. Errors: those of
/// load_lod_levels.
Result<std::optional<LoadedLodSet>> load_shipped_levels(const std::string& spec,
                                                        const LoadSceneOptions& options = {});

/// The report as text: one line for each fact, each ended by a newline.
std::string report_text(const LoadReport& report);

/// Writes a scene. The format follows from the name: `.compressed.ply`, `.ply` (INRIA's layout),
/// `.splat`, `.spz` (version 4), `.sog`, `meta.json` in a folder (SOG), or `.glb`. The losses of a
/// format are documented at its writer.
///
/// Rows are written in the order in which they were read (`row_ids`), by which renderers break ties of
/// depth; only a `.compressed.ply` keeps the cloud's own order. A compact cloud is widened first. The
/// file is written to a temporary name and renamed, so that a failure leaves an existing file untouched,
/// even the one that the cloud was read from. Errors: those of the writer and of check_scene_output.
/// Never throws.
Status save_scene(const std::filesystem::path& path, const GaussianCloud& cloud);

/// Checks that save_scene can write to `path`, before a scene is loaded or made. Errors: unsupported (no
/// known format, with the list of known ones); file_not_found (check_output_path).
Status check_scene_output(const std::filesystem::path& path);

/// Counts of values of a cloud that a format cannot hold.
struct ClampedValues {
  std::uint64_t colours = 0;     ///< Colours of degree 0 of drawn Gaussians, clamped to the nearer end
                                 ///< of the format's range.
  std::uint64_t scales = 0;      ///< Standard deviations, clamped.
  std::uint64_t bands = 0;       ///< SH coefficients of bands 1 to 3 that are stored, clamped.
  std::uint64_t lost_bands = 0;  ///< Other SH coefficients, not zero, that are lost because the
                                 ///< format does not store their bands.
  /// Sum of the four counts.
  std::uint64_t all() const noexcept { return colours + scales + bands + lost_bands; }
};

/// Counts the values that save_scene would clamp or leave out for `path`. `cloud` must not be compact.
ClampedValues count_clamped(const std::filesystem::path& path, const GaussianCloud& cloud);

}  // namespace gsnav::io
