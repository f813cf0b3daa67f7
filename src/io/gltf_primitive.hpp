// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gltf_file.hpp"
#include "gsnav/math/mat.hpp"

namespace gsnav::io::detail {

/// Reads attribute `name` of a primitive; empty if it does not exist. `vertices` is the required number
/// of elements, 0 for any. Errors: invalid_file.
Result<GltfNumbers> read_attribute(const GltfFile& file, const Json& primitive, const std::string& name,
                                   const std::string& types, std::size_t vertices,
                                   const std::string& where);

/// Corners of triangles, as indices of vertices.
using GltfTriangles = std::vector<std::array<std::uint32_t, 3>>;

/// Positions and triangles of a primitive.
struct GltfGeometry {
  GltfNumbers points;
  GltfTriangles triangles;
};

/// Reads the positions and triangles of a list, strip or fan. A primitive of points or lines has none of
/// either. Errors: invalid_file.
Result<GltfGeometry> read_geometry(const GltfFile& file, const Json& primitive,
                                   const std::string& where);

/// Turns triangles around if `world_from_mesh` mirrors them.
void keep_sides(GltfTriangles& triangles, const Affine3<double>& world_from_mesh);

/// Calls f(primitive, where) for each primitive of entry `mesh` of "meshes", until one fails. Errors:
/// invalid_file, and those of `f`.
Status for_each_primitive(const GltfFile& file, std::size_t mesh,
                          const std::function<Status(const Json&, const std::string&)>& f);

}  // namespace gsnav::io::detail
