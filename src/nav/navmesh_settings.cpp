// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/navmesh_settings.hpp"

#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/nav/navmesh_fields.hpp"

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
  constexpr double kTiny = 1e-4, kHuge = 1e6;
  detail::FieldCheck check("NavMeshSettings.");
  check.in("cell_size", cell_size, kTiny, kHuge).in("cell_height", cell_height, kTiny, kHuge);
  check.in("agent_height", agent_height, kTiny, kHuge).in("agent_radius", agent_radius, 0, kHuge);
  check.in("agent_max_climb", agent_max_climb, 0, kHuge).in("agent_max_slope", agent_max_slope, 0, 90);
  check.in("region_min_size", region_min_size, 0, kHuge);
  check.in("region_merge_size", region_merge_size, 0, kHuge);
  check.in("edge_max_len", edge_max_len, 0, kHuge).in("edge_max_error", edge_max_error, 0, kHuge);
  check.in("verts_per_poly", verts_per_poly, 3, 6);
  check.in("detail_sample_dist", detail_sample_dist, 0, kHuge);
  check.in("detail_sample_max_error", detail_sample_max_error, 0, kHuge);
  check.need(tile_size == 0 || (tile_size >= 16 && tile_size <= 16384), "tile_size", tile_size,
             "must be 0 or in [16, 16384]");
  return check.need(max_cells != 0, "max_cells", max_cells, "must be positive").status();
}

}  // namespace gsnav
