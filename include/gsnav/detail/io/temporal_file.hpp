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

/// A moving scene and the report of how it was read.
struct LoadedTemporalCloud {
  TemporalCloud scene;  ///< Gaussians that move.
  LoadReport report;    ///< What the reader found, changed and left out.
};

/// Reads 4D Gaussians in the layouts that Habitat-GS reads. Rows are in file order; sort_spatially sorts
/// them.
///
/// - `.ply` (`.4dgs.ply`): INRIA's properties (detail/io/ply.hpp) with `t` (seconds), `t_scale` (natural
///   logarithm of seconds) and `motion_0` ... (3, 6 or 9 of them: velocity, acceleration, jerk, in
///   metres and seconds). Missing ones are 0; a file without any of them does not move.
/// - `.npz` (`.4dgs.npz`): the arrays of a network, `network.tfgs.fdgs._xyz`, `_opacity`, `_scaling`,
///   `_scaling_t`, `_rotation_l`, `_t`, `_motion`, `_features_dc` [N][1][3], `_features_rest` [N][M][3].
///   Alternatively `network.fg_fdgs.*` for moving and `network.bg_fdgs.*` (`_rotation`) for static
///   Gaussians. `network.scene_scale` scales means, scales and motion, `network.time_dilation` scales
///   times. The right rotation of a 4D rotor is not used, as in Habitat-GS.
///
/// Untested on a real file: none was available, so tests build files from this description. Errors:
/// file_not_found; invalid_file naming the property or array that is missing or does not fit;
/// unsupported (another extension); out_of_memory. Never throws.
Result<LoadedTemporalCloud> load_temporal(const std::filesystem::path& path);

/// Reads the bytes of a PLY. `source` names them in messages and in the report.
Result<LoadedTemporalCloud> parse_temporal_ply(std::span<const std::byte> bytes, std::string source);

}  // namespace gsnav::io
