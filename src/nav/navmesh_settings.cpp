// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/navmesh_settings.hpp"

#include <string>

#include "navmesh_format.hpp"

namespace gsnav {

bool operator==(const NavMeshSettings& a, const NavMeshSettings& b) noexcept {
  for (const detail::SettingField& f : detail::kSettingFields) {
    if (f.value != nullptr && static_cast<float>(a.*f.value) != static_cast<float>(b.*f.value))
      return false;
  }
  return a.verts_per_poly == b.verts_per_poly &&
         a.filter_low_hanging_obstacles == b.filter_low_hanging_obstacles &&
         a.filter_ledge_spans == b.filter_ledge_spans &&
         a.filter_walkable_low_height_spans == b.filter_walkable_low_height_spans &&
         a.include_static_objects == b.include_static_objects;
}

Status NavMeshSettings::validate() const {
  constexpr double kHuge = 1e6;
  struct Field {
    const char* name;
    double value, low, high;
  };
  constexpr double kTiny = 1e-4;
  const Field fields[] = {
      {"cell_size", cell_size, kTiny, kHuge},
      {"cell_height", cell_height, kTiny, kHuge},
      {"agent_height", agent_height, kTiny, kHuge},
      {"agent_radius", agent_radius, 0.0, kHuge},
      {"agent_max_climb", agent_max_climb, 0.0, kHuge},
      {"agent_max_slope", agent_max_slope, 0.0, 90.0},
      {"region_min_size", region_min_size, 0.0, kHuge},
      {"region_merge_size", region_merge_size, 0.0, kHuge},
      {"edge_max_len", edge_max_len, 0.0, kHuge},
      {"edge_max_error", edge_max_error, 0.0, kHuge},
      {"verts_per_poly", static_cast<double>(verts_per_poly), 3.0, 6.0},
      {"detail_sample_dist", detail_sample_dist, 0.0, kHuge},
      {"detail_sample_max_error", detail_sample_max_error, 0.0, kHuge},
  };
  for (const Field& f : fields) {
    if (!(f.value >= f.low && f.value <= f.high)) {  // False for NaN.
      return {Errc::invalid_argument, std::string("NavMeshSettings.") + f.name + " = " +
                                          std::to_string(f.value) + " is not in [" +
                                          std::to_string(f.low) + ", " + std::to_string(f.high) + "]"};
    }
  }
  if (tile_size != 0 && (tile_size < 16 || tile_size > 16384)) {
    return {Errc::invalid_argument,
            "NavMeshSettings.tile_size = " + std::to_string(tile_size) + " is not 0 or in [16, 16384]"};
  }
  if (max_cells == 0) return {Errc::invalid_argument, "NavMeshSettings.max_cells is 0"};
  return {};
}

}  // namespace gsnav
