// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <functional>
#include <string>

#include "cloud_check.hpp"
#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "json.hpp"

namespace gsnav::io {
namespace {

using detail::Json;

constexpr const char* kSplatsExtension = "KHR_gaussian_splatting";
constexpr std::size_t kMostBytes = 0xfffffff0;  // lengths have 32 bits

/// An attribute: `get(i, k)` is component k of Gaussian i.
struct Attribute {
  std::string name;
  std::size_t components = 1;
  std::function<float(std::size_t, std::size_t)> get;
};

/// The attributes of a cloud. If `turned`, they are rotated by half a turn about z: x and y change sign,
/// and so does every basis function of odd order.
std::vector<Attribute> attributes_of(const GaussianCloud& cloud, const Vec3d& origin, bool turned) {
  const std::string prefix = std::string(kSplatsExtension) + ":";
  std::vector<Attribute> out;
  out.push_back({"POSITION", 3, [&cloud, origin, turned](std::size_t i, std::size_t k) {
                   const double v = (cloud.mean(i) - origin)[static_cast<int>(k)];
                   return static_cast<float>(turned && k < 2 ? -v : v);
                 }});
  out.push_back({prefix + "ROTATION", 4, [&cloud, turned](std::size_t i, std::size_t k) {
                   // x y z w of q, or of the half turn times q
                   static constexpr std::size_t kPlain[] = {1, 2, 3, 0}, kTurned[] = {2, 1, 0, 3};
                   if (!turned) return cloud.quats[kPlain[k]][i];
                   const float v = cloud.quats[kTurned[k]][i];
                   return k == 0 || k == 3 ? -v : v;
                 }});
  out.push_back(
      {prefix + "SCALE", 3, [&cloud](std::size_t i, std::size_t k) { return cloud.scales[k][i]; }});
  out.push_back(
      {prefix + "OPACITY", 1, [&cloud](std::size_t i, std::size_t) { return cloud.opacities[i]; }});
  out.push_back({prefix + "SH_DEGREE_0_COEF_0", 3,
                 [&cloud](std::size_t i, std::size_t k) { return cloud.sh0[3 * i + k]; }});
  const std::size_t rest = detail::rest_width(cloud);
  for (int band = 1; band <= cloud.sh_degree; ++band) {
    for (int c = 0; c <= 2 * band; ++c) {
      const std::size_t first = static_cast<std::size_t>(3 * (band * band - 1 + c));
      const float sign = turned && (c - band) % 2 != 0 ? -1.0f : 1.0f;
      out.push_back({prefix + "SH_DEGREE_" + std::to_string(band) + "_COEF_" + std::to_string(c), 3,
                     [&cloud, rest, first, sign](std::size_t i, std::size_t k) {
                       return sign * cloud.shN[i * rest + first + k];
                     }});
    }
  }
  return out;
}

/// Adds the least and greatest position, which glTF demands.
void add_bounds(Json& accessor, const Attribute& position, std::size_t n) {
  std::array<float, 3> low, high;
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = high[k] = position.get(0, k);
    for (std::size_t i = 1; i < n; ++i) {
      low[k] = std::min(low[k], position.get(i, k));
      high[k] = std::max(high[k], position.get(i, k));
    }
  }
  accessor["min"] = low;
  accessor["max"] = high;
}

Json header_of(const std::vector<Attribute>& attributes, std::size_t n, const Vec3d& t,
               ColorSpace space) {
  Json views = Json::array(), accessors = Json::array(), names = Json::object();
  std::size_t offset = 0;
  for (const Attribute& a : attributes) {
    const std::size_t bytes = n * a.components * sizeof(float);
    views.push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}});
    names[a.name] = accessors.size();
    accessors.push_back({{"bufferView", views.size() - 1},
                         {"componentType", 5126},
                         {"count", n},
                         {"type", a.components == 1   ? "SCALAR"
                                  : a.components == 3 ? "VEC3"
                                                      : "VEC4"}});
    if (a.name == "POSITION") add_bounds(accessors.back(), a, n);
    offset += bytes;
  }
  const Json splats = {
      {"kernel", "ellipse"},
      {"colorSpace", space == ColorSpace::linear ? "lin_rec709_display" : "srgb_rec709_display"},
      {"sortingMethod", "cameraDistance"},
      {"projection", "perspective"}};
  const Json primitive = {
      {"mode", 0}, {"attributes", names}, {"extensions", {{kSplatsExtension, splats}}}};
  Json node = {{"mesh", 0}};
  if (t != Vec3d{}) node["translation"] = {t.x, t.y, t.z};
  return {{"asset", {{"version", "2.0"}, {"generator", "gsnav"}}},
          {"extensionsUsed", {kSplatsExtension}},
          {"scene", 0},
          {"scenes", {{{"nodes", {0}}}}},
          {"nodes", Json::array({node})},
          {"meshes", {{{"primitives", Json::array({primitive})}}}},
          {"accessors", accessors},
          {"bufferViews", views},
          {"buffers", {{{"byteLength", offset}}}}};
}

}  // namespace

Status save_glb(const std::filesystem::path& path, const GaussianCloud& cloud,
                const SaveGlbOptions& options) {
  return detail::guarded(path.string(), [&]() -> Status {
    if (Status s = detail::check_arrays(path, cloud); !s) return s;
    const std::size_t n = cloud.size(), floats = 14 + detail::rest_width(cloud);
    if (n == 0)
      return {Errc::invalid_argument, path.string() + ": a GLB needs a Gaussian, the cloud has none"};
    if (n > kMostBytes / 2 / sizeof(float) / floats) {
      return {Errc::unsupported, path.string() + ": " + std::to_string(n) +
                                     " Gaussians do not fit into a GLB; write tiles"};
    }
    const Vec3d origin = cloud.origins.empty() ? Vec3d{} : cloud.origins[cloud.origin_ids[0]];
    const bool turned = !options.keep_axes;
    const auto attributes = attributes_of(cloud, origin, turned);
    const Vec3d place = turned ? Vec3d{-origin.x, -origin.y, origin.z} : origin;
    std::string text = header_of(attributes, n, place, cloud.color_space).dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const auto size_of = [](std::size_t bytes) { return static_cast<std::uint32_t>(bytes); };
    const std::size_t binary = n * floats * sizeof(float);
    const std::uint32_t head[] = {0x46546c67, 2, size_of(12 + 8 + text.size() + 8 + binary),
                                  size_of(text.size()), 0x4e4f534a};
    const std::uint32_t chunk[] = {size_of(binary), 0x004e4942};
    OutputFile out;
    if (Status s = out.open(path); !s) return s;
    out.write(head, sizeof head);
    out.write(text.data(), text.size());
    out.write(chunk, sizeof chunk);
    const std::vector<std::uint32_t> order = rows_as_read(cloud);
    for (const Attribute& a : attributes) {
      for (const std::size_t i : order) {
        float row[4];
        for (std::size_t k = 0; k < a.components; ++k) row[k] = a.get(i, k);
        out.write(row, a.components * sizeof(float));
      }
    }
    return out.commit();
  });
}

}  // namespace gsnav::io
