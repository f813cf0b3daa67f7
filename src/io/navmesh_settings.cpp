// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/io/navmesh_settings_file.hpp"
#include "gsnav/detail/nav/navmesh_fields.hpp"
#include "json.hpp"

namespace gsnav::io {
namespace {

using detail::Json;
using detail::must_be;
using detail::shown;
using gsnav::detail::kSettingFields;
using gsnav::detail::SettingField;

struct FlagKey {
  const char* key;
  bool NavMeshSettings::*value;
};
constexpr FlagKey kFlags[] = {
    {"filterLowHangingObstacles", &NavMeshSettings::filter_low_hanging_obstacles},
    {"filterLedgeSpans", &NavMeshSettings::filter_ledge_spans},
    {"filterWalkableLowHeightSpans", &NavMeshSettings::filter_walkable_low_height_spans},
    {"includeStaticObjects", &NavMeshSettings::include_static_objects},
};
constexpr const char *kVertsPerPoly = "vertsPerPoly", *kTileSize = "tileSize", *kMaxCells = "maxCells";

/// Reads a whole number in [0, most]. Habitat writes 6 as 6.0.
Result<std::int64_t> whole(const Json& value, const std::string& what, double most) {
  const double v = value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (v >= 0 && v <= most && v == std::floor(v)) return static_cast<std::int64_t>(v);
  const std::string rule = "a whole number from 0 to " + std::to_string(static_cast<std::int64_t>(most));
  return must_be(what, value, rule.c_str());
}

Status read_setting(const std::string& key, const Json& value, const std::string& at,
                    NavMeshSettings& s) {
  const std::string what = at + ": '" + key + "'";
  for (const SettingField& n : kSettingFields) {
    if (n.value == nullptr || key != n.name) continue;
    if (!value.is_number()) return must_be(what, value, "a number");
    s.*n.value = value.get<double>();
    return {};
  }
  for (const FlagKey& f : kFlags) {
    if (key != f.key) continue;
    if (!value.is_boolean()) return must_be(what, value, "true or false");
    s.*f.value = value.get<bool>();
    return {};
  }
  constexpr double kInt = 1e9, kMost = 9e15;
  const bool verts = key == kVertsPerPoly, tile = key == kTileSize;
  if (!verts && !tile && key != kMaxCells) {
    return {
        Errc::invalid_file,
        what +
            " is no setting of a NavMesh; they are named as Habitat's are: cellSize, agentRadius, ..."};
  }
  const auto v = whole(value, what, verts || tile ? kInt : kMost);
  if (!v) return v.status();
  if (verts) {
    s.verts_per_poly = static_cast<int>(*v);
  } else if (tile) {
    s.tile_size = static_cast<int>(*v);
  } else {
    s.max_cells = static_cast<std::size_t>(*v);
  }
  return {};
}

}  // namespace

Result<NavMeshSettings> load_navmesh_settings(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<NavMeshSettings> {
    const auto json = detail::load_json(path);
    if (!json) return json.status();
    if (!json->is_object())
      return detail::invalid_file(path, "is " + shown(*json) + ", must be an object of settings");
    NavMeshSettings s;
    for (const auto& [key, value] : json->items()) {
      if (Status status = read_setting(key, value, path.string(), s); !status) return status;
    }
    return s;
  });
}

Status save_navmesh_settings(const NavMeshSettings& settings, const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Status {
    const NavMeshSettings usual;
    nlohmann::ordered_json json;
    for (const SettingField& n : kSettingFields) {
      if (n.value == nullptr) continue;
      const double v = settings.*n.value;
      if (!std::isfinite(v)) {
        return {Errc::invalid_argument,
                path.string() + ": '" + n.name + "' = " + std::to_string(v) + " is not finite"};
      }
      json[n.name] = v;
    }
    json[kVertsPerPoly] = static_cast<double>(settings.verts_per_poly);
    for (const FlagKey& f : kFlags) json[f.key] = settings.*f.value;
    if (settings.tile_size != usual.tile_size) json[kTileSize] = settings.tile_size;
    if (settings.max_cells != usual.max_cells) json[kMaxCells] = settings.max_cells;
    return replace_file(path, json.dump(4) + "\n");
  });
}

}  // namespace gsnav::io
