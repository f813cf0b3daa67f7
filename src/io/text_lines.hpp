// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "file.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

/// Iterates over the lines of a text and their words. Blank lines and text after a '#' are skipped.
/// Messages name the source and the line.
class TextLines {
 public:
  TextLines(std::string_view text, const std::string& source) : text_(text), source_(source) {}

  /// Goes to the next line with words. Returns false at the end.
  bool next() {
    while (at_ < text_.size()) {
      ++line_;
      const std::size_t end = text_.find('\n', at_) == text_.npos ? text_.size() : text_.find('\n', at_);
      split(text_.substr(at_, end - at_));
      at_ = end + 1;
      if (!words_.empty()) return true;
    }
    words_.clear();
    return false;
  }
  const std::vector<std::string_view>& words() const noexcept { return words_; }
  /// Word k of the line; empty if there is none.
  std::string_view word(std::size_t k) const noexcept {
    return k < words_.size() ? words_[k] : std::string_view{};
  }

  Status bad(const std::string& what) const {
    return {Errc::invalid_file, source_ + ": line " + std::to_string(line_) + ": " + what};
  }
  /// Reads word k as a finite number.
  Status number(std::size_t k, double& out) const {
    return parse(word(k), out) ? Status() : bad(in_quotes(word(k)) + " is not a number");
  }
  /// Parses the whole of `word` as a finite number.
  static bool parse(std::string_view word, double& out) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
    // A value too small for a double becomes zero.
    if (error == std::errc::result_out_of_range && end == word.data() + word.size()) {
      out = 0.0;
      return word.find("e-") != word.npos || word.find("E-") != word.npos;
    }
    return !word.empty() && error == std::errc{} && end == word.data() + word.size() &&
           std::isfinite(out);
  }

 private:
  void split(std::string_view line) {
    words_.clear();
    line = line.substr(0, line.find('#'));
    for (std::size_t i = 0; i < line.size();) {
      while (i < line.size() && static_cast<unsigned char>(line[i]) <= ' ') ++i;
      std::size_t n = i;
      while (n < line.size() && static_cast<unsigned char>(line[n]) > ' ') ++n;
      if (n > i) words_.push_back(line.substr(i, n - i));
      i = n;
    }
  }

  std::string_view text_;
  const std::string& source_;
  std::vector<std::string_view> words_;
  std::size_t at_ = 0, line_ = 0;
};

}  // namespace gsnav::io::detail
