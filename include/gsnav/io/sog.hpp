// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// Reads PlayCanvas' SOG format: a folder with meta.json and lossless WebP planes, the path of its
/// meta.json, or a bundled `.sog` (zip, stored or deflated entries). Versions 2 and 1 (version 1 only
/// without SH bands). SH degree 0 to 3 through the palette. `"antialias": true` sets the filter to mip.
///
/// Errors name the file, the field and the value: file_not_found (a plane is missing); invalid_file
/// (sizes of planes that do not fit the count or each other, a quaternion mode outside 252..255, a
/// palette label or a codebook index beyond its end, a damaged zip or WebP, more pixels than so few
/// bytes are believed to hold); unsupported (other versions, lossy planes, encrypted bundles);
/// out_of_memory. Never throws.
Result<LoadedCloud> load_sog(const std::filesystem::path& path);

}  // namespace gsnav::io
