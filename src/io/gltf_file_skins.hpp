// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gltf_skin.hpp"

namespace gsnav::io::detail {

/// One of the file's skins as it stands there.
struct FileSkin {
  std::size_t index = 0, vertices = 0;
  std::string name;
  std::vector<std::size_t> nodes;  // in the order of its list, as the rest
  std::vector<Affine3<double>> binds;
  std::vector<double> loads;  // how much weight each joint has
};

/// `"name" (skins[2], 538 vertices)`
std::string described_skin(const FileSkin& s);

/// The skins that `wanted` stands for (GltfOptions::skins), at least one.
Result<std::vector<FileSkin>> read_file_skins(const GltfFile& file, const GltfNodes& nodes,
                                              const std::vector<std::string>& wanted);

}  // namespace gsnav::io::detail
