// SPDX-License-Identifier: Apache-2.0
#include "npy_format.hpp"

#include <charconv>
#include <limits>
#include <optional>
#include <string_view>

#include "file.hpp"
#include "quantised.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::string_view kMagic("\x93NUMPY", 6);
constexpr std::size_t kAlignment = 64;

/// Parser of the Python dictionary at the start of the file.
class NpyHeader {
 public:
  explicit NpyHeader(std::string_view text) : text_(text) {}

  std::string descr;
  std::optional<bool> fortran;
  std::optional<std::vector<std::size_t>> shape;

  /// Parses all three members, each once, in any order. Returns false for any other text.
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

enum class NpyKind { real, boolean, signed_integer, unsigned_integer };

struct Type {
  NpyKind kind = NpyKind::real;
  std::size_t size = 0;
};

/// The type of a NumPy type string: little-endian numbers only. '|' (no byte order) is for single bytes.
std::optional<Type> type_of(std::string_view descr) {
  if (descr == "<f2" || descr == "<f4" || descr == "<f8") {
    return Type{NpyKind::real, static_cast<std::size_t>(descr[2] - '0')};
  }
  if (descr == "|b1") return Type{NpyKind::boolean, 1};
  if (descr == "|i1" || descr == "|u1") {
    return Type{descr[1] == 'i' ? NpyKind::signed_integer : NpyKind::unsigned_integer, 1};
  }
  for (const std::string_view known : {"<i2", "<i4", "<i8", "<u2", "<u4", "<u8"}) {
    if (descr == known) {
      return Type{descr[1] == 'i' ? NpyKind::signed_integer : NpyKind::unsigned_integer,
                  static_cast<std::size_t>(descr[2] - '0')};
    }
  }
  return std::nullopt;
}

template <class T>
double number(const std::byte* p) {
  return static_cast<double>(load_le<T>(p));
}

double value_at(const std::byte* p, Type type) {
  const bool is_signed = type.kind == NpyKind::signed_integer, real = type.kind == NpyKind::real;
  switch (type.size) {
    case 1:
      if (type.kind == NpyKind::boolean) return load_le<std::uint8_t>(p) != 0 ? 1.0 : 0.0;
      return is_signed ? number<std::int8_t>(p) : number<std::uint8_t>(p);
    case 2:
      if (real) return half_to_double(load_le<std::uint16_t>(p));
      return is_signed ? number<std::int16_t>(p) : number<std::uint16_t>(p);
    case 4:
      if (real) return number<float>(p);
      return is_signed ? number<std::int32_t>(p) : number<std::uint32_t>(p);
    default:
      if (real) return number<double>(p);
      return is_signed ? number<std::int64_t>(p) : number<std::uint64_t>(p);
  }
}

/// Calls f(index in C order, index in the file) for every value.
template <class F>
void for_each_value(const std::vector<std::size_t>& shape, bool fortran, std::size_t count, F&& f) {
  if (!fortran || shape.size() < 2) {
    for (std::size_t i = 0; i < count; ++i) f(i, i);
    return;
  }
  std::vector<std::size_t> index(shape.size(), 0), strides(shape.size(), 1);
  for (std::size_t k = 1; k < shape.size(); ++k) strides[k] = strides[k - 1] * shape[k - 1];
  std::size_t from = 0;
  for (std::size_t i = 0; i < count; ++i) {
    f(i, from);
    for (std::size_t k = shape.size(); k-- > 0;) {
      from += strides[k];
      if (++index[k] < shape[k]) break;
      from -= strides[k] * shape[k];
      index[k] = 0;
    }
  }
}

}  // namespace

std::optional<std::size_t> npy_count(std::span<const std::size_t> shape) {
  std::size_t n = 1;
  for (const std::size_t d : shape) {
    if (d != 0 && n > std::numeric_limits<std::size_t>::max() / 8 / d) return std::nullopt;
    n *= d;
  }
  return n;
}

Result<std::string> npy_header(std::string_view descr, std::span<const std::size_t> shape,
                               std::size_t count, const std::string& name) {
  std::string out = "{'descr': '" + std::string(descr) + "', 'fortran_order': False, 'shape': (";
  for (const std::size_t d : shape) out += std::to_string(d) + ", ";
  // Python writes (3,) for one dimension, and no last comma for more.
  if (shape.size() > 1) out.resize(out.size() - 2);
  if (shape.size() == 1) out.pop_back();
  out += "), }";
  if (npy_count(shape) != count) {
    return {Errc::invalid_argument, name + ": " + std::to_string(count) + " values for " + out};
  }
  constexpr std::size_t kPrefix = 10;
  out.append(kAlignment - 1 - (kPrefix + out.size()) % kAlignment, ' ');
  out += '\n';
  if (out.size() > 0xffff) return {Errc::unsupported, name + ": too many dimensions"};
  const char length[2] = {static_cast<char>(out.size() & 0xff), static_cast<char>(out.size() >> 8)};
  return std::string(kMagic) + std::string("\x01\x00", 2) + std::string(length, 2) + out;
}

Result<NpyLayout> parse_npy_header(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with(kMagic)) return {Errc::invalid_file, name + ": not an .npy file"};
  const int version = text.size() > 7 ? static_cast<unsigned char>(text[6]) : 0;
  if (text.size() > 7 && (version < 1 || version > 3 || text[7] != 0)) {
    return {Errc::unsupported, name + ": .npy version " + std::to_string(version) + "." +
                                   std::to_string(static_cast<unsigned char>(text[7])) +
                                   ", only 1.0, 2.0 and 3.0 are read"};
  }
  const std::size_t prefix = version == 1 ? 10 : 12;
  std::size_t length = 0;
  if (text.size() >= prefix) {
    length = version == 1 ? load_le<std::uint16_t>(bytes.data() + 8)
                          : load_le<std::uint32_t>(bytes.data() + 8);
  }
  if (length == 0 || length > text.size() - prefix) {
    return {Errc::invalid_file, name + ": header cut off"};
  }
  const std::string_view dictionary = text.substr(prefix, length);
  NpyHeader header(dictionary);
  if (!header.parse()) {
    return {Errc::invalid_file, name + ": header not understood: " + in_quotes(dictionary)};
  }
  return NpyLayout{header.descr, *header.fortran, *header.shape, prefix + length, in_quotes(dictionary)};
}

Result<NpyArray> parse_npy(std::span<const std::byte> bytes, const std::string& name) {
  const auto layout = parse_npy_header(bytes, name);
  if (!layout) return layout.status();
  const auto type = type_of(layout->descr);
  if (!type) {
    return {Errc::unsupported, name + ": type " + in_quotes(layout->descr) +
                                   ", only little-endian floats, integers and booleans are read"};
  }
  const std::size_t held = bytes.size() - layout->values_at;
  const auto count = npy_count(layout->shape);
  if (!count || *count * type->size != held) {
    return {Errc::invalid_file,
            name + ": " + std::to_string(held) + " bytes of values do not fit " + layout->dictionary};
  }
  NpyArray out;
  out.shape = layout->shape;
  out.descr = layout->descr;
  out.is_double = layout->descr == "<f8";
  out.values.resize(*count);
  const std::byte* values = bytes.data() + layout->values_at;
  for_each_value(out.shape, layout->fortran, *count, [&](std::size_t to, std::size_t from) {
    out.values[to] = value_at(values + type->size * from, *type);
  });
  if (type->size == 8 && type->kind != NpyKind::real) {
    constexpr double kExact = 9007199254740992.0;  // 2^53, to which 2^53 + 1 is rounded
    for (std::size_t i = 0; i < *count; ++i) {
      if (std::fabs(out.values[i]) >= kExact) {
        return {Errc::unsupported, name + ": value " + std::to_string(i) +
                                       " reaches 2^53, where a double no " +
                                       "longer holds every integer"};
      }
    }
  }
  return out;
}

}  // namespace gsnav::io::detail
