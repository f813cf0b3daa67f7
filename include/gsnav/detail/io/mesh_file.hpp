// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/read_limits.hpp"
#include "gsnav/detail/scene/textured_scene.hpp"
#include "gsnav/detail/scene/triangle_mesh.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav::io {

/// Reads the vertices and faces of a Wavefront OBJ: `v`, and `f` with or without `/`, with positive or
/// negative indices. Polygons become fans around their first corner; everything else is skipped. Errors:
/// file_not_found; invalid_file naming the line and the word (an index beyond the vertices read so far,
/// fewer than three corners, a coordinate that is not a finite number); out_of_memory. Never throws.
Result<TriangleMesh> load_obj(const std::filesystem::path& path);

/// Writes triangles as a Wavefront OBJ, `v` and `f` lines. Vertices are read back as the nearest
/// float32. Errors: invalid_argument naming a vertex that is not finite or a triangle with an index
/// beyond the vertices; file_not_found; write_failed, in which case an existing file is unchanged.
Status save_obj(const std::filesystem::path& path, std::span<const Vec3d> vertices,
                std::span<const std::array<std::uint32_t, 3>> triangles);

/// Reads the triangles of a PLY, text or binary of either byte order: x, y, z of element `vertex` (any
/// scalar type) and the list `vertex_indices` or `vertex_index` of element `face`. Polygons become fans.
/// Errors: file_not_found; invalid_file (malformed header, missing rows, an index beyond the vertices,
/// fewer than three corners, a coordinate that is not a finite number); out_of_memory. Never throws.
Result<TriangleMesh> load_ply_mesh(const std::filesystem::path& path);

/// Reads the triangles of a glTF 2.0 file, GLB or JSON: every primitive of the scene with mode
/// TRIANGLES, STRIP or FAN, with its node's transform applied. Triangles under a mirroring transform are
/// reversed, so that outsides stay outside. Other primitives, skins and morph targets are left out. Axes
/// and units are those of the file. Memory is at most 30 bytes for each byte of the file and its
/// buffers. Never throws.
/// @return the result, or one of these errors:
/// - file_not_found.
/// - invalid_file: indices, offsets and sizes that do not fit each other or the data, or no triangle
///   primitive.
/// - unsupported: a required extension that is not read, such as compressed geometry, or JSON nested
///   deeper than `limits` allow.
/// - invalid_argument: `limits` out of range.
/// - out_of_memory.
Result<TriangleMesh> load_gltf_mesh(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Reads the triangles of a glTF 2.0 file with their materials. Each primitive of a mesh is a part, with
/// an instance for each node that shows it. A node that mirrors or scales unevenly gets a part of its
/// own, with its transform applied. Axes and units are those of the file.
///
/// It reads normals, linear vertex colours (COLOR_0), base colour factor and texture with its
/// coordinates (KHR_texture_transform applied), alpha mode (OPAQUE, MASK with its cut-off, BLEND) with
/// the alphas that it uses, double-sided, and KHR_materials_unlit. Textures are PNG, JPEG (in builds
/// with libjpeg) or WebP, inside the file or next to it. For a texture that cannot be read only the
/// factor is used, with a warning. Errors: those of load_gltf_mesh. Never throws.
Result<TexturedScene> load_gltf_scene(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Reads any file that load_mesh reads, with materials: glTF by load_gltf_scene, others as one white
/// part. Errors: those of load_mesh.
Result<TexturedScene> load_textured_scene(const std::filesystem::path& path,
                                          const ReadLimits& limits = {});

/// Reads a mesh by its extension: OBJ, PLY or glTF. Errors: those of its reader; unsupported for another
/// extension.
Result<TriangleMesh> load_mesh(const std::filesystem::path& path, const ReadLimits& limits = {});

}  // namespace gsnav::io
