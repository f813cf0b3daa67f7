// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io {

/// Reads PlayCanvas' SOG format: a folder with meta.json and lossless WebP images, the path of its
/// meta.json, or a bundled `.sog` (zip with stored or deflated entries). Reads version 2, and version 1
/// without SH bands. SH bands (degree 1 to 3) come from the palette. `"antialias": true` sets the filter
/// to mip.
///
/// Memory is at most 62 MB plus 2 kB for each byte of the images, because constant images of any size
/// compress to a few bytes. Errors name the file, the field and the value. Never throws.
/// @return the result, or one of these errors:
/// - file_not_found: an image is missing.
/// - invalid_file: sizes of images that do not fit the count or each other, a quaternion mode outside
///   252..255, a palette label or codebook index beyond its end, a damaged zip or WebP, or more pixels
///   than the number of bytes makes plausible.
/// - unsupported: other versions, lossy images, or encrypted bundles.
/// - out_of_memory.
Result<LoadedCloud> load_sog(const std::filesystem::path& path);

/// Writes a cloud as SOG version 2: a bundle if `path` ends in `.sog`, otherwise files next to `path`,
/// which must be named meta.json, in an existing folder. If the folder has a scene already, the new
/// images get unused names (means_l.1.webp), meta.json is replaced last and the old images are then
/// removed. The folder holds a complete scene at any moment.
///
/// Rows are written in the order in which they were read. Images compress better in spatial order: to
/// write the cloud's own order, clear `row_ids` after sort_spatially. Ties of depth are then drawn in
/// another order.
///
/// Values are read back with these errors:
///
/// - mean v: (1 + |v|) r / 131070, with r the range of log(1 + |v|) of its axis.
/// - the three smaller components of a quaternion: 0.0028.
/// - opacity: 1/510.
/// - log-scales (-infinity is written as -20) and coefficients of degree 0: 1/255 of their range; exact
///   if there are at most 256 different values.
/// - higher SH bands: they share a palette of N/2 entries, at least 1024 and at most 65536. With no more
///   distinct values than that, the error is 1/255 of the range.
///
/// Errors: file_not_found (the folder is missing); write_failed; invalid_argument (arrays of different
/// lengths, another name); unsupported (more than 268 million Gaussians, a bundle of 4 GiB);
/// out_of_memory. Never throws.
Status save_sog(const std::filesystem::path& path, const GaussianCloud& cloud);

}  // namespace gsnav::io
