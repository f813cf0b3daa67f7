// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "support/data.hpp"

namespace gsnav_test {

/// Every scene of Gaussians in the data's splats/ that io::load_scene reads, sorted; empty where the
/// data is not there. Reference images' own files (.safetensors) are none; a set's `lod-meta.json` is
/// one beside its levels' files.
inline std::vector<std::string> real_scenes() {
  std::vector<std::string> out;
  const std::string folder = data_file("splats");
  if (folder.empty()) return out;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::filesystem::path& path = entry.path();
    const std::string name = path.filename().string(), extension = path.extension().string();
    if (name == "meta.json" || name == "lod-meta.json" || extension == ".ply" || extension == ".sog") {
      out.push_back(path.string());
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace gsnav_test
