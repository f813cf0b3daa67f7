// SPDX-License-Identifier: Apache-2.0
#include "html_text.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace gsnav_tools {
namespace {

std::string to_text(double value, std::chars_format form, int precision) {
  std::array<char, 400> buffer{};
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, form, precision).ptr;
  std::string text(buffer.data(), end);
  const std::size_t e = text.find('e');  // Write 1e-05 as 1e-5.
  if (e != text.npos && text.size() == e + 4 && text[e + 2] == '0') text.erase(e + 2, 1);
  return text;
}

}  // namespace

std::string escape(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') out += c;
    }
  }
  return out;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kAlphabet =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out += i + k <= bytes.size() ? kAlphabet[word >> (18 - 6 * k) & 63u] : '=';
    }
  }
  return out;
}

std::string format(std::optional<double> value, int digits) {
  if (!value || std::isnan(*value)) return "\u2013";
  if (std::isinf(*value)) return *value > 0 ? "inf" : "-inf";
  if (*value == 0) return "0";
  const double magnitude = std::fabs(*value);
  if (magnitude < 1e-4 || magnitude >= 1e6)
    return to_text(*value, std::chars_format::scientific, digits - 1);
  const int before = static_cast<int>(std::floor(std::log10(magnitude))) + 1;
  return to_text(*value, std::chars_format::fixed, digits > before ? digits - before : 0);
}

std::string format_round(double value) {
  std::string text = format(value, 4);
  const std::size_t e = text.find('e');
  const std::string exponent = e == text.npos ? std::string() : text.substr(e);
  text.resize(text.size() - exponent.size());
  if (text.find('.') != text.npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text + exponent;
}

std::string coordinate(double value) { return to_text(value, std::chars_format::fixed, 2); }

}  // namespace gsnav_tools
