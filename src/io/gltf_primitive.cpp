// SPDX-License-Identifier: Apache-2.0
#include "gltf_primitive.hpp"

#include <numeric>
#include <utility>

namespace gsnav::io::detail {
namespace {

constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;

Result<GltfTriangles> read_triangles(const GltfFile& file, const Json& primitive, std::size_t mode,
                                     std::size_t vertices, const std::string& where) {
  std::vector<std::uint32_t> corners;
  if (member(primitive, "indices") == nullptr) {
    corners.resize(vertices);
    std::iota(corners.begin(), corners.end(), 0u);
  } else {
    const auto index = file.index(primitive, "indices", "accessors", where);
    if (!index) return index.status();
    auto read = file.indices(*index);
    if (!read) return read.status();
    corners = std::move(*read);
  }
  for (const std::uint32_t c : corners) {
    if (c >= vertices) {
      return {Errc::invalid_file,
              where + ": corner " + std::to_string(c) + " of " + std::to_string(vertices) + " vertices"};
    }
  }
  GltfTriangles out;
  for (std::size_t k = 2; k < corners.size(); k += mode == kTriangles ? 3 : 1) {
    if (mode == kFan) {
      out.push_back({corners[0], corners[k - 1], corners[k]});
    } else if (mode == kStrip && k % 2 != 0) {
      out.push_back({corners[k - 1], corners[k - 2], corners[k]});
    } else {
      out.push_back({corners[k - 2], corners[k - 1], corners[k]});
    }
  }
  return out;
}

}  // namespace

Result<GltfNumbers> read_attribute(const GltfFile& file, const Json& primitive, const std::string& name,
                                   const std::string& types, std::size_t vertices,
                                   const std::string& where) {
  const Json* attributes = member(primitive, "attributes");
  if (attributes == nullptr || member(*attributes, name.c_str()) == nullptr) return GltfNumbers{};
  const auto index = file.index(*attributes, name.c_str(), "accessors", where);
  if (!index) return index.status();
  auto values = file.numbers(*index, types);
  if (values && vertices != 0 && values->count != vertices) {
    return {Errc::invalid_file, where + ": " + name + " has " + std::to_string(values->count) +
                                    " values for " + std::to_string(vertices) + " vertices"};
  }
  return values;
}

Result<GltfGeometry> read_geometry(const GltfFile& file, const Json& primitive,
                                   const std::string& where) {
  const auto mode = get_index(primitive, "mode", kTriangles, where);
  if (!mode) return mode.status();
  if (*mode < kTriangles || *mode > kFan) return GltfGeometry{};
  auto points = read_attribute(file, primitive, "POSITION", "VEC3", 0, where);
  if (!points) return points.status();
  if (points->count == 0) return {Errc::invalid_file, where + ": no attribute POSITION"};
  auto triangles = read_triangles(file, primitive, *mode, points->count, where);
  if (!triangles) return triangles.status();
  return GltfGeometry{std::move(*points), std::move(*triangles)};
}

void keep_sides(GltfTriangles& triangles, const Affine3<double>& world_from_mesh) {
  if (determinant(world_from_mesh.linear) >= 0) return;
  for (auto& [a, b, c] : triangles) std::swap(b, c);
}

Status for_each_primitive(const GltfFile& file, std::size_t mesh,
                          const std::function<Status(const Json&, const std::string&)>& f) {
  const auto entry = file.item("meshes", mesh);
  if (!entry) return entry.status();
  const std::string at = file.where("meshes", mesh);
  const Json* primitives = member(**entry, "primitives");
  if (primitives == nullptr || !primitives->is_array()) {
    return {Errc::invalid_file, at + " has no 'primitives'"};
  }
  for (std::size_t p = 0; p < primitives->size(); ++p) {
    if (Status s = f((*primitives)[p], at + ".primitives[" + std::to_string(p) + "]"); !s) return s;
  }
  return {};
}

}  // namespace gsnav::io::detail
