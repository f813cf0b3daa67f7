// SPDX-License-Identifier: Apache-2.0
#include "gltf_material.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "picture.hpp"
#include "webp.hpp"

namespace gsnav::io::detail {
namespace {

constexpr int kRepeat = 10497;
/// Pixels that all textures of a file may have together, in squares of ReadLimits::texture_side.
constexpr std::size_t kMostLargest = 8;

/// Extension `name` of an object, or null.
const Json* extension(const Json& object, const char* name) {
  const Json* all = member(object, "extensions");
  return all == nullptr ? nullptr : member(*all, name);
}

bool begins(std::span<const std::byte> bytes, std::initializer_list<int> magic) {
  std::size_t k = 0;
  for (const int m : magic) {
    if (k >= bytes.size() || std::to_integer<int>(bytes[k++]) != m) return false;
  }
  return true;
}

TextureImage picture_of(const PngImage& image) {
  TextureImage out{static_cast<std::size_t>(image.width), static_cast<std::size_t>(image.height), {}};
  const std::size_t c = static_cast<std::size_t>(image.channels);
  const int shift = image.bits == 16 ? 8 : 0;
  out.rgba.resize(4 * out.width * out.height);
  for (std::size_t i = 0; i < out.width * out.height; ++i) {
    const std::uint16_t* p = image.samples.data() + i * c;
    for (std::size_t k = 0; k < 3; ++k) {
      out.rgba[4 * i + k] = static_cast<std::uint8_t>(p[c >= 3 ? k : 0] >> shift);
    }
    out.rgba[4 * i + 3] =
        c == 2 || c == 4 ? static_cast<std::uint8_t>(p[c - 1] >> shift) : std::uint8_t{255};
  }
  return out;
}

}  // namespace

Result<GltfMaterial> GltfMaterials::of(const Json& primitive, const std::string& where) {
  if (member(primitive, "material") == nullptr) return GltfMaterial{};
  const auto index = file_.index(primitive, "material", "materials", where);
  if (!index) return index.status();
  const auto known = material_of_.find(*index);
  if (known != material_of_.end()) return known->second;
  auto material = read(*index);
  if (material) material_of_.emplace(*index, *material);
  return material;
}

Result<GltfMaterial> GltfMaterials::read(std::size_t index) {
  const auto found = file_.item("materials", index);
  if (!found) return found.status();
  const Json& material = **found;
  const std::string at = file_.where("materials", index);
  GltfMaterial out;
  const Json *sides = member(material, "doubleSided"), *mode = member(material, "alphaMode");
  out.surface.double_sided = sides != nullptr && *sides == true;
  out.surface.unlit = extension(material, "KHR_materials_unlit") != nullptr;
  if (mode != nullptr && *mode == "MASK") {
    out.surface.alpha_cutoff = 0.5;
    if (member(material, "alphaCutoff") != nullptr) {
      const auto cut = get_number(material, "alphaCutoff", at);
      if (!cut) return cut.status();
      out.surface.alpha_cutoff = *cut;
    }
  }
  out.surface.blend = mode != nullptr && *mode == "BLEND";
  const Json* pbr = member(material, "pbrMetallicRoughness");
  if (pbr == nullptr) return out;
  if (member(*pbr, "baseColorFactor") != nullptr) {
    const auto factor = get_numbers(*pbr, "baseColorFactor", 4, at);
    if (!factor) return factor.status();
    out.surface.factor = {(*factor)[0], (*factor)[1], (*factor)[2]};
    out.surface.alpha = std::clamp((*factor)[3], 0.0, 1.0);
  }
  if (const Json* texture = member(*pbr, "baseColorTexture"); texture != nullptr) {
    if (Status s = read_texture(*texture, at, out); !s) return s;
  }
  return out;
}

Status GltfMaterials::read_texture(const Json& info, const std::string& at, GltfMaterial& out) {
  const auto index = file_.index(info, "index", "textures", at);
  if (!index) return index.status();
  const auto set = get_index(info, "texCoord", 0, at);
  if (!set) return set.status();
  out.texcoord = *set;
  if (const Json* transform = extension(info, "KHR_texture_transform"); transform != nullptr) {
    if (Status s = read_uv_map(*transform, at + ": KHR_texture_transform", out); !s) return s;
  }
  const auto texture = file_.item("textures", *index);
  if (!texture) return texture.status();
  const auto read = picture(**texture, *index);
  if (!read) return read.status();
  out.surface.texture = *read;
  if (member(**texture, "sampler") == nullptr) return {};
  const auto sampler = file_.index(**texture, "sampler", "samplers", file_.where("textures", *index));
  if (!sampler) return sampler.status();
  const Json& how = (*member(file_.json(), "samplers"))[*sampler];
  for (const char* key : {"wrapS", "wrapT"}) {
    const Json* wrap = member(how, key);
    if (wrap != nullptr && *wrap != kRepeat) {
      warnings_.push_back(file_.where("samplers", *sampler) + ": '" + key + "' is " + shown(*wrap) +
                          "; textures repeat");
    }
  }
  return {};
}

Status GltfMaterials::read_uv_map(const Json& transform, const std::string& at,
                                  GltfMaterial& out) const {
  std::vector<double> offset{0, 0}, scale{1, 1};
  for (auto [key, values] : {std::pair{"offset", &offset}, std::pair{"scale", &scale}}) {
    if (member(transform, key) == nullptr) continue;
    auto v = get_numbers(transform, key, 2, at);
    if (!v) return v.status();
    *values = std::move(*v);
  }
  double angle = 0;
  if (member(transform, "rotation") != nullptr) {
    const auto v = get_number(transform, "rotation", at);
    if (!v) return v.status();
    angle = *v;
  }
  const auto set = get_index(transform, "texCoord", out.texcoord, at);
  if (!set) return set.status();
  out.texcoord = *set;
  // Scale, rotate (counter-clockwise as seen, since v points down), then move.
  const double c = std::cos(angle), s = std::sin(angle);
  out.uv_map = {c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1]};
  return {};
}

Result<std::int32_t> GltfMaterials::picture(const Json& texture, std::size_t index) {
  const std::string at = file_.where("textures", index);
  const Json* webp = extension(texture, "EXT_texture_webp");
  const Json& holder = webp != nullptr && member(*webp, "source") != nullptr ? *webp : texture;
  if (member(holder, "source") == nullptr) {
    warnings_.push_back(at + " has no source that is read; the material's colour is taken");
    return std::int32_t{-1};
  }
  const auto source = file_.index(holder, "source", "images", at);
  if (!source) return source.status();
  if (const auto have = texture_of_.find(*source); have != texture_of_.end()) return have->second;
  // A small file may have many pixels, or many textures of the same bytes.
  const auto side = static_cast<std::size_t>(file_.limits().texture_side);
  if (pixels_ >= kMostLargest * side * side) {
    warnings_.push_back(
        file_.where("images", *source) + ": the pictures before it have " + std::to_string(pixels_) +
        " pixels, and no more are read; make them smaller, or raise ReadLimits::texture_side; "
        "the material's colour is taken");
    return texture_of_[*source] = -1;
  }
  auto decoded = decode(*source);
  if (!decoded) {
    if (decoded.code() != Errc::unsupported) return decoded.status();
    warnings_.push_back(decoded.message() + "; the material's colour is taken");
    return texture_of_[*source] = -1;
  }
  pixels_ += decoded->width * decoded->height;
  textures_.push_back(std::move(*decoded));
  return texture_of_[*source] = static_cast<std::int32_t>(textures_.size() - 1);
}

Result<TextureImage> GltfMaterials::decode(std::size_t index) const {
  const auto image = file_.item("images", index);
  if (!image) return image.status();
  const std::string at = file_.where("images", index);
  const int most_side = file_.limits().texture_side;
  std::vector<std::byte> own;
  std::span<const std::byte> bytes;
  if (const Json* uri = member(**image, "uri"); uri != nullptr && uri->is_string()) {
    auto b = file_.uri_bytes(uri->get<std::string>(), at);
    if (!b) return b.status();
    own = std::move(*b);
    bytes = own;
  } else {
    const auto view = file_.index(**image, "bufferView", "bufferViews", at);
    if (!view) return view.status();
    const auto b = file_.view(*view, own);
    if (!b) return b.status();
    bytes = *b;
  }
  if (begins(bytes, {'R', 'I', 'F', 'F'})) {
    const auto size = webp_size(bytes, at, WebpUse::picture);
    if (!size) return size.status();
    if (std::max(size->width, size->height) > static_cast<std::size_t>(most_side)) {
      return too_large(at, size->width, size->height, most_side);
    }
    auto decoded = decode_webp(bytes, at, WebpUse::picture);
    if (!decoded) return decoded.status();
    return TextureImage{decoded->width, decoded->height, std::move(decoded->pixels)};
  }
  const bool png = begins(bytes, {0x89, 'P', 'N', 'G'});
  if (!png && !begins(bytes, {0xff, 0xd8}))
    return {Errc::unsupported, at + ": neither PNG, JPEG nor WebP"};
  const auto decoded = png ? decode_png(bytes, at, most_side) : decode_jpeg(bytes, at, most_side);
  if (!decoded) return decoded.status();
  return picture_of(*decoded);
}

}  // namespace gsnav::io::detail
