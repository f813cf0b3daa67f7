// SPDX-License-Identifier: Apache-2.0
// Accessors of a glTF: strides, normalised integers, sparse ones.
#include <algorithm>
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

double component(const std::byte* p, int type, bool normalized) {
  switch (type) {
    case 5120:
      return normalized ? std::fmax(load_le<std::int8_t>(p) / 127.0, -1.0) : load_le<std::int8_t>(p);
    case 5121:
      return load_le<std::uint8_t>(p) / (normalized ? 255.0 : 1.0);
    case 5122:
      return normalized ? std::fmax(load_le<std::int16_t>(p) / 32767.0, -1.0) : load_le<std::int16_t>(p);
    case 5123:
      return load_le<std::uint16_t>(p) / (normalized ? 65535.0 : 1.0);
    case 5125:
      return load_le<std::uint32_t>(p) / (normalized ? 4294967295.0 : 1.0);
    default:
      return static_cast<double>(load_le<float>(p));
  }
}

}  // namespace

double GltfValues::at(std::size_t i, std::size_t k) const noexcept {
  return component(data_ + i * stride_ + k * component_size(static_cast<std::size_t>(type_)), type_,
                   normalized_);
}

/// Finds the bytes of `values`, whose count, type and components are there, by the "bufferView" and
/// "byteOffset" of `part`: an accessor, or the indices or values of a sparse one.
Status GltfFile::locate(const Json& part, const std::string& where, GltfValues& values) const {
  const auto view_index = index(part, "bufferView", "bufferViews", where);
  const auto offset = get_index(part, "byteOffset", 0, where);
  for (const Status& s : {view_index.status(), offset.status()}) {
    if (!s) return s;
  }
  const auto bytes = view(*view_index);
  if (!bytes) return {bytes.code(), where + ": " + bytes.message()};
  const std::size_t element =
      values.components_ * component_size(static_cast<std::size_t>(values.type_));
  const auto stride = get_index(**item("bufferViews", *view_index), "byteStride", element, where);
  if (!stride) return stride.status();
  values.stride_ = *stride;
  const std::size_t size = bytes->size();
  if (values.stride_ < element || *offset > size ||
      (values.count_ != 0 &&
       (size - *offset < element || (size - *offset - element) / values.stride_ < values.count_ - 1))) {
    return {Errc::invalid_file, where + ": " + std::to_string(values.count_) + " elements " +
                                    std::to_string(values.stride_) + " bytes apart from " +
                                    std::to_string(*offset) + " on, its buffer view has " +
                                    std::to_string(size) + " bytes"};
  }
  values.data_ = bytes->data() + *offset;
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
    // Zeros that nothing in the file stands for could be any number.
    return {Errc::unsupported, at + ": without a buffer view: not read"};
  }
  if (sparse != nullptr) {
    if (Status s = apply_sparse(*sparse, at + ": sparse", out); !s) return s;
  }
  return out;
}

/// Copies the elements, zeros where there are none, and puts those of `sparse` over them.
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
  const std::size_t element =
      values.components_ * component_size(static_cast<std::size_t>(values.type_));
  auto own = std::make_shared<std::vector<std::byte>>(element * values.count_);
  for (std::size_t i = 0; values.data_ != nullptr && i < values.count_; ++i) {
    std::copy_n(values.data_ + i * values.stride_, element, own->data() + i * element);
  }
  for (std::size_t i = 0; i < at.count_; ++i) {
    const double row = at.at(i, 0);
    if (!(row < static_cast<double>(values.count_))) {
      return {Errc::invalid_file, where + ": index " + std::to_string(static_cast<std::uint64_t>(row)) +
                                      " of " + std::to_string(values.count_)};
    }
    std::copy_n(to.data_ + i * to.stride_, element,
                own->data() + static_cast<std::size_t>(row) * element);
  }
  values.data_ = own->data();
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
  for (std::size_t i = 0; i < out.values.size(); ++i) {
    const double v = held->at(i / out.width, i % out.width);
    if (!std::isfinite(v)) {
      return {Errc::invalid_file, where("accessors", accessor) + ": element " +
                                      std::to_string(i / out.width) + " is " + std::to_string(v)};
    }
    out.values[i] = v;
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
  for (std::size_t i = 0; i < held->size(); ++i)
    out.push_back(static_cast<std::uint32_t>(held->at(i, 0)));
  return out;
}

}  // namespace gsnav::io::detail
