// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace gsnav {

/// With the letters A to Z in lower case, whatever the locale; for names of joints and the endings of
/// files.
inline std::string lower_case(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

}  // namespace gsnav
