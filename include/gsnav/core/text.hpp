// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "gsnav/config.hpp"

namespace gsnav {

/// Escapes text for a terminal. File names may contain bytes that control a terminal; Status escapes its
/// message with this function. Control characters (U+0000 to U+001F except tab and line feed, U+007F to
/// U+009F) and bytes that are not valid UTF-8 are written as \\xNN.
inline std::string printable(std::string_view text) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
    const unsigned first = byte(i);
    // Length in bytes of the character that starts here, from its first byte. 0 for an invalid start.
    const std::size_t length = first < 0x80   ? 1
                               : first < 0xc2 ? 0
                               : first < 0xe0 ? 2
                               : first < 0xf0 ? 3
                               : first < 0xf5 ? 4
                                              : 0;
    bool good = length != 0 && i + length <= text.size();
    for (std::size_t k = 1; good && k < length; ++k) good = (byte(i + k) & 0xc0) == 0x80;
    if (good && length == 1) good = (first >= 0x20 && first != 0x7f) || first == '\n' || first == '\t';
    if (good && length == 2) good = first != 0xc2 || byte(i + 1) >= 0xa0;
    if (good) {
      out.append(text.substr(i, length));
      i += length;
    } else {
      out.append({'\\', 'x', kDigits[first >> 4], kDigits[first & 15]});
      ++i;
    }
  }
  return out;
}

/// `text` with the letters A to Z in lower case, in any locale. Used for joint names and file
/// extensions.
inline std::string lower_case(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

}  // namespace gsnav
