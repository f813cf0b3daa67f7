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
/// Memory is bounded by 62 MB and 2 kB for each byte of the planes: constant planes of any size fit into
/// some bytes. Errors name the file, the field and the value: file_not_found (a plane is missing);
/// invalid_file (sizes of planes that do not fit the count or each other, a quaternion mode outside
/// 252..255, a palette label or a codebook index beyond its end, a damaged zip or WebP, more pixels than
/// so few bytes are believed to hold); unsupported (other versions, lossy planes, encrypted bundles);
/// out_of_memory. Never throws.
Result<LoadedCloud> load_sog(const std::filesystem::path& path);

/// Writes a cloud as SOG version 2: a bundle where `path` ends in `.sog`, else the files beside
/// `path`/meta.json, whose folder must exist. Where a scene lies there already the new images get names
/// that it does not use (means_l.1.webp), meta.json is replaced last and the old images are removed:
/// whenever the writer is stopped, the folder has one whole scene. Rows are written in the order in
/// which they were read. Planes compress better where neighbours in space are neighbours there: clear
/// `row_ids` after sort_spatially to have the cloud's own order written; ties of depth are then drawn in
/// another order.
///
/// Read back: a mean v is within (1 + |v|) r / 131070, r being the range of log(1 + |v|) of its axis;
/// the quaternion's smaller components within 0.0028, opacities within 1/510; log-scales (-infinity is
/// written as -20) and degree-0 coefficients within 1/255 of their range, exact where there are at most
/// 256 different values. Higher SH bands share a palette of N/2 entries, at least 1024 and at most
/// 65536; up to that many different ones are kept but for the codebook's 1/255 of the range. Errors:
/// file_not_found (the folder is missing), write_failed; invalid_argument (arrays of
/// different lengths, another name); unsupported (more than 268 million Gaussians, a bundle of 4 GiB);
/// out_of_memory. Never throws.
Status save_sog(const std::filesystem::path& path, const GaussianCloud& cloud);

}  // namespace gsnav::io
