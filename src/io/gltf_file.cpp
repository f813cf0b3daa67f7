// SPDX-License-Identifier: Apache-2.0
#include "gltf_file.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "zip.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::uint32_t kGlbMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr std::size_t kGlbHeader = 12, kChunkHeader = 8;
constexpr std::int64_t kMostIndex = 0xffffffff;
constexpr std::int64_t kMostBytes = std::int64_t{1} << 50;

std::size_t component_size(int type) {
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
      return load_le<std::uint32_t>(p);
    default:
      return static_cast<double>(load_le<float>(p));
  }
}

/// The bytes of base64 text; false where it is none.
bool decode_base64(std::string_view text, std::vector<std::byte>& out) {
  std::array<std::int8_t, 256> value;
  value.fill(-1);
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t k = 0; k < kDigits.size(); ++k) {
    value[static_cast<unsigned char>(kDigits[k])] = static_cast<std::int8_t>(k);
  }
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  out.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    const int digit = value[static_cast<unsigned char>(c)];
    if (digit < 0) return false;
    bits = (bits << 6 | static_cast<std::uint32_t>(digit)) & 0xffffff;
    held += 6;
    if (held < 8) continue;
    held -= 8;
    out.push_back(static_cast<std::byte>(bits >> held & 255));
  }
  return true;
}

}  // namespace

Result<std::size_t> get_index(const Json& object, const char* key, std::size_t absent,
                              const std::string& where) {
  if (member(object, key) == nullptr) return absent;
  const auto index = get_integer(object, key, 0, kMostIndex, where);
  if (!index) return index.status();
  return static_cast<std::size_t>(*index);
}

Result<GltfFile> GltfFile::open(const std::filesystem::path& path) {
  auto bytes = read_file(path);
  if (!bytes) return bytes.status();
  auto out = parse(bytes->span(), path.string(), path.parent_path());
  if (out) out->file_ = std::move(*bytes);
  return out;
}

Result<GltfFile> GltfFile::parse(std::span<const std::byte> bytes, const std::string& source,
                                 const std::filesystem::path& folder) {
  GltfFile out;
  out.source_ = source;
  out.size_ = bytes.size();
  std::span<const std::byte> binary;
  if (Status s = out.read_chunks(bytes, binary); !s) return s;
  const Json* asset = member(out.json_, "asset");
  const Json* version = asset == nullptr ? nullptr : member(*asset, "version");
  if (version == nullptr || !version->is_string()) return out.fail("'asset.version' is missing");
  if (!version->get<std::string>().starts_with("2.")) {
    return {Errc::unsupported, source + ": glTF version " + shown(*version) + ", 2 is read"};
  }
  if (Status s = out.read_buffers(binary, folder); !s) return s;
  return out;
}

Status GltfFile::read_chunks(std::span<const std::byte> bytes, std::span<const std::byte>& binary) {
  std::span<const std::byte> text = bytes;
  if (bytes.size() >= kGlbHeader && load_le<std::uint32_t>(bytes.data()) == kGlbMagic) {
    const std::uint32_t version = load_le<std::uint32_t>(bytes.data() + 4);
    const std::uint32_t length = load_le<std::uint32_t>(bytes.data() + 8);
    if (version != 2) {
      return {Errc::unsupported, source_ + ": GLB version " + std::to_string(version) + ", 2 is read"};
    }
    if (length > bytes.size() || length < kGlbHeader) {
      return fail("the header promises " + std::to_string(length) + " bytes, " +
                  std::to_string(bytes.size()) + " are there");
    }
    text = {};
    std::span<const std::byte> left = bytes.subspan(kGlbHeader, length - kGlbHeader);
    for (std::size_t chunk = 0; left.size() >= kChunkHeader; ++chunk) {
      const std::size_t size = load_le<std::uint32_t>(left.data());
      const std::uint32_t type = load_le<std::uint32_t>(left.data() + 4);
      if (size > left.size() - kChunkHeader) {
        return fail("chunk " + std::to_string(chunk) + " has " + std::to_string(size) + " bytes, " +
                    std::to_string(left.size() - kChunkHeader) + " are there");
      }
      const auto content = left.subspan(kChunkHeader, size);
      if (chunk == 0 && type == kJsonChunk) text = content;
      if (chunk == 1 && type == kBinaryChunk) binary = content;
      left = left.subspan(kChunkHeader + size);
    }
    if (text.empty()) return fail("the first chunk is no JSON");
  }
  auto json = parse_json(text, source_);
  if (!json) return json.status();
  json_ = std::move(*json);
  return {};
}

Status GltfFile::read_buffers(std::span<const std::byte> binary, const std::filesystem::path& folder) {
  const Json* list = member(json_, "buffers");
  if (list == nullptr) return {};
  if (!list->is_array()) return fail("'buffers' is " + shown(*list));
  for (std::size_t k = 0; k < list->size(); ++k) {
    const std::string where = source_ + ": buffer " + std::to_string(k);
    const auto length = get_integer((*list)[k], "byteLength", 0, kMostBytes, where);
    if (!length) return length.status();
    const Json* uri = member((*list)[k], "uri");
    std::span<const std::byte> there = binary;
    if (uri != nullptr || k != 0) {
      if (uri == nullptr || !uri->is_string()) {
        return {Errc::invalid_file, where + ": 'uri' is missing or no text"};
      }
      const std::string& text = uri->get_ref<const std::string&>();
      own_.emplace_back();
      if (text.starts_with("data:")) {
        const std::size_t comma = text.find(";base64,");
        if (comma == std::string::npos ||
            !decode_base64(std::string_view(text).substr(comma + 8), own_.back())) {
          return {Errc::invalid_file, where + ": its data: URI is no base64"};
        }
      } else {
        if (!is_safe_name(text)) {
          return {Errc::invalid_file,
                  where + ": 'uri' is " + shown(*uri) + ", must be a file below this folder"};
        }
        const auto file = read_file(folder / text);
        if (!file) return file.status();
        own_.back().assign(file->span().begin(), file->span().end());
        size_ += file->size;
      }
      there = own_.back();
    }
    if (static_cast<std::uint64_t>(*length) > there.size()) {
      return {Errc::invalid_file, where + ": 'byteLength' is " + std::to_string(*length) + ", " +
                                      std::to_string(there.size()) + " bytes are there"};
    }
    buffers_.push_back(there.first(static_cast<std::size_t>(*length)));
  }
  return {};
}

Result<const Json*> GltfFile::item(const char* list, std::size_t index) const {
  const Json* items = member(json_, list);
  const std::size_t n = items != nullptr && items->is_array() ? items->size() : 0;
  if (index >= n || !(*items)[index].is_object()) {
    return fail(std::string("'") + list + "' has no object " + std::to_string(index) + " among its " +
                std::to_string(n));
  }
  return &(*items)[index];
}

Result<std::span<const std::byte>> GltfFile::view(std::size_t index) const {
  const auto json = item("bufferViews", index);
  if (!json) return json.status();
  const std::string where = source_ + ": buffer view " + std::to_string(index);
  const auto buffer = get_index(**json, "buffer", kNoIndex, where);
  const auto offset = get_index(**json, "byteOffset", 0, where);
  const auto length = get_integer(**json, "byteLength", 0, kMostBytes, where);
  for (const Status& s : {buffer.status(), offset.status(), length.status()}) {
    if (!s) return s;
  }
  const std::size_t there = *buffer < buffers_.size() ? buffers_[*buffer].size() : 0;
  const auto size = static_cast<std::size_t>(*length);
  if (*buffer >= buffers_.size() || *offset > there || size > there - *offset) {
    return {Errc::invalid_file, where + ": " + std::to_string(size) + " bytes from " +
                                    std::to_string(*offset) + " on, its buffer has " +
                                    std::to_string(there)};
  }
  return buffers_[*buffer].subspan(*offset, size);
}

Result<GltfValues> GltfFile::accessor(std::size_t index) const {
  const auto found = item("accessors", index);
  if (!found) return found.status();
  const Json& json = **found;
  const std::string where = source_ + ": accessor " + std::to_string(index);
  const auto view_index = get_index(json, "bufferView", kNoIndex, where);
  const auto offset = get_index(json, "byteOffset", 0, where);
  const auto type = get_index(json, "componentType", 0, where);
  const auto count = get_integer(json, "count", 0, kMostIndex, where);
  for (const Status& s : {view_index.status(), offset.status(), type.status(), count.status()}) {
    if (!s) return s;
  }
  if (member(json, "sparse") != nullptr || *view_index == kNoIndex) {
    return {Errc::unsupported, where + ": sparse, or without a buffer view: not read"};
  }
  GltfValues a;
  a.count_ = static_cast<std::size_t>(*count);
  a.type_ = static_cast<int>(*type);
  const Json* normalized = member(json, "normalized");
  a.normalized_ = normalized != nullptr && *normalized == true;
  const Json* shape = member(json, "type");
  const std::string name = shape != nullptr && shape->is_string() ? shape->get<std::string>() : "";
  a.components_ = name == "SCALAR" ? 1
                  : name == "VEC2" ? 2
                  : name == "VEC3" ? 3
                  : name == "VEC4" ? 4
                                   : 0;
  const std::size_t element = a.components_ * component_size(a.type_);
  if (element == 0) {
    return {Errc::invalid_file, where + ": type " + in_quotes(name) + " of component type " +
                                    std::to_string(a.type_) + " is not read"};
  }
  const auto bytes = view(*view_index);
  if (!bytes) return bytes.status();
  const auto stride = get_index(**item("bufferViews", *view_index), "byteStride", element, where);
  if (!stride) return stride.status();
  a.stride_ = *stride;
  const std::size_t size = bytes->size();
  if (a.stride_ < element || *offset > size ||
      (a.count_ != 0 &&
       (size - *offset < element || (size - *offset - element) / a.stride_ < a.count_ - 1))) {
    return {Errc::invalid_file, where + ": " + std::to_string(a.count_) + " elements " +
                                    std::to_string(a.stride_) + " bytes apart from " +
                                    std::to_string(*offset) + " on, its buffer view has " +
                                    std::to_string(size) + " bytes"};
  }
  a.data_ = bytes->data() + *offset;
  return a;
}

double GltfValues::at(std::size_t i, std::size_t k) const noexcept {
  return component(data_ + i * stride_ + k * component_size(type_), type_, normalized_);
}

Result<GltfValues> GltfFile::values(std::size_t index, std::size_t components) const {
  const auto a = accessor(index);
  if (a && a->components_ != components) {
    return fail("accessor " + std::to_string(index) + " has " + std::to_string(a->components_) +
                " components, must be " + std::to_string(components));
  }
  return a;
}

Result<std::vector<std::uint32_t>> GltfFile::indices(std::size_t index) const {
  const auto a = accessor(index);
  if (!a) return a.status();
  if (a->components_ != 1 || (a->type_ != 5121 && a->type_ != 5123 && a->type_ != 5125)) {
    return fail("accessor " + std::to_string(index) + " holds no indices");
  }
  std::vector<std::uint32_t> out;
  out.reserve(a->count_);
  for (std::size_t i = 0; i < a->count_; ++i) {
    out.push_back(static_cast<std::uint32_t>(component(a->data_ + i * a->stride_, a->type_, false)));
  }
  return out;
}

}  // namespace gsnav::io::detail
