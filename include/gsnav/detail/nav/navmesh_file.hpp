// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Reads a NavMesh file as written by Habitat and RecastDemo.
///
/// The format is MSET version 1 or 2 with Detour tiles of version 7. Polygon references have 32 bits, or
/// 64 bits if the writer was built with DT_POLYREF64. Version 1 stores no settings: the agent's size is
/// taken from the tiles, and the other settings are defaults. Off-mesh connections are ignored.
///
/// Every count and index is checked against the file before it is used, and no memory is allocated for a
/// count that the file is too short for.
/// @return file_not_found; invalid_file, with file, tile, field and value; unsupported for another
/// version, or for more tiles and polygons than 32-bit references can address; nothing_navigable for a
/// file without polygons; out_of_memory.
Result<NavMesh> load_navmesh(const std::filesystem::path& path);

/// Reads a NavMesh file from memory.
/// @param bytes Content of the file.
/// @param name Name of the file in error messages.
Result<NavMesh> parse_navmesh(std::span<const std::byte> bytes, const std::string& name);

/// Writes a NavMesh file with 32-bit references, which Habitat can read. Coordinates are world
/// coordinates in float32.
/// @param mesh Mesh to write.
/// @param path File to write.
/// @param version 2 stores the settings. 1, for RecastDemo and the first releases of Habitat, stores
/// only the agent's size in each tile.
/// @return invalid_argument for another version; file_not_found if the file cannot be created;
/// write_failed.
Status save_navmesh(const NavMesh& mesh, const std::filesystem::path& path, int version = 2);

/// Writes the surface as a Wavefront OBJ file for viewers, in world coordinates with one group per
/// island ("g island_0").
/// @return file_not_found if the file cannot be created; write_failed.
Status save_navmesh_obj(const NavMesh& mesh, const std::filesystem::path& path);

}  // namespace gsnav
