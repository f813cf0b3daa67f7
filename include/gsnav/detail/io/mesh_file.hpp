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

/// Reads the vertices and faces of a Wavefront OBJ: `v`, and `f` with or without `/`, positive or
/// negative indices; polygons become fans around their first corner. Everything else is skipped.
/// Errors: file_not_found; invalid_file naming the line, the word and what is wrong with it (an index
/// outside the vertices read so far, fewer than three corners, a coordinate that is no finite number);
/// out_of_memory. Never throws.
Result<TriangleMesh> load_obj(const std::filesystem::path& path);

/// Writes triangles as a Wavefront OBJ, `v` and `f` lines. A vertex comes back as the float32 nearest to
/// it. Errors: invalid_argument naming the vertex that is not finite or the triangle with an index
/// outside the vertices; file_not_found, write_failed, after which the file of before is unchanged.
Status save_obj(const std::filesystem::path& path, std::span<const Vec3d> vertices,
                std::span<const std::array<std::uint32_t, 3>> triangles);

/// Reads the vertices (x y z of element `vertex`, any scalar type) and faces (the list `vertex_indices`
/// or `vertex_index` of element `face`; polygons become fans) of a PLY, text or binary of either byte
/// order. Errors: file_not_found; invalid_file (malformed header, rows missing, an index outside the
/// vertices, fewer than three corners, a coordinate that is no finite number); out_of_memory. Never
/// throws.
Result<TriangleMesh> load_ply_mesh(const std::filesystem::path& path);

/// Reads the triangles of a glTF 2.0 file, GLB or JSON: every primitive of the scene with mode
/// TRIANGLES, STRIP or FAN, its node's transform applied (mirrored ones turned round, so that outsides
/// stay outside); other primitives, skins and morph targets are left out. Axes and units are the file's.
/// Memory is bounded by 30 bytes for each byte of the file and its buffers.
/// Errors: file_not_found; invalid_file (indices, offsets and sizes that do not fit each other or the
/// bytes there are, no triangle primitive); unsupported (a required extension that is not read:
/// compressed geometry, say; JSON nested deeper than `limits` allow); invalid_argument (`limits`);
/// out_of_memory. Never throws.
Result<TriangleMesh> load_gltf_mesh(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Reads the same triangles with what they look like: a part for each primitive of a mesh, standing
/// wherever nodes show it; normals, linear vertex colours (COLOR_0), base colour factor and texture with
/// its coordinates (KHR_texture_transform applied), alpha mode (OPAQUE, MASK with its cut-off, BLEND)
/// with the alphas that it reads, double-sided and KHR_materials_unlit. Pictures are PNG, JPEG (where
/// the build has libjpeg) or WebP, in the file or beside it; one that cannot be read leaves the factor
/// and a warning. A node that mirrors or scales unevenly gets a part of its own with its transform
/// applied. Axes and units are the file's. Errors: as of load_gltf_mesh. Never throws.
Result<TexturedScene> load_gltf_scene(const std::filesystem::path& path, const ReadLimits& limits = {});

/// Reads what load_mesh reads with what it looks like: glTF by load_gltf_scene, others as one white
/// part. Errors: as of load_mesh.
Result<TexturedScene> load_textured_scene(const std::filesystem::path& path,
                                          const ReadLimits& limits = {});

/// A mesh by its extension: OBJ, PLY or glTF. Error beside its reader's: unsupported (another
/// extension).
Result<TriangleMesh> load_mesh(const std::filesystem::path& path, const ReadLimits& limits = {});

}  // namespace gsnav::io
