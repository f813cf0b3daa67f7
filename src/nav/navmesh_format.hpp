// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/nav/navmesh_settings.hpp"

namespace gsnav::detail {

// Sizes and offsets of Habitat's `.navmesh`: little endian, a set header, tiles with a header each.
inline constexpr double kMaxCoordinate = 1e6;  ///< metres: float32 has centimetres no more
inline constexpr std::int32_t kSetMagic = 'M' << 24 | 'S' << 16 | 'E' << 8 | 'T';
inline constexpr std::size_t kSetHeader = 40;    ///< magic, version, tile count, dtNavMeshParams
inline constexpr std::size_t kSetSettings = 56;  ///< from version 2: 13 floats and 4 flags
inline constexpr std::size_t kTileHeader = 100;  ///< dtMeshHeader
inline constexpr std::size_t kPoly = 32, kPolyDetail = 12, kBvNode = 16, kOffMesh = 36, kLink = 12;

/// The floats of the settings, in the file's order.
inline constexpr std::size_t kSettingCount = 13;
struct SettingField {
  const char* name;
  double NavMeshSettings::*value;  ///< null: verts_per_poly
};
inline constexpr SettingField kSettingFields[kSettingCount] = {
    {"cellSize", &NavMeshSettings::cell_size},
    {"cellHeight", &NavMeshSettings::cell_height},
    {"agentHeight", &NavMeshSettings::agent_height},
    {"agentRadius", &NavMeshSettings::agent_radius},
    {"agentMaxClimb", &NavMeshSettings::agent_max_climb},
    {"agentMaxSlope", &NavMeshSettings::agent_max_slope},
    {"regionMinSize", &NavMeshSettings::region_min_size},
    {"regionMergeSize", &NavMeshSettings::region_merge_size},
    {"edgeMaxLen", &NavMeshSettings::edge_max_len},
    {"edgeMaxError", &NavMeshSettings::edge_max_error},
    {"vertsPerPoly", nullptr},
    {"detailSampleDist", &NavMeshSettings::detail_sample_dist},
    {"detailSampleMaxError", &NavMeshSettings::detail_sample_max_error},
};

}  // namespace gsnav::detail
