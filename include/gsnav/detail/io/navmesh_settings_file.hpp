// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/nav/navmesh_settings.hpp"

namespace gsnav::io {

/// Reads the settings of a NavMesh from JSON as Habitat writes them: an object of numbers (cellSize,
/// cellHeight, agentHeight, agentRadius, agentMaxClimb, agentMaxSlope, regionMinSize, regionMergeSize,
/// edgeMaxLen, edgeMaxError, vertsPerPoly, detailSampleDist, detailSampleMaxError) and true or false
/// (filterLowHangingObstacles, filterLedgeSpans, filterWalkableLowHeightSpans, includeStaticObjects),
/// and of tileSize and maxCells, which only gsnav knows. A key that is missing keeps its default. Values
/// are those of the file: `validate` says whether a mesh can be built with them (Habitat allows more
/// than 6 vertices a polygon).
///
/// Errors: file_not_found; invalid_file naming the key: one that is not known, or a value of another
/// kind. Never throws.
Result<NavMeshSettings> load_navmesh_settings(const std::filesystem::path& path);

/// Writes them, for Habitat and for load_navmesh_settings, which gives back the same numbers. tileSize
/// and maxCells are written where they are not the defaults; Habitat passes over them. Errors:
/// invalid_argument naming a setting that is not finite; file_not_found where the file cannot be made or
/// written.
Status save_navmesh_settings(const NavMeshSettings& settings, const std::filesystem::path& path);

}  // namespace gsnav::io
