// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>
#include <string_view>

#include "gsnav/core/status.hpp"

namespace gsnav::detail {

/// Value of the environment variable GSNAV_ISA, which limits the instruction sets. Null if it is empty
/// or not set.
inline const char* instruction_set_limit() noexcept {
  const char* const name = std::getenv("GSNAV_ISA");
  return name == nullptr || *name == '\0' ? nullptr : name;
}

/// Refuses an unknown name in GSNAV_ISA (invalid_argument), which would be read as the slowest set.
inline Status check_instruction_set() {
  const char* const name = instruction_set_limit();
  if (name == nullptr) return {};
  for (const std::string_view known : {"baseline", "avx2", "avx512"}) {
    if (name == known) return {};
  }
  return {Errc::invalid_argument,
          std::string("GSNAV_ISA=") + name + ": must be baseline, avx2 or avx512"};
}

}  // namespace gsnav::detail
