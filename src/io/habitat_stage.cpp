// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <utility>

#include "file.hpp"
#include "habitat_json.hpp"

namespace gsnav::io {
namespace habitat {

namespace fs = std::filesystem;
using detail::Json;
using detail::member;
using detail::must_be;
using detail::shown;

Result<Json> load_object(const fs::path& path) {
  auto json = detail::load_json(path);
  if (json && !json->is_object()) {
    return detail::invalid_file(path, "is " + shown(*json) + ", must be an object");
  }
  return json;
}

Result<std::string> text(const Json& object, const char* key, const std::string& at) {
  const Json* v = member(object, key);
  if (v == nullptr) return std::string();
  if (!v->is_string()) return must_be(at + ": '" + key + "'", *v, "a text");
  return v->get<std::string>();
}

namespace {

Status read_scale(const Json& object, const std::string& at, double& out) {
  const Json* v = member(object, "scale");
  if (v == nullptr) return {};
  std::vector<double> s;
  for (const Json& x : v->is_array() ? *v : Json::array({*v}))
    s.push_back(x.is_number() ? x.get<double>() : NAN);
  for (const double x : s) {
    if (!(x > 0) || !std::isfinite(x)) return must_be(at + ": 'scale'", *v, "positive");
    if (x != s[0]) return {Errc::unsupported, at + ": 'scale' differs by axis; one for all is read"};
  }
  if (s.size() != 1 && s.size() != 3)
    return {Errc::invalid_file, at + ": 'scale' must be one number or three"};
  out = s[0];
  return {};
}

}  // namespace

Status read_stage(const Json& object, const fs::path& folder, const std::string& at, StageConfig& out,
                  LeftOut& left_out) {
  for (const auto& [key, to] : {std::pair{"render_asset", &out.render_asset},
                                std::pair{"collision_asset", &out.collision_asset}}) {
    const auto name = text(object, key, at);
    if (!name) return name.status();
    if (!name->empty())
      *to = fs::path(*name).is_absolute() ? fs::path(*name) : (folder / *name).lexically_normal();
  }
  for (const auto& [key, to] :
       {std::pair{"up", &out.up}, std::pair{"front", &out.front}, std::pair{"origin", &out.origin}}) {
    if (member(object, key) == nullptr) continue;
    if (Status s = detail::get_vector(object, key, at, *to); !s) return s;
  }
  for (const auto& [key, v] : {std::pair{"up", out.up}, std::pair{"front", out.front}}) {
    if (!(norm(v) > 0)) return {Errc::invalid_file, at + ": '" + key + "' is zero"};
  }
  if (std::abs(dot(out.up, out.front)) > 1e-3 * norm(out.up) * norm(out.front)) {
    return {Errc::invalid_file, at + ": 'up' and 'front' are not at right angles"};
  }
  if (member(object, "units_to_meters") != nullptr) {
    const auto v = detail::get_number(object, "units_to_meters", at);
    if (!v) return v.status();
    if (!(*v > 0)) return {Errc::invalid_file, at + ": 'units_to_meters' must be positive"};
    out.units_to_meters = *v;
  }
  if (Status s = read_scale(object, at, out.scale); !s) return s;
  if (const Json* v = member(object, "norm_quaternion"); v != nullptr) {
    if (!v->is_boolean()) return must_be(at + ": 'norm_quaternion'", *v, "true or false");
    out.norm_quaternion = v->get<bool>();
  }
  left_out.add(object,
               {"render_asset", "collision_asset", "up", "front", "origin", "units_to_meters", "scale",
                "norm_quaternion"},
               at);
  return {};
}

}  // namespace habitat

Similarity StageConfig::world_from_asset() const noexcept {
  // Map the asset's right, up and back to the world's x, y and z.
  const Vec3d y = normalized(up), z = -normalized(front), x = cross(y, z);
  Similarity out{.rotation = quat_from_matrix(Mat3d{{x, y, z}}), .scale = units_to_meters * scale};
  out.translation = -(rotate(out.rotation, origin) * out.scale);
  return out;
}

Result<StageConfig> load_stage_config(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<StageConfig> {
    const auto json = habitat::load_object(path);
    if (!json) return json.status();
    StageConfig out;
    habitat::LeftOut ignored;
    out.file = path;
    if (Status s = habitat::read_stage(*json, path.parent_path(), path.string(), out, ignored); !s)
      return s;
    if (out.render_asset.empty()) return detail::invalid_file(path, "'render_asset' is missing");
    return out;
  });
}

}  // namespace gsnav::io
