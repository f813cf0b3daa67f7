// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/triangle_mesh.hpp"

namespace gsnav::io {

/// Reads the vertices and faces of a Wavefront OBJ: `v`, and `f` with or without `/`, positive or
/// negative indices; polygons become fans around their first corner. Everything else is skipped.
/// Errors: file_not_found; invalid_file naming the line, the word and what is wrong with it (an index
/// outside the vertices read so far, fewer than three corners, a coordinate that is no finite number);
/// out_of_memory. Never throws.
Result<TriangleMesh> load_obj(const std::filesystem::path& path);

}  // namespace gsnav::io
