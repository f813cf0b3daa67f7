// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/load_report.hpp"
#include "gsnav/detail/scene/temporal_cloud.hpp"

namespace gsnav::io {

/// A moving scene with the report of how it was read.
struct LoadedTemporalCloud {
  TemporalCloud scene;  ///< Gaussians that move.
  LoadReport report;    ///< What the reader found, changed and left out.
};

/// Reads 4D Gaussians as Habitat-GS does, rows as they were read (sort_spatially sorts them):
///
/// - `.ply` (`.4dgs.ply`): INRIA's properties (detail/io/ply.hpp) and `t` (seconds), `t_scale` (natural
/// logarithm of seconds),
///   `motion_0` ... (3, 6 or 9: velocity, acceleration, jerk, metres and seconds). What is missing of
///   these is 0; a file that has none of them stands still.
/// - `.npz` (`.4dgs.npz`): a network's arrays, `network.tfgs.fdgs._xyz`, `_opacity`, `_scaling`,
/// `_scaling_t`,
///   `_rotation_l`, `_t`, `_motion`, `_features_dc` [N][1][3], `_features_rest` [N][M][3]; or
///   `network.fg_fdgs.*` that move and `network.bg_fdgs.*` (`_rotation`) that stand.
///   `network.scene_scale` scales means, scales and motion, `network.time_dilation` times. The right
///   rotation of a 4D rotor is not used, as in Habitat-GS.
///
/// Untested on a real file: none was to be had; tests build theirs by the description above.
/// Errors: file_not_found; invalid_file (names the property or array that is missing or does not fit);
/// unsupported (another extension); out_of_memory. Never throws.
Result<LoadedTemporalCloud> load_temporal(const std::filesystem::path& path);

/// The same for a PLY's bytes; `source` names them in messages and in the report.
Result<LoadedTemporalCloud> parse_temporal_ply(std::span<const std::byte> bytes, std::string source);

}  // namespace gsnav::io
