// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/detail/scene/content_hash.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_test {

/// Where the environment variable GSNAV_IMAGE_HASHES names a file, appends a line for each image of
/// these frames: test case | backend | number of the call in that case on that backend | image | 128-bit
/// hash of its values. tools/image_hashes.sh compares such files before and after a change that must not
/// change a bit.
template <class S>
void record_hashes(const gsnav::Frames<S>& frames, const std::string& backend) {
  const char* path = std::getenv("GSNAV_IMAGE_HASHES");
  if (path == nullptr) return;
  const std::string test = doctest::getContextOptions()->currentTest->m_name;
  static std::map<std::pair<std::string, std::string>, int> calls;
  const int call = calls[{test, backend}]++;
  std::FILE* file = std::fopen(path, "a");
  REQUIRE(file != nullptr);
  const auto line = [&](const char* image, const std::vector<S>& values) {
    if (values.empty()) return;
    gsnav::Hasher h;
    h.array(values);
    std::fprintf(file, "%s | %s | %d | %s | %s\n", test.c_str(), backend.c_str(), call, image,
                 h.hex().c_str());
  };
  line("rgb", frames.rgb);
  line("alpha", frames.alpha);
  line("median_depth", frames.median_depth);
  line("expected_depth", frames.expected_depth);
  line("accumulated_depth", frames.accumulated_depth);
  line("first_hit_depth", frames.first_hit_depth);
  REQUIRE(std::fclose(file) == 0);
}

}  // namespace gsnav_test
