// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/io/scene_file.hpp"

namespace gsnav::io::detail {

/// load_packed_scene, which reads the SH bands of a PLY of `least_apart` rows or more apart from the
/// rest: the same bits.
Result<LoadedPackedCloud> load_packed(const std::string& spec, const LoadSceneOptions& options,
                                      std::size_t least_apart);

}  // namespace gsnav::io::detail
