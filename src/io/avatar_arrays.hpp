// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "npz_arrays.hpp"

namespace gsnav::io::detail {

/// The Gaussians of an avatar file. All values are finite and in range.
struct AvatarFileArrays {
  std::size_t count = 0;  ///< N
  int sh_degree = 0;
  NpyArray means;      ///< [N, 3].
  NpyArray scales;     ///< [N, 3], linear
  NpyArray quats;      ///< [N, 4].
  NpyArray opacities;  ///< [N], 0 to 1.
  NpyArray weights;    ///< [N, joints].
  NpyArray shs;        ///< [N, K, 3].
};

/// Reads Habitat-GS's arrays, or GART's parameters if the file has those. Adds guesses to `warnings`.
/// Errors: those of load_avatar.
Result<AvatarFileArrays> read_avatar_arrays(const NpzArrays& arrays, std::size_t joints,
                                            AvatarColors colors, std::vector<std::string>& warnings);

}  // namespace gsnav::io::detail
