// SPDX-License-Identifier: Apache-2.0
#include "ply_header.hpp"

#include <cctype>
#include <charconv>
#include <optional>
#include <set>
#include <string_view>

#include "file.hpp"

namespace gsnav::io::detail {
namespace {

std::optional<PlyType> ply_type(std::string_view word) {
  constexpr std::string_view names[][2] = {
      {"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
      {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"}};
  for (std::size_t k = 0; k < std::size(names); ++k) {
    if (word == names[k][0] || word == names[k][1]) return static_cast<PlyType>(k);
  }
  return std::nullopt;
}

/// Removes the next word from the front of `line` and returns it; empty at the end.
std::string_view take_word(std::string_view& line) {
  while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
  std::size_t n = 0;
  while (n < line.size() && line[n] != ' ' && line[n] != '\t') ++n;
  const std::string_view word = line.substr(0, n);
  line.remove_prefix(n);
  return word;
}

/// Whether a comment, as trainers write it, asks for the antialiased filter.
bool asks_for_mip(std::string_view comment) {
  std::string text;
  for (const char c : comment) {
    text += c == ':' || c == '=' ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  std::string_view rest = text;
  const std::string_view key = take_word(rest), value = take_word(rest);
  return (key == "splatrendermode" && value == "mip") ||
         (key == "antialiased" && (value == "1" || value == "true"));
}

class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::string& source) : text_(text), source_(source) {}

  Result<PlyHeader> run() {
    std::string_view line;
    if (!next_line(line) || line != "ply") return fail("does not begin with 'ply'");
    while (next_line(line)) {
      std::string_view rest = line;
      const std::string_view word = take_word(rest);
      Status s;
      if (word == "end_header") return finish();
      if (word == "comment" || word == "obj_info") {
        header_.mip = header_.mip || asks_for_mip(rest);
      } else if (word == "format") {
        s = format(rest);
      } else if (word == "element") {
        s = element(rest);
      } else if (word == "property") {
        s = property(rest);
      } else if (!word.empty()) {
        s = fail("unknown keyword " + in_quotes(word));
      }
      if (!s) return s;
    }
    return fail(text_.size() > kLargestPlyHeader ? "the header is longer than 1 MiB" : "no end_header");
  }

 private:
  Status fail(const std::string& what) const {
    return {Errc::invalid_file, source_ + ": line " + std::to_string(line_number_) + ": " + what};
  }

  bool next_line(std::string_view& line) {
    ++line_number_;
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos || end >= kLargestPlyHeader) return false;
    line = text_.substr(at_, end - at_);
    at_ = end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return true;
  }

  Status format(std::string_view rest) {
    const std::string_view name = take_word(rest), version = take_word(rest);
    if (has_format_) return fail("a second format");
    has_format_ = true;
    if (name == "ascii") {
      header_.format = PlyFormat::ascii;
    } else if (name == "binary_little_endian") {
      header_.format = PlyFormat::little;
    } else if (name == "binary_big_endian") {
      header_.format = PlyFormat::big;
    } else {
      return fail("format " + in_quotes(name) +
                  " is none of ascii, binary_little_endian, binary_big_endian");
    }
    if (version != "1.0") return fail("format version " + in_quotes(version) + ", must be 1.0");
    return {};
  }

  Status element(std::string_view rest) {
    const std::string_view name = take_word(rest), count = take_word(rest);
    PlyElement e;
    e.name = name;
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), e.count);
    if (name.empty() || count.empty() || error != std::errc{} || end != count.data() + count.size()) {
      return fail("element " + in_quotes(name) + ": " + in_quotes(count) + " is not a count");
    }
    for (const PlyElement& other : header_.elements) {
      if (other.name == e.name) return fail("element " + in_quotes(name) + " comes twice");
    }
    header_.elements.push_back(std::move(e));
    names_.clear();
    return {};
  }

  Status property(std::string_view rest) {
    if (header_.elements.empty()) return fail("a property before any element");
    PlyElement& e = header_.elements.back();
    PlyProperty p;
    std::string_view type = take_word(rest);
    if (type == "list") {
      p.is_list = e.has_list = true;
      const std::string_view counts = take_word(rest);
      const auto known = ply_type(counts);
      if (!known || *known >= PlyType::f32)
        return fail(in_quotes(counts) + " is no type of a list's length");
      p.count_type = *known;
      type = take_word(rest);
    }
    const auto known = ply_type(type);
    if (!known) return fail(in_quotes(type) + " is no type of a property");
    p.type = *known;
    p.name = take_word(rest);
    if (p.name.empty()) return fail("a property without a name");
    if (!names_.insert(p.name).second) {
      return fail("property " + in_quotes(p.name) + " of element " + in_quotes(e.name) + " comes twice");
    }
    p.offset = e.stride;
    if (!p.is_list) e.stride += size_of(p.type);
    e.properties.push_back(std::move(p));
    return {};
  }

  Result<PlyHeader> finish() {
    if (!has_format_) return fail("no format before end_header");
    header_.size = at_;
    return std::move(header_);
  }

  std::string_view text_;
  const std::string& source_;
  PlyHeader header_;
  std::set<std::string> names_;  // names of the last element's properties
  std::size_t at_ = 0;
  std::size_t line_number_ = 0;
  bool has_format_ = false;
};

}  // namespace

Result<PlyHeader> parse_ply_header(std::span<const std::byte> bytes, const std::string& source) {
  return HeaderParser({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, source).run();
}

Status ply_rows_missing(const std::string& source, const PlyElement& e, std::uint64_t present) {
  return {Errc::invalid_file, source + ": element " + in_quotes(e.name) + " promises " +
                                  std::to_string(e.count) + " rows, " + std::to_string(present) +
                                  " are there"};
}

}  // namespace gsnav::io::detail
