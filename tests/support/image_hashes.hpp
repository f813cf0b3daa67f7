// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/detail/scene/content_hash.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_test {

/// Where the environment variable GSNAV_IMAGE_HASHES names a file, appends a line for each of these
/// images: test case | backend | number of the call in that case on that backend | image | 128-bit hash
/// of its values. Empty images have no line. tools/image_hashes.sh compares such files before and after
/// a change that must not change a bit.
template <class S>
void record_hashes(std::initializer_list<std::pair<const char*, const std::vector<S>*>> images,
                   const std::string& backend) {
  const char* path = std::getenv("GSNAV_IMAGE_HASHES");
  if (path == nullptr) return;
  const std::string test = doctest::getContextOptions()->currentTest->m_name;
  static std::map<std::pair<std::string, std::string>, int> calls;
  const int call = calls[{test, backend}]++;
  std::FILE* file = std::fopen(path, "a");
  REQUIRE(file != nullptr);
  for (const auto& [image, values] : images) {
    if (values->empty()) continue;
    gsnav::Hasher h;
    h.array(*values);
    std::fprintf(file, "%s | %s | %d | %s | %s\n", test.c_str(), backend.c_str(), call, image,
                 h.hex().c_str());
  }
  REQUIRE(std::fclose(file) == 0);
}

/// The same for the images of these frames.
template <class S>
void record_hashes(const gsnav::Frames<S>& frames, const std::string& backend) {
  record_hashes<S>({{"rgb", &frames.rgb},
                    {"alpha", &frames.alpha},
                    {"median_depth", &frames.median_depth},
                    {"expected_depth", &frames.expected_depth},
                    {"accumulated_depth", &frames.accumulated_depth},
                    {"first_hit_depth", &frames.first_hit_depth}},
                   backend);
}

}  // namespace gsnav_test
