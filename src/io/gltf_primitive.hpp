// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gltf_file.hpp"

namespace gsnav::io::detail {

/// Numbers of attribute `name` of a primitive, or none where it is not there. `vertices`: how many there
/// must be, 0 for any. Errors: invalid_file.
Result<GltfNumbers> read_attribute(const GltfFile& file, const Json& primitive, const std::string& name,
                                   const std::string& types, std::size_t vertices,
                                   const std::string& where);

/// Whether a primitive is made of triangles (a list, strip or fan), not of points or lines. Errors:
/// invalid_file.
Result<bool> has_triangles(const Json& primitive, const std::string& where);

/// Its triangles, whatever they are made of, as corners below `vertices`. Errors: invalid_file.
Result<std::vector<std::array<std::uint32_t, 3>>> read_triangles(const GltfFile& file,
                                                                 const Json& primitive,
                                                                 std::size_t vertices,
                                                                 const std::string& where);

/// The primitives of entry `mesh` of "meshes". Errors: invalid_file.
Result<const Json*> primitives_of(const GltfFile& file, std::size_t mesh);

}  // namespace gsnav::io::detail
