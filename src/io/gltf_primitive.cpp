// SPDX-License-Identifier: Apache-2.0
#include "gltf_primitive.hpp"

#include <numeric>
#include <utility>

namespace gsnav::io::detail {
namespace {

constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;

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

Result<bool> has_triangles(const Json& primitive, const std::string& where) {
  const auto mode = get_index(primitive, "mode", kTriangles, where);
  if (!mode) return mode.status();
  return *mode >= kTriangles && *mode <= kFan;
}

Result<std::vector<std::array<std::uint32_t, 3>>> read_triangles(const GltfFile& file,
                                                                 const Json& primitive,
                                                                 std::size_t vertices,
                                                                 const std::string& where) {
  const auto mode = get_index(primitive, "mode", kTriangles, where);
  if (!mode) return mode.status();
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
  std::vector<std::array<std::uint32_t, 3>> out;
  for (std::size_t k = 2; k < corners.size(); k += *mode == kTriangles ? 3 : 1) {
    if (*mode == kFan) {
      out.push_back({corners[0], corners[k - 1], corners[k]});
    } else if (*mode == kStrip && k % 2 != 0) {
      out.push_back({corners[k - 1], corners[k - 2], corners[k]});
    } else {
      out.push_back({corners[k - 2], corners[k - 1], corners[k]});
    }
  }
  return out;
}

Result<const Json*> primitives_of(const GltfFile& file, std::size_t mesh) {
  const auto entry = file.item("meshes", mesh);
  if (!entry) return entry.status();
  const Json* primitives = member(**entry, "primitives");
  if (primitives == nullptr || !primitives->is_array()) {
    return {Errc::invalid_file, file.where("meshes", mesh) + " has no 'primitives'"};
  }
  return primitives;
}

}  // namespace gsnav::io::detail
