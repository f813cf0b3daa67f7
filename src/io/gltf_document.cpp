// SPDX-License-Identifier: Apache-2.0
#include "gltf_document.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "file.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav::io::detail {
namespace {

constexpr std::uint32_t kGlbMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinChunk = 0x004e4942;

struct Component {
  int type;
  std::size_t bytes;
  double greatest;  // of a normalised integer; 0: float
};
constexpr Component kComponents[] = {{5120, 1, 127},   {5121, 1, 255},          {5122, 2, 32767},
                                     {5123, 2, 65535}, {5125, 4, 4294967295.0}, {5126, 4, 0}};

const Component* component_of(std::int64_t type) {
  for (const Component& c : kComponents) {
    if (c.type == type) return &c;
  }
  return nullptr;
}

double number_at(const std::byte* p, int type) {
  switch (type) {
    case 5120:
      return load_le<std::int8_t>(p);
    case 5121:
      return load_le<std::uint8_t>(p);
    case 5122:
      return load_le<std::int16_t>(p);
    case 5123:
      return load_le<std::uint16_t>(p);
    case 5125:
      return load_le<std::uint32_t>(p);
    default:
      return static_cast<double>(load_le<float>(p));
  }
}

std::size_t width_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC2") return 2;
  if (type == "VEC3") return 3;
  if (type == "VEC4") return 4;
  return type == "MAT4" ? 16 : 0;
}

bool decode_base64(std::string_view text, std::vector<std::byte>& out) {
  std::uint32_t bits = 0;
  int have = 0;
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  out.reserve(text.size() / 4 * 3 + 3);
  for (const char c : text) {
    std::uint32_t v = 0;
    if (c >= 'A' && c <= 'Z')
      v = static_cast<std::uint32_t>(c - 'A');
    else if (c >= 'a' && c <= 'z')
      v = static_cast<std::uint32_t>(c - 'a') + 26;
    else if (c >= '0' && c <= '9')
      v = static_cast<std::uint32_t>(c - '0') + 52;
    else if (c == '+' || c == '-')
      v = 62;
    else if (c == '/' || c == '_')
      v = 63;
    else
      return false;
    bits = bits << 6 | v;
    have += 6;
    if (have >= 8) {
      have -= 8;
      out.push_back(static_cast<std::byte>(bits >> have & 0xff));
    }
  }
  return true;
}

}  // namespace

std::string GltfDocument::where(const char* name, std::size_t index) const {
  return source_ + ": " + name + "[" + std::to_string(index) + "]";
}

std::size_t GltfDocument::count(const char* name) const {
  const Json* array = member(json_, name);
  return array != nullptr && array->is_array() ? array->size() : 0;
}

Result<const Json*> GltfDocument::entry(const char* name, std::size_t index) const {
  if (index >= count(name)) {
    return {Errc::invalid_file, source_ + ": there is no " + name + "[" + std::to_string(index) + "]"};
  }
  const Json& e = (*member(json_, name))[index];
  if (!e.is_object()) return {Errc::invalid_file, where(name, index) + " is " + shown(e) + ", must be an object"};
  return &e;
}

Result<std::size_t> GltfDocument::index(const Json& object, const char* key, const char* array,
                                        const std::string& at) const {
  if (count(array) == 0) return {Errc::invalid_file, at + ": '" + key + "' names one of no " + array};
  const auto v = get_integer(object, key, 0, static_cast<std::int64_t>(count(array)) - 1, at);
  if (!v) return v.status();
  return static_cast<std::size_t>(*v);
}

Result<GltfDocument> GltfDocument::open(const std::filesystem::path& path) {
  GltfDocument out;
  out.source_ = path.string();
  out.folder_ = path.parent_path();
  const auto bad = [&](const std::string& what) { return Status(Errc::invalid_file, out.source_ + ": " + what); };
  const auto file = read_file(path);
  if (!file) return file.status();
  std::span<const std::byte> text = file->span();
  if (text.size() >= 12 && load_le<std::uint32_t>(text.data()) == kGlbMagic) {
    const std::uint32_t version = load_le<std::uint32_t>(text.data() + 4);
    if (version != 2)
      return {Errc::unsupported, out.source_ + ": GLB version " + std::to_string(version) + "; 2 is read"};
    std::span<const std::byte> rest = text.subspan(12);
    text = {};
    while (rest.size() >= 8) {
      const std::uint32_t length = load_le<std::uint32_t>(rest.data()), kind = load_le<std::uint32_t>(rest.data() + 4);
      if (length > rest.size() - 8) {
        return bad("a chunk of " + std::to_string(length) + " bytes with " + std::to_string(rest.size() - 8) + " left");
      }
      const std::span<const std::byte> chunk = rest.subspan(8, length);
      if (kind == kJsonChunk && text.empty()) text = chunk;
      if (kind == kBinChunk && out.binary_.empty()) out.binary_.assign(chunk.begin(), chunk.end());
      rest = rest.subspan(8 + length);
    }
    if (text.empty()) return bad("no JSON chunk");
  }
  auto json = parse_json(text, out.source_);
  if (!json) return json.status();
  out.json_ = std::move(*json);
  const Json* asset = member(out.json_, "asset");
  const Json* version = asset == nullptr ? nullptr : member(*asset, "version");
  if (version == nullptr || !version->is_string()) return bad("no asset.version: not a glTF file");
  if (version->get<std::string>().substr(0, 2) != "2.") {
    return {Errc::unsupported, out.source_ + ": glTF version " + shown(*version) + "; 2.0 is read"};
  }
  if (const Json* needed = member(out.json_, "extensionsRequired"); needed != nullptr && needed->is_array()) {
    for (const Json& name : *needed) {
      const std::string n = name.is_string() ? name.get<std::string>() : std::string();
      if (n.rfind("KHR_materials_", 0) != 0 && n != "KHR_mesh_quantization") {
        return {Errc::unsupported, out.source_ + ": requires the extension " + shown(name)};
      }
    }
  }
  return out;
}

Result<std::vector<std::byte>> GltfDocument::uri_bytes(const std::string& uri, const std::string& at) const {
  std::vector<std::byte> out;
  if (uri.rfind("data:", 0) == 0) {
    const std::size_t comma = uri.find(";base64,");
    if (comma == uri.npos || !decode_base64(std::string_view(uri).substr(comma + 8), out)) {
      return {Errc::invalid_file, at + ": a data URI that is not base64"};
    }
    return out;
  }
  std::string name;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const auto hex = [](char c) {
      return c >= '0' && c <= '9' ? c - '0' : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1;
    };
    if (uri[i] == '%' && i + 2 < uri.size() && hex(uri[i + 1]) >= 0 && hex(uri[i + 2]) >= 0) {
      name += static_cast<char>(16 * hex(uri[i + 1]) + hex(uri[i + 2]));
      i += 2;
    } else {
      name += uri[i];
    }
  }
  const std::filesystem::path relative(name);
  // A file must not name others outside its own folder.
  if (relative.is_absolute() || name.find("..") != name.npos || name.find(':') != name.npos) {
    return {Errc::unsupported, at + ": " + in_quotes(uri) + " is no file beside it"};
  }
  const auto file = read_file(folder_ / relative);
  if (!file) return {file.code(), at + ": " + file.message()};
  out.assign(file->span().begin(), file->span().end());
  return out;
}

Result<std::span<const std::byte>> GltfDocument::buffer(std::size_t index) {
  const auto e = entry("buffers", index);
  if (!e) return e.status();
  const std::string at = where("buffers", index);
  const Json* uri = member(**e, "uri");
  if (uri == nullptr) {
    if (index != 0 || binary_.empty()) return {Errc::invalid_file, at + " has neither a uri nor a binary chunk"};
    return std::span<const std::byte>(binary_);
  }
  if (!uri->is_string()) return {Errc::invalid_file, at + ": 'uri' is " + shown(*uri)};
  if (const auto have = buffers_.find(index); have != buffers_.end()) return std::span<const std::byte>(have->second);
  auto bytes = uri_bytes(uri->get<std::string>(), at);
  if (!bytes) return bytes.status();
  return std::span<const std::byte>(buffers_[index] = std::move(*bytes));
}

Result<std::span<const std::byte>> GltfDocument::view(std::size_t index) {
  const auto e = entry("bufferViews", index);
  if (!e) return e.status();
  const std::string at = where("bufferViews", index);
  const auto which = this->index(**e, "buffer", "buffers", at);
  if (!which) return which.status();
  const auto bytes = buffer(*which);
  if (!bytes) return bytes;
  constexpr std::int64_t most = std::int64_t{1} << 40;
  const auto length = get_integer(**e, "byteLength", 0, most, at);
  if (!length) return length.status();
  std::size_t offset = 0;
  if (member(**e, "byteOffset") != nullptr) {
    const auto o = get_integer(**e, "byteOffset", 0, most, at);
    if (!o) return o.status();
    offset = static_cast<std::size_t>(*o);
  }
  if (offset > bytes->size() || static_cast<std::size_t>(*length) > bytes->size() - offset) {
    return {Errc::invalid_file, at + " ends behind its buffer of " + std::to_string(bytes->size()) + " bytes"};
  }
  return bytes->subspan(offset, static_cast<std::size_t>(*length));
}

Status GltfDocument::fill(const Json& accessor, std::size_t view_index, std::size_t offset, int type, std::size_t width,
                          std::size_t count, bool normalized, const std::string& at, double* out) {
  const Component& c = *component_of(type);
  const auto bytes = view(view_index);
  if (!bytes) return {bytes.code(), at + ": " + bytes.message()};
  std::size_t stride = c.bytes * width;
  if (const Json* e = *entry("bufferViews", view_index); &accessor != e && member(*e, "byteStride") != nullptr) {
    const auto s =
        get_integer(*e, "byteStride", static_cast<std::int64_t>(stride), 252, where("bufferViews", view_index));
    if (!s) return s.status();
    stride = static_cast<std::size_t>(*s);
  }
  if (count == 0) return {};
  if (offset > bytes->size() || stride * (count - 1) + c.bytes * width > bytes->size() - offset) {
    return {Errc::invalid_file, at + ": " + std::to_string(count) + " elements end behind their buffer view of " +
                                    std::to_string(bytes->size()) + " bytes"};
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::byte* p = bytes->data() + offset + i * stride;
    for (std::size_t k = 0; k < width; ++k) {
      double v = number_at(p + k * c.bytes, type);
      if (!std::isfinite(v))
        return {Errc::invalid_file, at + ": element " + std::to_string(i) + " is " + std::to_string(v)};
      if (normalized && c.greatest > 0) v = std::max(v / c.greatest, -1.0);
      *out++ = v;
    }
  }
  return {};
}

Status GltfDocument::fill_sparse(const Json& sparse, int type, bool normalized, const std::string& at,
                                 GltfNumbers& out) {
  const std::string here = at + ": sparse";
  const auto many = get_integer(sparse, "count", 0, static_cast<std::int64_t>(out.count), here);
  if (!many) return many.status();
  const Json *indices = member(sparse, "indices"), *values = member(sparse, "values");
  if (indices == nullptr || values == nullptr) return {Errc::invalid_file, here + " lacks indices or values"};
  const std::size_t n = static_cast<std::size_t>(*many);
  std::vector<double> rows(n), data(n * out.width);
  const auto part = [&](const Json& object, std::size_t width, double* to, int kind, bool scaled) -> Status {
    const auto v = index(object, "bufferView", "bufferViews", here);
    if (!v) return v.status();
    std::int64_t offset = 0;
    if (member(object, "byteOffset") != nullptr) {
      const auto o = get_integer(object, "byteOffset", 0, std::int64_t{1} << 40, here);
      if (!o) return o.status();
      offset = *o;
    }
    return fill(object, *v, static_cast<std::size_t>(offset), kind, width, n, scaled, here, to);
  };
  const auto kind = get_integer(*indices, "componentType", 5121, 5125, here);
  if (!kind) return kind.status();
  if (component_of(*kind) == nullptr)
    return {Errc::invalid_file, here + ": 'componentType' is " + std::to_string(*kind)};
  if (Status s = part(*indices, 1, rows.data(), static_cast<int>(*kind), false); !s) return s;
  if (Status s = part(*values, out.width, data.data(), type, normalized); !s) return s;
  for (std::size_t i = 0; i < n; ++i) {
    if (!(rows[i] >= 0 && rows[i] < static_cast<double>(out.count))) {
      return {Errc::invalid_file, here + ": index " + std::to_string(rows[i]) + " of " + std::to_string(out.count)};
    }
    std::copy_n(data.data() + i * out.width, out.width,
                out.values.data() + static_cast<std::size_t>(rows[i]) * out.width);
  }
  return {};
}

Result<GltfNumbers> GltfDocument::read(std::size_t accessor, const std::string& types) {
  constexpr std::int64_t kMostElements = std::int64_t{1} << 26;
  const auto e = entry("accessors", accessor);
  if (!e) return e.status();
  const Json& a = **e;
  const std::string at = where("accessors", accessor);
  const Json* type = member(a, "type");
  const std::string name = type != nullptr && type->is_string() ? type->get<std::string>() : std::string();
  GltfNumbers out;
  out.width = width_of(name);
  if (out.width == 0 || (" " + types + " ").find(" " + name + " ") == std::string::npos) {
    return {Errc::invalid_file, at + " is of type " + in_quotes(name) + ", must be " + types};
  }
  const auto kind = get_integer(a, "componentType", 5120, 5126, at);
  if (!kind) return kind.status();
  if (component_of(*kind) == nullptr) return {Errc::invalid_file, at + ": 'componentType' is " + std::to_string(*kind)};
  const auto many = get_integer(a, "count", 1, kMostElements, at);
  if (!many) return many.status();
  out.count = static_cast<std::size_t>(*many);
  const Json *normal = member(a, "normalized"), *sparse = member(a, "sparse");
  const bool normalized = normal != nullptr && normal->is_boolean() && normal->get<bool>();
  if (member(a, "bufferView") == nullptr && (sparse == nullptr || out.count > (1u << 20))) {
    return {Errc::unsupported, at + " has no bufferView"};
  }
  if (member(a, "bufferView") != nullptr) {
    const auto v = index(a, "bufferView", "bufferViews", at);
    if (!v) return v.status();
    std::int64_t offset = 0;
    if (member(a, "byteOffset") != nullptr) {
      const auto o = get_integer(a, "byteOffset", 0, std::int64_t{1} << 40, at);
      if (!o) return o.status();
      offset = *o;
    }
    // Nothing is allocated that the file has no bytes for.
    const auto bytes = view(*v);
    if (!bytes) return {bytes.code(), at + ": " + bytes.message()};
    if (out.count > bytes->size()) {
      return {Errc::invalid_file, at + ": " + std::to_string(out.count) + " elements end behind their buffer view of " +
                                      std::to_string(bytes->size()) + " bytes"};
    }
    out.values.resize(out.count * out.width);
    if (Status s = fill(a, *v, static_cast<std::size_t>(offset), static_cast<int>(*kind), out.width, out.count,
                        normalized, at, out.values.data());
        !s) {
      return s;
    }
  } else {
    out.values.resize(out.count * out.width);
  }
  if (sparse != nullptr) {
    if (Status s = fill_sparse(*sparse, static_cast<int>(*kind), normalized, at, out); !s) return s;
  }
  return out;
}

}  // namespace gsnav::io::detail
