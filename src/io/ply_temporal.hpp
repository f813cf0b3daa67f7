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

/// io::load_ply and io::parse_ply where `moving` is null. Else the time planes of a file that has any go
/// there; its cloud is the result's. `apart`: where its bands may be read apart from the rest
/// (BandsApart::degree says whether they were left out), or are read.
Result<LoadedCloud> load_ply(const std::filesystem::path& path, TemporalCloud* moving,
                             BandsApart* apart = nullptr);
Result<LoadedCloud> parse_ply(std::span<const std::byte> bytes, const std::string& source,
                              TemporalCloud* moving);

}  // namespace gsnav::io::detail
