// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/temporal_edit.hpp"

namespace gsnav::io::detail {

struct BandsApart;

/// Implements io::load_ply and io::parse_ply, for which `moving` is null. Otherwise `moving` gets the
/// time planes of a file that has any; its cloud is in the result. `apart`: lets the bands be left out
/// or be read separately (see BandsApart).
Result<LoadedCloud> load_ply(const std::filesystem::path& path, TemporalCloud* moving,
                             BandsApart* apart = nullptr);
Result<LoadedCloud> parse_ply(std::span<const std::byte> bytes, const std::string& source,
                              TemporalCloud* moving);

}  // namespace gsnav::io::detail
