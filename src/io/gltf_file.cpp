// SPDX-License-Identifier: Apache-2.0
#include "gltf_file.hpp"

#include <array>
#include <memory>
#include <utility>

#include "zip.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::uint32_t kGlbMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr std::size_t kGlbHeader = 12, kChunkHeader = 8;
constexpr std::int64_t kMostIndex = 0xffffffff;
constexpr std::int64_t kMostBytes = std::int64_t{1} << 50;

/// Decodes base64 text. Returns false if it is malformed.
bool decode_base64(std::string_view text, std::vector<std::byte>& out) {
  std::array<std::int8_t, 256> value;
  value.fill(-1);
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t k = 0; k < kDigits.size(); ++k) {
    value[static_cast<unsigned char>(kDigits[k])] = static_cast<std::int8_t>(k);
  }
  value['-'] = 62;  // the alphabet of URLs
  value['_'] = 63;
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

/// Text with "%20" and the like replaced by the bytes they stand for.
std::string percent_decoded(const std::string& text) {
  const auto hex = [](char c) {
    const int low = c | 32;
    return c >= '0' && c <= '9' ? c - '0' : low >= 'a' && low <= 'f' ? low - 'a' + 10 : -1;
  };
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && hex(text[i + 1]) >= 0 && hex(text[i + 2]) >= 0) {
      out += static_cast<char>(16 * hex(text[i + 1]) + hex(text[i + 2]));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

/// Whether arrays and nodes keep their meaning if this extension is ignored.
bool is_readable_extension(const std::string& name) {
  for (const char* prefix : {"KHR_materials_", "KHR_gaussian_splatting", "KHR_lights_"}) {
    if (name.starts_with(prefix)) return true;
  }
  return name == "KHR_mesh_quantization" || name == "KHR_texture_transform" ||
         name == "EXT_texture_webp" || name == "KHR_xmp_json_ld";
}

}  // namespace

Result<std::size_t> get_index(const Json& object, const char* key, std::size_t absent,
                              const std::string& where) {
  if (member(object, key) == nullptr) return absent;
  const auto index = get_integer(object, key, 0, kMostIndex, where);
  if (!index) return index.status();
  return static_cast<std::size_t>(*index);
}

Result<GltfFile> GltfFile::open(const std::filesystem::path& path, const ReadLimits& limits) {
  auto file = std::make_unique<RandomFile>();
  if (Status s = file->open(path); !s) return s;
  auto out = parse(*file, path.string(), path.parent_path(), limits);
  if (out) out->files_.push_back(std::move(file));
  return out;
}

Result<GltfFile> GltfFile::parse(const ByteSource& bytes, const std::string& source,
                                 const std::filesystem::path& folder, const ReadLimits& limits) {
  GltfFile out;
  out.limits_ = limits;
  out.source_ = source;
  out.folder_ = folder;
  out.size_ = static_cast<std::size_t>(bytes.size());
  ByteSource binary;
  if (Status s = out.read_chunks(bytes, binary); !s) return s;
  if (Status s = out.check_asset(); !s) return s;
  if (Status s = out.read_buffers(binary); !s) return s;
  return out;
}

Status GltfFile::read_chunks(const ByteSource& bytes, ByteSource& binary) {
  std::vector<std::byte> scratch;
  ByteSource text = bytes;
  const std::byte* header = bytes.size() >= kGlbHeader ? bytes.get(0, kGlbHeader, scratch) : nullptr;
  if (header == nullptr && bytes.size() >= kGlbHeader) return reading_failed(source_);
  if (header != nullptr && load_le<std::uint32_t>(header) == kGlbMagic) {
    const std::uint32_t version = load_le<std::uint32_t>(header + 4);
    const std::uint32_t length = load_le<std::uint32_t>(header + 8);
    if (version != 2) {
      return {Errc::unsupported, source_ + ": GLB version " + std::to_string(version) + ", 2 is read"};
    }
    if (length > bytes.size() || length < kGlbHeader) {
      return fail("the header declares " + std::to_string(length) + " bytes, " +
                  std::to_string(bytes.size()) + " are there");
    }
    text = {};
    ByteSource left = bytes.part(kGlbHeader, length - kGlbHeader);
    for (std::size_t chunk = 0; left.size() >= kChunkHeader; ++chunk) {
      const std::byte* p = left.get(0, kChunkHeader, scratch);
      if (p == nullptr) return reading_failed(source_);
      const std::uint32_t size = load_le<std::uint32_t>(p), type = load_le<std::uint32_t>(p + 4);
      const std::uint64_t there = left.size() - kChunkHeader;
      if (size > there) {
        return fail("chunk " + std::to_string(chunk) + " has " + std::to_string(size) + " bytes, " +
                    std::to_string(there) + " are there");
      }
      if (chunk == 0 && type == kJsonChunk) text = left.part(kChunkHeader, size);
      if (chunk == 1 && type == kBinaryChunk) binary = left.part(kChunkHeader, size);
      left = left.part(kChunkHeader + std::uint64_t{size}, there - size);
    }
    if (text.size() == 0) return fail("the first chunk is no JSON");
  }
  const auto size = static_cast<std::size_t>(text.size());
  const std::byte* characters = text.get(0, size, scratch);
  if (characters == nullptr && size != 0) return reading_failed(source_);
  auto json = parse_json({characters, size}, source_, limits_);
  if (!json) return json.status();
  json_ = std::move(*json);
  return {};
}

Status GltfFile::check_asset() const {
  const Json* asset = member(json_, "asset");
  const Json* version = asset == nullptr ? nullptr : member(*asset, "version");
  if (version == nullptr || !version->is_string()) return fail("'asset.version' is missing");
  if (!version->get<std::string>().starts_with("2.")) {
    return {Errc::unsupported, source_ + ": glTF version " + shown(*version) + ", 2 is read"};
  }
  const Json* required = member(json_, "extensionsRequired");
  if (required == nullptr || !required->is_array()) return {};
  for (const Json& name : *required) {
    if (!name.is_string() || !is_readable_extension(name.get<std::string>())) {
      return {Errc::unsupported,
              source_ + ": requires the extension " + shown(name) + ", which is not read"};
    }
  }
  return {};
}

Result<std::filesystem::path> GltfFile::beside(const std::string& uri, const std::string& at) const {
  const std::string name = percent_decoded(uri);
  // A file must not name files outside its own folder.
  if (!is_safe_name(name)) {
    return {Errc::invalid_file, at + ": 'uri' is " + in_quotes(uri) + ": no file beside it or below"};
  }
  return folder_ / name;
}

Result<std::vector<std::byte>> GltfFile::uri_bytes(const std::string& uri, const std::string& at) const {
  std::vector<std::byte> out;
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(";base64,");
    if (comma == std::string::npos || !decode_base64(std::string_view(uri).substr(comma + 8), out)) {
      return {Errc::invalid_file, at + ": its data: URI is no base64"};
    }
    return out;
  }
  const auto path = beside(uri, at);
  if (!path) return path.status();
  const auto file = read_file(*path);
  if (!file) return {file.code(), at + ": " + file.message()};
  out.assign(file->span().begin(), file->span().end());
  return out;
}

Result<ByteSource> GltfFile::external_buffer(const std::string& uri, const std::string& at) {
  if (uri.starts_with("data:")) {
    auto bytes = uri_bytes(uri, at);
    if (!bytes) return bytes.status();
    own_.push_back(std::move(*bytes));
    return ByteSource(std::span<const std::byte>(own_.back()));
  }
  const auto path = beside(uri, at);
  if (!path) return path.status();
  auto file = std::make_unique<RandomFile>();
  if (Status s = file->open(*path); !s) return {s.code(), at + ": " + s.message()};
  files_.push_back(std::move(file));
  size_ += static_cast<std::size_t>(files_.back()->size());
  return ByteSource(*files_.back());
}

Status GltfFile::read_buffers(const ByteSource& binary) {
  for (std::size_t k = 0; k < count("buffers"); ++k) {
    const auto buffer = item("buffers", k);
    if (!buffer) return buffer.status();
    const std::string at = where("buffers", k);
    const auto length = get_integer(**buffer, "byteLength", 0, kMostBytes, at);
    if (!length) return length.status();
    const Json* uri = member(**buffer, "uri");
    ByteSource there = binary;
    if (uri != nullptr || k != 0) {
      if (uri == nullptr || !uri->is_string()) {
        return {Errc::invalid_file, at + ": 'uri' is missing or no text"};
      }
      const auto external = external_buffer(uri->get_ref<const std::string&>(), at);
      if (!external) return external.status();
      there = *external;
    }
    if (static_cast<std::uint64_t>(*length) > there.size()) {
      return {Errc::invalid_file, at + ": 'byteLength' is " + std::to_string(*length) + ", " +
                                      std::to_string(there.size()) + " bytes are there"};
    }
    buffers_.push_back(there.part(0, static_cast<std::uint64_t>(*length)));
  }
  return {};
}

std::size_t GltfFile::count(const char* list) const {
  const Json* items = member(json_, list);
  return items != nullptr && items->is_array() ? items->size() : 0;
}

std::string GltfFile::where(const char* list, std::size_t index) const {
  return source_ + ": " + list + "[" + std::to_string(index) + "]";
}

Result<const Json*> GltfFile::item(const char* list, std::size_t index) const {
  const std::size_t n = count(list);
  if (index >= n || !(*member(json_, list))[index].is_object()) {
    return fail(std::string("'") + list + "' has no object " + std::to_string(index) + " among its " +
                std::to_string(n));
  }
  return &(*member(json_, list))[index];
}

Result<std::size_t> GltfFile::index(const Json& object, const char* key, const char* list,
                                    const std::string& at) const {
  const std::size_t n = count(list);
  if (n == 0) return {Errc::invalid_file, at + ": '" + key + "' is given, but the file has no " + list};
  const auto v = get_integer(object, key, 0, static_cast<std::int64_t>(n) - 1, at);
  if (!v) return v.status();
  return static_cast<std::size_t>(*v);
}

Result<ByteSource> GltfFile::find_view(std::size_t view_index) const {
  const auto json = item("bufferViews", view_index);
  if (!json) return json.status();
  const std::string at = where("bufferViews", view_index);
  const auto buffer = index(**json, "buffer", "buffers", at);
  const auto offset = get_index(**json, "byteOffset", 0, at);
  const auto length = get_integer(**json, "byteLength", 0, kMostBytes, at);
  for (const Status& s : {buffer.status(), offset.status(), length.status()}) {
    if (!s) return s;
  }
  const std::uint64_t there = buffers_[*buffer].size(), size = static_cast<std::uint64_t>(*length);
  if (*offset > there || size > there - *offset) {
    return {Errc::invalid_file, at + ": " + std::to_string(size) + " bytes from " +
                                    std::to_string(*offset) + " on, its buffer has " +
                                    std::to_string(there)};
  }
  return buffers_[*buffer].part(*offset, size);
}

Result<std::span<const std::byte>> GltfFile::view(std::size_t view_index,
                                                  std::vector<std::byte>& scratch) const {
  const auto found = find_view(view_index);
  if (!found) return found.status();
  const auto size = static_cast<std::size_t>(found->size());
  const std::byte* p = found->get(0, size, scratch);
  if (p == nullptr && size != 0) return reading_failed(where("bufferViews", view_index));
  return std::span<const std::byte>(p, size);
}

}  // namespace gsnav::io::detail
