// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// The values that the bytes of an image stand for, up to 256. Bytes beyond the end of a shorter book
/// are an error.
using Codebook = std::vector<double>;

/// The content of meta.json, of either version, as tables from bytes to values.
struct SogMeta {
  std::size_t count = 0;  ///< Gaussians
  bool antialias = false;
  std::array<double, 3> mins{}, maxs{};  ///< Range of the means, after sign(v) log(1 + |v|).
  std::string means_low, means_high, scales, quats, sh0;
  std::array<Codebook, 3> log_scales;  ///< x, y, z.
  std::array<Codebook, 3> dc;          ///< r, g, b.
  Codebook opacity_logits;             ///< 256 entries.
  int degree = 0;
  std::size_t palette = 0;  ///< Number of entries of the SH palette.
  Codebook rest;            ///< Value of a coefficient in the palette.
  std::string centroids, labels;
};

/// Parses meta.json. Errors name `source`, the field and its value.
Result<SogMeta> parse_sog_meta(std::span<const std::byte> text, const std::string& source);

}  // namespace gsnav::io::detail
