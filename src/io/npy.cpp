// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <limits>
#include <optional>
#include <string_view>

#include "file.hpp"
#include "gsnav/io/image_file.hpp"

namespace gsnav::io {
namespace {

constexpr std::string_view kMagic("\x93NUMPY\x01\x00", 8);
constexpr std::size_t kPrefix = 10;  // magic, version, length of the header
constexpr std::size_t kAlignment = 64;

/// Product of the dimensions, or nothing where it does not fit.
std::optional<std::size_t> count_of(std::span<const std::size_t> shape) {
  std::size_t n = 1;
  for (const std::size_t d : shape) {
    if (d != 0 && n > std::numeric_limits<std::size_t>::max() / 8 / d) return std::nullopt;
    n *= d;
  }
  return n;
}

template <class T>
Status save(const std::filesystem::path& path, std::span<const T> values,
            std::span<const std::size_t> shape) {
  return detail::guarded(path.string(), [&]() -> Status {
    std::string header = std::string("{'descr': '") + (sizeof(T) == 4 ? "<f4" : "<f8") +
                         "', 'fortran_order': False, 'shape': (";
    for (const std::size_t d : shape) header += std::to_string(d) + ", ";
    // One dimension keeps its comma, more lose the last one.
    if (shape.size() > 1) header.resize(header.size() - 2);
    if (shape.size() == 1) header.pop_back();
    header += "), }";
    if (count_of(shape) != values.size()) {
      return {Errc::invalid_argument,
              path.string() + ": " + std::to_string(values.size()) + " values for " + header};
    }
    header.append(kAlignment - 1 - (kPrefix + header.size()) % kAlignment, ' ');
    header += '\n';
    if (header.size() > 0xffff) return {Errc::unsupported, path.string() + ": too many dimensions"};
    detail::OutFile out;
    if (Status s = out.open(path); !s) return s;
    const unsigned char length[2] = {static_cast<unsigned char>(header.size() & 0xff),
                                     static_cast<unsigned char>(header.size() >> 8)};
    out.write(kMagic.data(), kMagic.size());
    out.write(length, sizeof length);
    out.write(header.data(), header.size());
    out.write(values.data(), values.size_bytes());
    return out.close();
  });
}

/// Parser of the Python dictionary in front of the values.
class NpyHeader {
 public:
  explicit NpyHeader(std::string_view text) : text_(text) {}

  std::string descr;
  std::optional<bool> fortran;
  std::optional<std::vector<std::size_t>> shape;

  /// Reads all three members, each once, in any order; false where the text is anything else.
  bool parse() {
    if (!take("{")) return false;
    while (!take("}")) {
      std::string key;
      if (!take_string(key) || !take(":")) return false;
      if (key == "descr" && descr.empty()) {
        if (!take_string(descr)) return false;
      } else if (key == "fortran_order" && !fortran) {
        const bool yes = take("True");
        if (!yes && !take("False")) return false;
        fortran = yes;
      } else if (key != "shape" || shape || !take_shape()) {
        return false;
      }
      if (!take(",")) {
        if (!take("}")) return false;
        break;
      }
    }
    skip_blanks();
    return text_.empty() && !descr.empty() && fortran && shape;
  }

 private:
  void skip_blanks() {
    while (!text_.empty() && (text_.front() == ' ' || text_.front() == '\n')) text_.remove_prefix(1);
  }
  bool take(std::string_view word) {
    skip_blanks();
    if (!text_.starts_with(word)) return false;
    text_.remove_prefix(word.size());
    return true;
  }
  bool take_string(std::string& out) {
    skip_blanks();
    if (text_.empty() || (text_.front() != '\'' && text_.front() != '"')) return false;
    const std::size_t end = text_.find(text_.front(), 1);
    if (end == std::string_view::npos) return false;
    out = text_.substr(1, end - 1);
    text_.remove_prefix(end + 1);
    return true;
  }
  bool take_shape() {
    if (!take("(")) return false;
    shape.emplace();
    while (!take(")")) {
      skip_blanks();
      std::size_t d = 0;
      const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), d);
      if (error != std::errc{}) return false;
      text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
      shape->push_back(d);
      if (!take(",")) return take(")");
    }
    return true;
  }

  std::string_view text_;
};

Result<NpyArray> parse(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with(kMagic.substr(0, 6))) return {Errc::invalid_file, name + ": not an .npy file"};
  if (!text.starts_with(kMagic)) return {Errc::unsupported, name + ": only .npy version 1.0 is read"};
  const std::size_t length =
      text.size() >= kPrefix ? detail::load_le<std::uint16_t>(bytes.data() + 8) : 0;
  if (length == 0 || length > text.size() - kPrefix)
    return {Errc::invalid_file, name + ": header cut off"};
  const std::string_view dictionary = text.substr(kPrefix, length);
  NpyHeader header(dictionary);
  if (!header.parse()) {
    return {Errc::invalid_file, name + ": header not understood: " + detail::in_quotes(dictionary)};
  }
  NpyArray out;
  out.is_double = header.descr == "<f8";
  if ((!out.is_double && header.descr != "<f4") || *header.fortran) {
    return {Errc::unsupported, name + ": type " + detail::in_quotes(header.descr) +
                                   (*header.fortran ? " in Fortran order" : "") +
                                   ", only '<f4' and '<f8' in C order are read"};
  }
  out.shape = *header.shape;
  const std::size_t item = out.is_double ? 8 : 4, held = text.size() - kPrefix - length;
  const auto count = count_of(out.shape);
  if (!count || *count * item != held) {
    return {Errc::invalid_file, name + ": " + std::to_string(held) + " bytes of values do not fit " +
                                    detail::in_quotes(dictionary)};
  }
  out.values.resize(*count);
  const std::byte* values = bytes.data() + kPrefix + length;
  for (std::size_t i = 0; i < *count; ++i) {
    out.values[i] = out.is_double ? detail::load_le<double>(values + 8 * i)
                                  : static_cast<double>(detail::load_le<float>(values + 4 * i));
  }
  return out;
}

}  // namespace

Status save_npy(const std::filesystem::path& path, std::span<const float> values,
                std::span<const std::size_t> shape) {
  return save(path, values, shape);
}

Status save_npy(const std::filesystem::path& path, std::span<const double> values,
                std::span<const std::size_t> shape) {
  return save(path, values, shape);
}

Result<NpyArray> load_npy(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<NpyArray> {
    const auto file = detail::read_file(path);
    if (!file) return file.status();
    return parse(file->span(), path.string());
  });
}

}  // namespace gsnav::io
