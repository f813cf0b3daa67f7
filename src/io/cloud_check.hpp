// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io::detail {

/// What every writer asks of a cloud first: arrays of one length, ids inside their tables.
/// Error: invalid_argument, which names `path`.
Status check_arrays(const std::filesystem::path& path, const GaussianCloud& cloud);

/// Numbers a Gaussian in shN: 3 ((degree + 1)^2 - 1).
std::size_t rest_width(const GaussianCloud& cloud) noexcept;

}  // namespace gsnav::io::detail
