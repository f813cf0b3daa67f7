// SPDX-License-Identifier: Apache-2.0
#include "gsnav/io/ply.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <string_view>
#include <vector>

#include "file.hpp"
#include "ply_compressed.hpp"
#include "ply_header.hpp"

namespace gsnav::io {
namespace {

using detail::ply_rows_missing;
using detail::PlyElement;
using detail::PlyFormat;
using detail::PlyHeader;
using detail::PlyProperty;
using detail::PlyType;

constexpr std::size_t kBlock = 256;  // rows unpacked at a time: the columns stay in the cache
constexpr std::size_t kFixed = 14;   // x y z, f_dc 3, opacity, scale 3, rot 4

/// The vertex properties that are read, in the order of a block's columns.
struct Columns {
  std::vector<const PlyProperty*> properties;
  int degree = 0;
  std::size_t rest = 0;          ///< f_rest columns read: 3 ((degree + 1)^2 - 1)
  std::size_t rest_in_file = 0;  ///< f_rest properties in the file
};

Result<Columns> choose_columns(const PlyElement& vertex, const std::string& source) {
  static constexpr std::array<const char*, kFixed> kNames = {
      "x",       "y",       "z",       "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
      "scale_0", "scale_1", "scale_2", "rot_0",  "rot_1",  "rot_2",  "rot_3"};
  Columns c;
  for (const char* name : kNames) {
    const PlyProperty* p = vertex.find(name);
    if (p == nullptr) {
      return {Errc::invalid_file, source + ": element 'vertex' has no property '" + name + "'"};
    }
    c.properties.push_back(p);
  }
  for (const PlyProperty& p : vertex.properties) {
    c.rest_in_file += p.name.starts_with("f_rest_") ? 1 : 0;
  }
  static constexpr std::array<std::size_t, 5> kCounts = {0, 9, 24, 45, 72};
  const auto found = std::find(kCounts.begin(), kCounts.end(), c.rest_in_file);
  if (found == kCounts.end()) {
    return {Errc::invalid_file, source + ": " + std::to_string(c.rest_in_file) +
                                    " properties f_rest_*, must be 0, 9, 24, 45 or 72"};
  }
  c.degree = std::min(kMaxShDegree, static_cast<int>(found - kCounts.begin()));
  c.rest = kCounts[static_cast<std::size_t>(c.degree)];
  // Channel-major in the file; colour inner in the cloud.
  for (std::size_t k = 0; k < c.rest / 3; ++k) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const std::string name = "f_rest_" + std::to_string(channel * (c.rest_in_file / 3) + k);
      const PlyProperty* p = vertex.find(name);
      if (p == nullptr) {
        return {Errc::invalid_file, source + ": element 'vertex' has no property '" + name +
                                        "' among its " + std::to_string(c.rest_in_file) + " f_rest_*"};
      }
      c.properties.push_back(p);
    }
  }
  return c;
}

template <class T>
void unpack(const std::byte* rows, std::size_t n, std::size_t stride, bool swap, double* out) {
  for (std::size_t i = 0; i < n; ++i) {
    std::byte raw[sizeof(T)];
    std::memcpy(raw, rows + i * stride, sizeof(T));
    if (swap) std::reverse(raw, raw + sizeof(T));
    out[i] = static_cast<double>(detail::load_le<T>(raw));
  }
}

void unpack(PlyType type, const std::byte* rows, std::size_t n, std::size_t stride, bool swap,
            double* out) {
  switch (type) {
    case PlyType::i8:
      return unpack<std::int8_t>(rows, n, stride, swap, out);
    case PlyType::u8:
      return unpack<std::uint8_t>(rows, n, stride, swap, out);
    case PlyType::i16:
      return unpack<std::int16_t>(rows, n, stride, swap, out);
    case PlyType::u16:
      return unpack<std::uint16_t>(rows, n, stride, swap, out);
    case PlyType::i32:
      return unpack<std::int32_t>(rows, n, stride, swap, out);
    case PlyType::u32:
      return unpack<std::uint32_t>(rows, n, stride, swap, out);
    case PlyType::f32:
      return unpack<float>(rows, n, stride, swap, out);
    case PlyType::f64:
      return unpack<double>(rows, n, stride, swap, out);
  }
}

/// The rows behind the header: skips elements and unpacks blocks of the vertex element.
class Body {
 public:
  Body(std::span<const std::byte> bytes, const PlyHeader& header)
      : bytes_(bytes), at_(header.size), format_(header.format) {}

  std::size_t left() const noexcept { return bytes_.size() - at_; }

  /// Moves past up to `e.count` rows; returns how many there were.
  std::uint64_t skip(const PlyElement& e) {
    if (e.properties.empty()) return e.count;
    if (format_ == PlyFormat::ascii) return skip_text(e);
    if (!e.has_list) {
      const std::uint64_t rows = std::min<std::uint64_t>(e.count, left() / e.stride);
      at_ += static_cast<std::size_t>(rows) * e.stride;
      return rows;
    }
    // A list takes a byte at least, so the file's size bounds this loop whatever the count says.
    for (std::uint64_t row = 0; row < e.count; ++row) {
      for (const PlyProperty& p : e.properties) {
        std::uint64_t items = 1;
        if (p.is_list) {
          double length = 0;
          if (left() < size_of(p.count_type)) return row;
          unpack(p.count_type, bytes_.data() + at_, 1, 0, format_ == PlyFormat::big, &length);
          at_ += size_of(p.count_type);
          if (length < 0) return row;
          items = static_cast<std::uint64_t>(length);
        }
        if (items > left() / size_of(p.type)) return row;
        at_ += static_cast<std::size_t>(items) * size_of(p.type);
      }
    }
    return e.count;
  }

  /// Whole rows of `e` that the remaining bytes hold (in text: at most so many).
  std::uint64_t available(const PlyElement& e) const noexcept {
    // A number in text is a digit and a separator; the last may lack the separator.
    const std::size_t row = format_ == PlyFormat::ascii ? 2 * e.properties.size() : e.stride;
    return (left() + (format_ == PlyFormat::ascii ? 1 : 0)) / row;
  }

  /// Unpacks n rows: column c goes to block[c * kBlock ...]. Returns the rows that were there.
  std::size_t read(const PlyElement& e, const Columns& columns, std::size_t n, double* block) {
    if (format_ == PlyFormat::ascii) return read_text(e, columns, n, block);
    const std::byte* rows = bytes_.data() + at_;
    for (std::size_t c = 0; c < columns.properties.size(); ++c) {
      const PlyProperty& p = *columns.properties[c];
      unpack(p.type, rows + p.offset, n, e.stride, format_ == PlyFormat::big, block + c * kBlock);
    }
    at_ += n * e.stride;
    return n;
  }

  /// Moves past blanks, which a text file may end with.
  void skip_blanks() {
    while (format_ == PlyFormat::ascii && at_ < bytes_.size() && is_blank(bytes_[at_])) ++at_;
  }

 private:
  static bool is_blank(std::byte b) noexcept {
    return b == std::byte{' '} || b == std::byte{'\t'} || b == std::byte{'\r'} || b == std::byte{'\n'};
  }

  bool next_number(double& value) {
    skip_blanks();
    const std::size_t from = at_;
    while (at_ < bytes_.size() && !is_blank(bytes_[at_])) ++at_;
    const char* first = reinterpret_cast<const char*>(bytes_.data()) + from;
    const char* last = reinterpret_cast<const char*>(bytes_.data()) + at_;
    if (first != last && *first == '+') ++first;
    const auto [end, error] = std::from_chars(first, last, value);
    if (error == std::errc::result_out_of_range) {
      // from_chars does not say on which side of the range.
      const bool tiny = std::string_view(first, last).find("e-") != std::string_view::npos ||
                        std::string_view(first, last).find("E-") != std::string_view::npos;
      value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
      return end == last;
    }
    return error == std::errc{} && end == last;
  }

  std::uint64_t skip_text(const PlyElement& e) {
    for (std::uint64_t row = 0; row < e.count; ++row) {
      for (const PlyProperty& p : e.properties) {
        double value = 1;
        if (p.is_list && !(next_number(value) && value >= 0)) return row;
        const double items = value;
        for (double i = 0; i < items; ++i) {
          if (!next_number(value)) return row;
        }
      }
    }
    return e.count;
  }

  std::size_t read_text(const PlyElement& e, const Columns& columns, std::size_t n, double* block) {
    std::vector<double> row(e.properties.size());
    for (std::size_t i = 0; i < n; ++i) {
      for (double& value : row) {
        if (!next_number(value)) return i;
      }
      for (std::size_t c = 0; c < columns.properties.size(); ++c) {
        block[c * kBlock + i] =
            row[static_cast<std::size_t>(columns.properties[c] - e.properties.data())];
      }
    }
    return n;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_;
  PlyFormat format_;
};

void add_block(GaussianCloudBuilder& builder, const Columns& columns, const double* block,
               std::size_t n) {
  std::array<float, 45> rest;
  RawGaussian raw;
  raw.shN = columns.rest != 0 ? rest.data() : nullptr;
  for (std::size_t i = 0; i < n; ++i) {
    const auto at = [&](std::size_t column) { return block[column * kBlock + i]; };
    raw.mean = {at(0), at(1), at(2)};
    for (std::size_t k = 0; k < 3; ++k) raw.sh0[k] = static_cast<float>(at(3 + k));
    raw.opacity_logit = at(6);
    raw.log_scales = {at(7), at(8), at(9)};
    raw.quat = {at(10), at(11), at(12), at(13)};
    for (std::size_t k = 0; k < columns.rest; ++k) rest[k] = static_cast<float>(at(kFixed + k));
    builder.add(raw);
  }
}

Result<LoadedCloud> parse(std::span<const std::byte> bytes, const std::string& source) {
  auto parsed = detail::parse_ply_header(bytes, source);
  if (!parsed) return parsed.status();
  const PlyHeader& header = *parsed;
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const PlyElement& e) { return e.name == "vertex"; });
  if (vertex == header.elements.end()) return {Errc::invalid_file, source + ": no element 'vertex'"};
  if (detail::is_compressed_ply(header)) return detail::parse_compressed_ply(bytes, header, source);
  if (vertex->has_list) {
    return {Errc::unsupported, source + ": element 'vertex' has a list property"};
  }
  auto chosen = choose_columns(*vertex, source);
  if (!chosen) return chosen.status();
  const Columns& columns = *chosen;

  Body body(bytes, header);
  for (auto e = header.elements.begin(); e != vertex; ++e) {
    if (const std::uint64_t rows = body.skip(*e); rows != e->count) return ply_rows_missing(source, *e, rows);
  }
  if (const std::uint64_t rows = body.available(*vertex); rows < vertex->count) {
    return ply_rows_missing(source, *vertex, rows);
  }
  const std::size_t count = static_cast<std::size_t>(vertex->count);

  GaussianCloudBuilder builder(columns.degree, source);
  builder.cloud().filter = header.mip ? Filter::mip : Filter::classic;
  builder.reserve(count);
  std::vector<double> block(columns.properties.size() * kBlock);
  for (std::size_t row = 0; row < count; row += kBlock) {
    const std::size_t n = std::min(kBlock, count - row);
    const std::size_t there = body.read(*vertex, columns, n, block.data());
    if (there != n) return ply_rows_missing(source, *vertex, row + there);
    add_block(builder, columns, block.data(), n);
  }

  LoadReport& report = builder.report();
  if (columns.rest_in_file == 72) {
    report.warnings.push_back("SH degree 4 in the file: bands up to degree 3 are read");
  }
  for (auto e = vertex + 1; e != header.elements.end(); ++e) {
    if (const std::uint64_t rows = body.skip(*e); rows != e->count) {
      report.warnings.push_back(ply_rows_missing(source, *e, rows).message());
      return LoadedCloud{std::move(builder.cloud()), std::move(report)};
    }
  }
  body.skip_blanks();
  if (body.left() != 0) {
    report.warnings.push_back(std::to_string(body.left()) + " stray bytes follow the " +
                              std::to_string(count) + " rows that the header promises");
  }
  return LoadedCloud{std::move(builder.cloud()), std::move(report)};
}

}  // namespace

Result<LoadedCloud> parse_ply(std::span<const std::byte> bytes, std::string source) {
  return detail::guarded(source, [&] { return parse(bytes, source); });
}

Result<LoadedCloud> load_ply(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedCloud> {
    auto file = detail::read_file(path);
    if (!file) return file.status();
    return parse(file->span(), path.string());
  });
}

}  // namespace gsnav::io
