// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/image/camera.hpp"

namespace gsnav::io {

/// Reads INRIA's cameras.json: an array of {id, img_name, width, height, position[3], rotation[3][3],
/// fx, fy}. Positions are in metres, rotations camera-to-world with OpenCV axes, focal lengths in
/// pixels. The principal point is the image's centre, the near plane 0.2 m.
///
/// If `width` and `height` are positive, every camera gets that size, and fx and fy are both multiplied
/// by width / camera width, so that the horizontal field of view is kept. If both are 0, cameras keep
/// their sizes.
///
/// Errors: file_not_found; invalid_file naming the camera's index, the field and its value (also for a
/// matrix that is not a rotation within 1e-3); invalid_argument; out_of_memory. Never throws.
Result<std::vector<Camera>> load_cameras(const std::filesystem::path& path, int width = 0,
                                         int height = 0);

/// Writes cameras in the same layout, without near planes. Errors: unsupported, naming the camera, for a
/// principal point off the centre, which the layout cannot hold; file_not_found (parent folder);
/// write_failed.
Status save_cameras(const std::filesystem::path& path, std::span<const Camera> cameras);

}  // namespace gsnav::io
