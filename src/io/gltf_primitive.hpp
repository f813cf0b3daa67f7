// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gltf_file.hpp"

namespace gsnav::io::detail {

/// Reads attribute `name` of a primitive; empty if it does not exist. `vertices` is the required number
/// of elements, 0 for any. Errors: invalid_file.
Result<GltfNumbers> read_attribute(const GltfFile& file, const Json& primitive, const std::string& name,
                                   const std::string& types, std::size_t vertices,
                                   const std::string& where);

/// Whether a primitive consists of triangles (a list, strip or fan) rather than points or lines. Errors:
/// invalid_file.
Result<bool> has_triangles(const Json& primitive, const std::string& where);

/// Reads the triangles of a list, strip or fan. Corners are below `vertices`. Errors: invalid_file.
Result<std::vector<std::array<std::uint32_t, 3>>> read_triangles(const GltfFile& file,
                                                                 const Json& primitive,
                                                                 std::size_t vertices,
                                                                 const std::string& where);

/// The primitives of entry `mesh` of "meshes". Errors: invalid_file.
Result<const Json*> primitives_of(const GltfFile& file, std::size_t mesh);

}  // namespace gsnav::io::detail
