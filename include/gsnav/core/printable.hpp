// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "gsnav/config.hpp"

namespace gsnav {

/// Text for a terminal: what could steer it is written as \xNN, that is control characters but tab and
/// line feed, those of U+0080 to U+009F too, and bytes that are no UTF-8. Names of files may hold any of
/// these. Status does it for its message.
inline std::string printable(std::string_view text) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
    const unsigned first = byte(i);
    // Bytes of the character that begins here by its first one; 0 where none does.
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

}  // namespace gsnav
