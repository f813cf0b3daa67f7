// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/detail/nav/navmesh_settings.hpp"

namespace gsnav::detail {

/// Number of numeric settings of a NavMesh.
inline constexpr std::size_t kSettingCount = 13;
/// One numeric setting.
struct SettingField {
  const char* name;                ///< Name in Habitat's JSON.
  double NavMeshSettings::*value;  ///< Null for verts_per_poly, which is an integer.
};
/// Numeric settings in the order of a `.navmesh` file.
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
