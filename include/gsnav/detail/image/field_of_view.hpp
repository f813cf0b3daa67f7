// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/core/status.hpp"

namespace gsnav::detail {

/// Checks the field of view of a pinhole camera, degrees. `subject` begins the message.
inline Status validate_hfov(const char* subject, double hfov) {
  if (hfov > 0 && hfov < 180) return {};
  return BadArgument{subject}("hfov", hfov, "must be in (0, 180) degrees");
}

}  // namespace gsnav::detail
