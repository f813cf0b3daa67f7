// SPDX-License-Identifier: Apache-2.0
// Accessors of a glTF: strides, normalised integers, sparse ones.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "gltf_file.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::int64_t kMostCount = 0xffffffff;

std::size_t component_size(std::size_t type) {
  switch (type) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5125:
    case 5126:
      return 4;
    default:
      return 0;
  }
}

std::size_t components_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC2") return 2;
  if (type == "VEC3") return 3;
  if (type == "VEC4") return 4;
  return type == "MAT4" ? 16 : 0;
}

/// Reads n elements of `width` numbers of type T, multiplied by `scale`. If `scale` is not 1, results
/// are at least -1.
template <class T>
void unpack_as(const std::byte* from, std::size_t n, std::size_t stride, std::size_t width, double scale,
               double* out) {
  for (std::size_t i = 0; i < n; ++i, from += stride) {
    for (std::size_t k = 0; k < width; ++k) {
      const double v = static_cast<double>(load_le<T>(from + k * sizeof(T)));
      *out++ = scale == 1 ? v : std::fmax(v / scale, -1.0);
    }
  }
}

}  // namespace

std::size_t GltfValues::extent(std::size_t n) const noexcept {
  return n == 0 ? 0 : (n - 1) * stride_ + components_ * component_size(static_cast<std::size_t>(type_));
}

bool GltfValues::unpack(std::size_t first, std::size_t n, std::vector<std::byte>& scratch,
                        double* out) const {
  const std::byte* p = bytes_.get(std::uint64_t{first} * stride_, extent(n), scratch);
  if (p == nullptr) return n == 0;
  const auto scale = [this](double greatest) { return normalized_ ? greatest : 1.0; };
  switch (type_) {
    case 5120:
      unpack_as<std::int8_t>(p, n, stride_, components_, scale(127), out);
      break;
    case 5121:
      unpack_as<std::uint8_t>(p, n, stride_, components_, scale(255), out);
      break;
    case 5122:
      unpack_as<std::int16_t>(p, n, stride_, components_, scale(32767), out);
      break;
    case 5123:
      unpack_as<std::uint16_t>(p, n, stride_, components_, scale(65535), out);
      break;
    case 5125:
      unpack_as<std::uint32_t>(p, n, stride_, components_, scale(4294967295.0), out);
      break;
    default:
      unpack_as<float>(p, n, stride_, components_, 1.0, out);
  }
  return true;
}

/// Finds the bytes of `values`, whose count, type and components are set, by the "bufferView" and
/// "byteOffset" of `part`: an accessor, or the indices or values of a sparse one.
Status GltfFile::locate(const Json& part, const std::string& where, GltfValues& values) const {
  const auto view_index = index(part, "bufferView", "bufferViews", where);
  const auto offset = get_index(part, "byteOffset", 0, where);
  for (const Status& s : {view_index.status(), offset.status()}) {
    if (!s) return s;
  }
  const auto bytes = find_view(*view_index);
  if (!bytes) return {bytes.code(), where + ": " + bytes.message()};
  const std::size_t element =
      values.components_ * component_size(static_cast<std::size_t>(values.type_));
  const auto stride = get_index(**item("bufferViews", *view_index), "byteStride", element, where);
  if (!stride) return stride.status();
  values.stride_ = *stride;
  const std::uint64_t size = bytes->size();
  if (values.stride_ < element || *offset > size ||
      (values.count_ != 0 &&
       (size - *offset < element || (size - *offset - element) / values.stride_ < values.count_ - 1))) {
    return {Errc::invalid_file, where + ": " + std::to_string(values.count_) + " elements " +
                                    std::to_string(values.stride_) + " bytes apart from " +
                                    std::to_string(*offset) + " on, its buffer view has " +
                                    std::to_string(size) + " bytes"};
  }
  values.bytes_ = bytes->part(*offset, size - *offset);
  return {};
}

Result<GltfValues> GltfFile::values(std::size_t accessor, const std::string& types) const {
  const auto found = item("accessors", accessor);
  if (!found) return found.status();
  const Json& json = **found;
  const std::string at = where("accessors", accessor);
  const auto type = get_index(json, "componentType", 0, at);
  const auto count = get_integer(json, "count", 0, kMostCount, at);
  for (const Status& s : {type.status(), count.status()}) {
    if (!s) return s;
  }
  const Json *shape = member(json, "type"), *sparse = member(json, "sparse");
  const std::string name = shape != nullptr && shape->is_string() ? shape->get<std::string>() : "";
  GltfValues out;
  out.components_ = components_of(name);
  if (out.components_ == 0 || (" " + types + " ").find(" " + name + " ") == std::string::npos) {
    return {Errc::invalid_file, at + " is of type " + in_quotes(name) + ", must be " + types};
  }
  if (component_size(*type) == 0) {
    return {Errc::invalid_file, at + ": 'componentType' is " + std::to_string(*type) +
                                    ", must be 5120 to 5126 without 5124"};
  }
  out.count_ = static_cast<std::size_t>(*count);
  out.type_ = static_cast<int>(*type);
  const Json* normalized = member(json, "normalized");
  out.normalized_ = normalized != nullptr && *normalized == true;
  if (member(json, "bufferView") != nullptr) {
    if (Status s = locate(json, at, out); !s) return s;
  } else if (sparse == nullptr || out.count_ > size_) {
    // The file holds no data for such zeros, so there could be any number of them.
    return {Errc::unsupported, at + ": without a buffer view: not read"};
  }
  if (sparse != nullptr) {
    if (Status s = apply_sparse(*sparse, at + ": sparse", out); !s) return s;
  }
  return out;
}

/// Copies the elements (zeros if there are none) and overwrites those that `sparse` lists.
Status GltfFile::apply_sparse(const Json& sparse, const std::string& where, GltfValues& values) const {
  const auto count = get_integer(sparse, "count", 0, static_cast<std::int64_t>(values.count_), where);
  if (!count) return count.status();
  const Json *rows = member(sparse, "indices"), *replaced = member(sparse, "values");
  if (rows == nullptr || replaced == nullptr) {
    return {Errc::invalid_file, where + " lacks indices or values"};
  }
  GltfValues at, to = values;
  at.count_ = to.count_ = static_cast<std::size_t>(*count);
  const auto type = get_integer(*rows, "componentType", 5121, 5125, where);
  if (!type) return type.status();
  at.type_ = static_cast<int>(*type);
  if (at.type_ % 2 == 0) {
    return {Errc::invalid_file,
            where + ": 'componentType' is " + std::to_string(at.type_) + ", must be 5121, 5123 or 5125"};
  }
  if (Status s = locate(*rows, where, at); !s) return s;
  if (Status s = locate(*replaced, where, to); !s) return s;
  const std::size_t element = values.extent(1), replaced_bytes = to.extent(to.count_);
  auto own = std::make_shared<std::vector<std::byte>>(element * values.count_);
  std::vector<std::byte> scratch;
  if (values.bytes_.size() != 0) {
    const std::byte* from = values.bytes_.get(0, values.extent(values.count_), scratch);
    if (from == nullptr) return reading_failed(where);
    for (std::size_t i = 0; i < values.count_; ++i) {
      std::copy_n(from + i * values.stride_, element, own->data() + i * element);
    }
  }
  std::vector<double> places(at.count_);
  if (!at.unpack(0, at.count_, scratch, places.data())) return reading_failed(where);
  const std::byte* from = to.bytes_.get(0, replaced_bytes, scratch);
  if (from == nullptr && replaced_bytes != 0) return reading_failed(where);
  for (std::size_t i = 0; i < at.count_; ++i) {
    const auto row = static_cast<std::size_t>(places[i]);
    if (row >= values.count_) {
      return {Errc::invalid_file,
              where + ": index " + std::to_string(row) + " of " + std::to_string(values.count_)};
    }
    std::copy_n(from + i * to.stride_, element, own->data() + row * element);
  }
  values.bytes_ = ByteSource(std::span<const std::byte>(*own));
  values.stride_ = element;
  values.own_ = std::move(own);
  return {};
}

Result<GltfNumbers> GltfFile::numbers(std::size_t accessor, const std::string& types) const {
  const auto held = values(accessor, types);
  if (!held) return held.status();
  GltfNumbers out;
  out.count = held->size();
  if (out.count == 0)
    return Status(Errc::invalid_file, where("accessors", accessor) + " has no elements");
  out.width = held->components();
  out.values.resize(out.count * out.width);
  std::vector<std::byte> scratch;
  if (!held->unpack(0, out.count, scratch, out.values.data()))
    return reading_failed(where("accessors", accessor));
  for (std::size_t i = 0; i < out.values.size(); ++i) {
    if (!std::isfinite(out.values[i])) {
      return {Errc::invalid_file, where("accessors", accessor) + ": element " +
                                      std::to_string(i / out.width) + " is " +
                                      std::to_string(out.values[i])};
    }
  }
  return out;
}

Result<std::vector<std::uint32_t>> GltfFile::indices(std::size_t accessor) const {
  const auto held = values(accessor, "SCALAR");
  if (!held) return held.status();
  if (held->type_ != 5121 && held->type_ != 5123 && held->type_ != 5125) {
    return Status(Errc::invalid_file, where("accessors", accessor) + ": 'componentType' is " +
                                          std::to_string(held->type_) + ": no indices");
  }
  std::vector<std::uint32_t> out;
  out.reserve(held->size());
  std::vector<std::byte> scratch;
  std::array<double, 1024> block;
  for (std::size_t first = 0; first < held->size(); first += block.size()) {
    const std::size_t n = std::min(block.size(), held->size() - first);
    if (!held->unpack(first, n, scratch, block.data()))
      return reading_failed(where("accessors", accessor));
    for (std::size_t i = 0; i < n; ++i) out.push_back(static_cast<std::uint32_t>(block[i]));
  }
  return out;
}

}  // namespace gsnav::io::detail
