// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace gsnav {

/// `text` with the letters A to Z in lower case, in any locale. Used for joint names and file
/// extensions.
inline std::string lower_case(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

}  // namespace gsnav
