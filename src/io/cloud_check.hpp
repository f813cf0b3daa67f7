// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io::detail {

/// Checks what every writer requires of a cloud: arrays of one length, and ids inside their tables.
/// Error: invalid_argument, naming `path`.
Status check_arrays(const std::filesystem::path& path, const GaussianCloud& cloud);

/// Number of values in shN for each Gaussian: 3 ((degree + 1)^2 - 1).
std::size_t rest_width(const GaussianCloud& cloud) noexcept;

}  // namespace gsnav::io::detail
