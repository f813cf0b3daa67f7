// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "file.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "ply_header.hpp"

namespace gsnav::io::detail {

/// Whether the header is that of PlayCanvas' compressed PLY.
bool is_compressed_ply(const PlyHeader& header);

/// Reads PlayCanvas' compressed PLY. 256 Gaussians share a row of `chunk`, which has the ranges of the
/// packed integers in `vertex`; the optional `sh` has one byte for each f_rest_*. `bytes` is the whole
/// file. Errors: those of parse_ply.
Result<LoadedCloud> parse_compressed_ply(const ByteSource& bytes, const PlyHeader& header,
                                         const std::string& source);

}  // namespace gsnav::io::detail
