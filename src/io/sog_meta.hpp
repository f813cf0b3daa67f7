// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// What a byte of a plane stands for: up to 256 values. Shorter books make the bytes beyond an error.
using Codebook = std::vector<double>;

/// meta.json of either version, as tables from bytes to values.
struct SogMeta {
  std::size_t count = 0;  ///< Gaussians
  bool antialias = false;
  std::array<double, 3> mins{}, maxs{};  ///< of the means, after sign(v) log(1 + |v|)
  std::string means_low, means_high, scales, quats, sh0;
  std::array<Codebook, 3> log_scales;  ///< x, y, z
  std::array<Codebook, 3> dc;          ///< r, g, b
  Codebook opacity_logits;             ///< 256 entries
  int degree = 0;
  std::size_t palette = 0;  ///< entries of the SH palette
  Codebook rest;            ///< value of a coefficient in the palette
  std::string centroids, labels;
};

/// Errors name `source`, the field and its value.
Result<SogMeta> parse_sog_meta(std::span<const std::byte> text, const std::string& source);

}  // namespace gsnav::io::detail
