// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Reads a NavMesh file as Habitat and RecastDemo write it (MSET version 1 or 2 around Detour tiles of
/// version 7; 32-bit polygon references, or 64-bit ones as a library built with DT_POLYREF64 writes).
/// Version 1 holds no settings: the agent's size is taken from the tiles, the rest are defaults.
/// Off-mesh connections are left out.
///
/// Every count and index is checked against the file before it is used; nothing is allocated for a count
/// that the file has no bytes for. Errors: file_not_found; invalid_file naming file, tile, field and
/// value; unsupported for another version or more tiles and polygons than 32-bit references can name;
/// nothing_navigable for a file without polygons; out_of_memory.
Result<NavMesh> load_navmesh(const std::filesystem::path& path);

/// The same for a file in memory; `name` stands in messages.
Result<NavMesh> parse_navmesh(std::span<const std::byte> bytes, const std::string& name);

/// Writes MSET with 32-bit references, which Habitat reads, in world coordinates (float32). Version 2
/// has the settings; version 1, which RecastDemo and Habitat's first releases read, has none of them but
/// the agent's size in each tile. Errors: invalid_argument for another version; file_not_found where the
/// file cannot be made; write_failed.
Status save_navmesh(const NavMesh& mesh, const std::filesystem::path& path, int version = 2);

/// Writes the surface as a Wavefront OBJ for viewers: world coordinates, one group an island ("g
/// island_0"). Errors: file_not_found where the file cannot be made; write_failed.
Status save_navmesh_obj(const NavMesh& mesh, const std::filesystem::path& path);

}  // namespace gsnav
