// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/io/scene_file.hpp"

namespace gsnav::io::detail {

/// Implements load_packed_scene. The SH bands of a PLY with at least `least_apart` rows are read
/// separately from the rest, which gives the same bits.
Result<LoadedPackedCloud> load_packed(const std::string& spec, const LoadSceneOptions& options,
                                      std::size_t least_apart);

}  // namespace gsnav::io::detail
