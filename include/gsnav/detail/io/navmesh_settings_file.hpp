// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/nav/navmesh_settings.hpp"

namespace gsnav::io {

/// Reads the settings of a NavMesh from JSON as Habitat writes them. A missing key keeps its default.
///
/// - Numbers: cellSize, cellHeight, agentHeight, agentRadius, agentMaxClimb, agentMaxSlope,
///   regionMinSize, regionMergeSize, edgeMaxLen, edgeMaxError, vertsPerPoly, detailSampleDist,
///   detailSampleMaxError, and of gsnav only tileSize and maxCells.
/// - True or false: filterLowHangingObstacles, filterLedgeSpans, filterWalkableLowHeightSpans,
///   includeStaticObjects.
///
/// Values are not checked. `validate` says whether a mesh can be built with them; Habitat allows
/// polygons of more than 6 vertices. Errors: file_not_found; invalid_file naming a key that is unknown
/// or whose value is of another kind. Never throws.
Result<NavMeshSettings> load_navmesh_settings(const std::filesystem::path& path);

/// Writes settings for Habitat and for load_navmesh_settings, which reads back the same numbers.
/// tileSize and maxCells are written only if they are not the defaults; Habitat ignores them. Errors:
/// invalid_argument naming a setting that is not finite; file_not_found where the file cannot be created
/// or written.
Status save_navmesh_settings(const NavMeshSettings& settings, const std::filesystem::path& path);

}  // namespace gsnav::io
