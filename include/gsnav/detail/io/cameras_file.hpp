// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/image/camera.hpp"

namespace gsnav::io {

/// Reads INRIA's cameras.json: an array of {id, img_name, width, height, position[3], rotation[3][3],
/// fx, fy}; position in metres, rotation camera-to-world with OpenCV axes, focal lengths in pixels.
///
/// The principal point is the image's centre, the near plane 0.2 m. With `width` and `height` (both
/// positive, or both 0 for the file's own) every camera gets that size, and fx and fy are both
/// multiplied by width / camera width: the horizontal field of view stays.
///
/// Errors: file_not_found; invalid_file naming the camera's index, the field and its value (also a
/// rotation that is none within 1e-3); invalid_argument; out_of_memory. Never throws.
Result<std::vector<Camera>> load_cameras(const std::filesystem::path& path, int width = 0,
                                         int height = 0);

/// Writes the same layout. Off-centre principal points have no place in it: unsupported, naming the
/// camera. Near planes are not written. Errors otherwise: file_not_found (parent folder), write_failed.
Status save_cameras(const std::filesystem::path& path, std::span<const Camera> cameras);

}  // namespace gsnav::io
