// SPDX-License-Identifier: Apache-2.0
#include "ply_body.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <string_view>

#include "file.hpp"

namespace gsnav::io::detail {
namespace {

template <class T>
void unpack(const std::byte* rows, std::size_t n, std::size_t stride, bool swap, double* out) {
  for (std::size_t i = 0; i < n; ++i) {
    std::byte raw[sizeof(T)];
    std::memcpy(raw, rows + i * stride, sizeof(T));
    if (swap) std::reverse(raw, raw + sizeof(T));
    out[i] = static_cast<double>(load_le<T>(raw));
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

bool is_blank(std::byte b) noexcept {
  return b == std::byte{' '} || b == std::byte{'\t'} || b == std::byte{'\r'} || b == std::byte{'\n'};
}

}  // namespace

std::uint64_t PlyBody::skip(const PlyElement& e) {
  if (e.properties.empty()) return e.count;
  if (format_ == PlyFormat::ascii) return skip_text(e);
  if (!e.has_list) {
    const std::uint64_t rows = std::min<std::uint64_t>(e.count, left() / e.stride);
    at_ += static_cast<std::size_t>(rows) * e.stride;
    return rows;
  }
  // A list takes at least one byte, so the file's size bounds this loop whatever the count is.
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

std::uint64_t PlyBody::available(const PlyElement& e) const noexcept {
  // A number in text takes a digit and a separator; the last may lack the separator.
  const std::size_t row = format_ == PlyFormat::ascii ? 2 * e.properties.size() : e.stride;
  return (left() + (format_ == PlyFormat::ascii ? 1 : 0)) / row;
}

void unpack_ply_rows(PlyFormat format, const PlyElement& e,
                     std::span<const PlyProperty* const> properties, const std::byte* rows,
                     std::size_t n, double* block) {
  for (std::size_t c = 0; c < properties.size(); ++c) {
    const PlyProperty& p = *properties[c];
    unpack(p.type, rows + p.offset, n, e.stride, format == PlyFormat::big, block + c * kPlyBlock);
  }
}

std::size_t PlyBody::read(const PlyElement& e, std::span<const PlyProperty* const> properties,
                          std::size_t n, double* block) {
  if (format_ == PlyFormat::ascii) return read_text(e, properties, n, block);
  unpack_ply_rows(format_, e, properties, here(), n, block);
  at_ += n * e.stride;
  return n;
}

bool PlyBody::next_value(PlyType type, double& value) {
  if (format_ == PlyFormat::ascii) return next_number(value);
  if (left() < size_of(type)) return false;
  unpack(type, bytes_.data() + at_, 1, 0, format_ == PlyFormat::big, &value);
  at_ += size_of(type);
  return true;
}

bool PlyBody::read_list(const PlyElement& e, const PlyProperty& list, std::vector<double>& items) {
  items.clear();
  for (const PlyProperty& p : e.properties) {
    double length = 1;
    if (p.is_list && !(next_value(p.count_type, length) && length >= 0)) return false;
    // An item takes at least one byte, so the file's size bounds this loop whatever the length is.
    for (double k = 0; k < length; ++k) {
      double value = 0;
      if (!next_value(p.type, value)) return false;
      if (&p == &list) items.push_back(value);
    }
  }
  return true;
}

void PlyBody::skip_blanks() {
  while (format_ == PlyFormat::ascii && at_ < bytes_.size() && is_blank(bytes_[at_])) ++at_;
}

bool PlyBody::next_number(double& value) {
  skip_blanks();
  const std::size_t from = at_;
  while (at_ < bytes_.size() && !is_blank(bytes_[at_])) ++at_;
  const char* first = reinterpret_cast<const char*>(bytes_.data()) + from;
  const char* last = reinterpret_cast<const char*>(bytes_.data()) + at_;
  if (first != last && *first == '+') ++first;
  const auto [end, error] = std::from_chars(first, last, value);
  if (error == std::errc::result_out_of_range) {
    // from_chars does not tell on which side of the range the value is.
    const bool tiny = std::string_view(first, last).find("e-") != std::string_view::npos ||
                      std::string_view(first, last).find("E-") != std::string_view::npos;
    value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
    return end == last;
  }
  return error == std::errc{} && end == last;
}

std::uint64_t PlyBody::skip_text(const PlyElement& e) {
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

std::size_t PlyBody::read_text(const PlyElement& e, std::span<const PlyProperty* const> properties,
                               std::size_t n, double* block) {
  std::vector<double> row(e.properties.size());
  for (std::size_t i = 0; i < n; ++i) {
    for (double& value : row) {
      if (!next_number(value)) return i;
    }
    for (std::size_t c = 0; c < properties.size(); ++c) {
      block[c * kPlyBlock + i] = row[static_cast<std::size_t>(properties[c] - e.properties.data())];
    }
  }
  return n;
}

}  // namespace gsnav::io::detail
