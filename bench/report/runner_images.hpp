// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cache.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav_report {

/// Writes a PNG of three pictures side by side: the render, its difference from the reference times a
/// power of two, and the FLIP map. @return A caption, for example "render | difference x 2048 | FLIP,
/// full at 0.001".
gsnav::Result<std::string> save_comparison(const std::filesystem::path& path,
                                           const std::vector<float>& rgb, const Reference& reference);

}  // namespace gsnav_report
