// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>

#include "support/sanitized.hpp"

namespace gsnav_test {

/// How many random cases a property is tried on: n times the number in GSNAV_TEST_CASES (1 where it
/// is not set; a tenth under a sanitizer, which is that much slower).
inline int cases(int n) {
  double factor = kSanitized ? 0.1 : 1.0;
  if (const char* text = std::getenv("GSNAV_TEST_CASES")) factor = std::atof(text);
  const double wanted = factor * n;
  return wanted >= 1 ? static_cast<int>(wanted) : 1;
}

}  // namespace gsnav_test
