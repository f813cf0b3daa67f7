// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

namespace gsnav_test {

/// Path of a real data file, or empty (after one line that says so) where it is not there.
inline std::string data_file(const std::string& relative) {
  const std::string path = std::string(GSNAV_DATA_DIR) + "/" + relative;
  if (std::filesystem::exists(path)) return path;
  std::printf("SKIP: %s is not there (GSNAV_DATA_DIR)\n", path.c_str());
  return {};
}

}  // namespace gsnav_test
