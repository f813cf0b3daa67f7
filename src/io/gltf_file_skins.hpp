// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gltf_skin.hpp"

namespace gsnav::io::detail {

/// A skin of the file.
struct FileSkin {
  std::size_t index = 0, vertices = 0;
  std::string name;
  std::vector<std::size_t> nodes;  // in the order of the skin's list, as are the next two
  std::vector<Affine3<double>> binds;
  std::vector<double> loads;  // total weight of each joint
};

/// Text for messages: `"name" (skins[2], 538 vertices)`.
std::string described_skin(const FileSkin& s);

/// Reads the skins in `wanted` (GltfOptions::skins), at least one.
Result<std::vector<FileSkin>> read_file_skins(const GltfFile& file, const GltfNodes& nodes,
                                              const std::vector<std::string>& wanted);

}  // namespace gsnav::io::detail
