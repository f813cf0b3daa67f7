// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "file.hpp"
#include "gltf_skin.hpp"
#include "picture.hpp"

namespace gsnav::io::detail {
namespace {

class SurfaceReader {
 public:
  SurfaceReader(const GltfFile& file, const GltfSkin& skin, LoadedSkinnedMesh& out)
      : file_(file), skin_(skin), out_(out), mesh_(out.mesh) {}

  Status run(std::size_t skin) {
    for (std::size_t n = 0; n < file_.count("nodes"); ++n) {
      const Json& node = **file_.item("nodes", n);
      const Json *which = member(node, "skin"), *mesh = member(node, "mesh");
      if (mesh == nullptr) continue;
      if (which == nullptr || !which->is_number() || which->get<double>() != static_cast<double>(skin)) {
        ++others_;
        continue;
      }
      const auto m = file_.index(node, "mesh", "meshes", file_.where("nodes", n));
      if (!m) return m.status();
      if (Status s = read_mesh(*m); !s) return s;
    }
    if (mesh_.triangles.empty()) {
      return {Errc::invalid_file, file_.source() + ": no triangles are moved by skins[" + std::to_string(skin) + "]"};
    }
    finish();
    return {};
  }

 private:
  void warn(const std::string& what) { out_.report.warnings.push_back(what); }

  Status read_mesh(std::size_t index) {
    const auto mesh = file_.item("meshes", index);
    if (!mesh) return mesh.status();
    const Json* primitives = member(**mesh, "primitives");
    if (primitives == nullptr || !primitives->is_array())
      return {Errc::invalid_file, file_.where("meshes", index) + " has no primitives"};
    for (std::size_t p = 0; p < primitives->size(); ++p) {
      const std::string at = file_.where("meshes", index) + ".primitives[" + std::to_string(p) + "]";
      if (Status s = read_primitive((*primitives)[p], at); !s) return s;
    }
    return {};
  }

  /// Reads attribute `name`, [count][width], or nothing where it is not there.
  Result<GltfNumbers> attribute(const Json& attributes, const std::string& name, const std::string& types,
                                const std::string& at) {
    if (member(attributes, name.c_str()) == nullptr) return GltfNumbers{};
    const auto a = file_.index(attributes, name.c_str(), "accessors", at);
    if (!a) return a.status();
    auto v = file_.numbers(*a, types);
    if (v && vertices_ != 0 && v->count != vertices_) {
      return {Errc::invalid_file, at + ": " + name + " has " + std::to_string(v->count) + " values for " +
                                      std::to_string(vertices_) + " vertices"};
    }
    return v;
  }

  Status read_primitive(const Json& primitive, const std::string& at) {
    const Json* attributes = member(primitive, "attributes");
    if (attributes == nullptr || !attributes->is_object()) return {Errc::invalid_file, at + " has no attributes"};
    if (const Json* mode = member(primitive, "mode"); mode != nullptr && *mode != 4) {
      return {Errc::unsupported, at + ": 'mode' is " + shown(*mode) + "; triangles (4) are read"};
    }
    if (member(primitive, "targets") != nullptr) warn(at + ": morph targets are left out");
    vertices_ = 0;
    const auto positions = attribute(*attributes, "POSITION", "VEC3", at);
    if (!positions) return positions.status();
    if (positions->count == 0) return {Errc::invalid_file, at + " has no POSITION"};
    vertices_ = positions->count;
    const std::size_t first = mesh_.positions.size();
    for (std::size_t v = 0; v < vertices_; ++v) {
      const double* p = positions->row(v);
      mesh_.positions.push_back(skin_.canonical_from_mesh * Vec3d{p[0], p[1], p[2]});
    }
    if (Status s = read_weights(*attributes, at); !s) return s;
    const auto uv = attribute(*attributes, "TEXCOORD_0", "VEC2", at),
               color = attribute(*attributes, "COLOR_0", "VEC3 VEC4", at);
    if (!uv) return uv.status();
    if (!color) return color.status();
    uvs_.resize(first, {0, 0});
    colors_.resize(first, {1, 1, 1});
    for (std::size_t v = 0; v < vertices_; ++v) {
      uvs_.push_back(uv->count == 0 ? std::array<double, 2>{0, 0}
                                    : std::array<double, 2>{uv->row(v)[0], uv->row(v)[1]});
      colors_.push_back(color->count == 0 ? Vec3d{1, 1, 1}
                                          : Vec3d{color->row(v)[0], color->row(v)[1], color->row(v)[2]});
    }
    has_uvs_ = has_uvs_ || uv->count != 0;
    has_colors_ = has_colors_ || color->count != 0;
    const auto material = read_material(primitive, at);
    if (!material) return material.status();
    return read_triangles(primitive, first, *material, at);
  }

  Status read_weights(const Json& attributes, const std::string& at) {
    std::vector<GltfNumbers> joints, weights;
    for (std::size_t set = 0;; ++set) {
      auto j = attribute(attributes, "JOINTS_" + std::to_string(set), "VEC4", at);
      auto w = attribute(attributes, "WEIGHTS_" + std::to_string(set), "VEC4", at);
      if (!j) return j.status();
      if (!w) return w.status();
      if (j->count == 0 && w->count == 0) break;
      if (j->count == 0 || w->count == 0)
        return {Errc::invalid_file, at + ": JOINTS and WEIGHTS " + std::to_string(set) + " must come together"};
      joints.push_back(std::move(*j));
      weights.push_back(std::move(*w));
    }
    if (joints.empty()) return {Errc::invalid_file, at + " has no JOINTS_0 and WEIGHTS_0"};
    for (std::size_t v = 0; v < vertices_; ++v) {
      double sum = 0.0;
      auto& row = rows_.emplace_back();
      for (std::size_t set = 0; set < joints.size(); ++set) {
        for (std::size_t k = 0; k < 4; ++k) {
          const double w = weights[set].row(v)[k], j = joints[set].row(v)[k];
          if (!(w >= 0))
            return {Errc::invalid_file, at + ": vertex " + std::to_string(v) + " has weight " + std::to_string(w)};
          if (!(w > 0)) continue;
          if (!(j >= 0 && j < static_cast<double>(skin_.joint_of.size())) || j != std::floor(j)) {
            return {Errc::invalid_file, at + ": vertex " + std::to_string(v) + " names joint " + std::to_string(j) +
                                            " of " + std::to_string(skin_.joint_of.size())};
          }
          row.emplace_back(skin_.joint_of[static_cast<std::size_t>(j)], w);
          sum += w;
        }
      }
      if (!(sum > 0))
        return {Errc::invalid_file, at + ": the weights of vertex " + std::to_string(v) + " are all zero"};
      SkinnedMeshReport& report = out_.report;
      report.unequal_weights += std::fabs(sum - 1.0) > 1e-3 ? 1 : 0;
      report.least_weight_sum = std::min(report.least_weight_sum, sum);
      report.greatest_weight_sum = std::max(report.greatest_weight_sum, sum);
      for (auto& influence : row) influence.second /= sum;
    }
    return {};
  }

  Status read_triangles(const Json& primitive, std::size_t first, std::uint32_t material, const std::string& at) {
    std::vector<double> corners;
    if (member(primitive, "indices") != nullptr) {
      const auto a = file_.index(primitive, "indices", "accessors", at);
      if (!a) return a.status();
      auto v = file_.numbers(*a, "SCALAR");
      if (!v) return v.status();
      corners = std::move(v->values);
    } else {
      for (std::size_t v = 0; v < vertices_; ++v) corners.push_back(static_cast<double>(v));
    }
    for (std::size_t t = 0; t + 2 < corners.size(); t += 3) {
      std::array<std::uint32_t, 3> triangle{};
      for (std::size_t k = 0; k < 3; ++k) {
        const double c = corners[t + k];
        if (!(c >= 0 && c < static_cast<double>(vertices_)) || c != std::floor(c)) {
          return {Errc::invalid_file,
                  at + ": index " + std::to_string(c) + " of " + std::to_string(vertices_) + " vertices"};
        }
        triangle[k] = static_cast<std::uint32_t>(first + static_cast<std::size_t>(c));
      }
      mesh_.triangles.push_back(triangle);
      mesh_.materials_of.push_back(material);
    }
    return {};
  }

  Result<std::uint32_t> read_material(const Json& primitive, const std::string& at) {
    if (member(primitive, "material") == nullptr) {
      mesh_.materials.emplace_back();
      return static_cast<std::uint32_t>(mesh_.materials.size() - 1);
    }
    const auto index = file_.index(primitive, "material", "materials", at);
    if (!index) return index.status();
    if (const auto have = material_of_.find(*index); have != material_of_.end()) return have->second;
    const Json& material = **file_.item("materials", *index);
    const std::string where = file_.where("materials", *index);
    SurfaceMaterial out;
    if (const Json* mode = member(material, "alphaMode"); mode != nullptr && *mode == "MASK") {
      out.alpha_cutoff = 0.5;
      if (member(material, "alphaCutoff") != nullptr) {
        const auto cut = get_number(material, "alphaCutoff", where);
        if (!cut) return cut.status();
        out.alpha_cutoff = *cut;
      }
    }
    if (const Json* pbr = member(material, "pbrMetallicRoughness"); pbr != nullptr) {
      if (member(*pbr, "baseColorFactor") != nullptr) {
        const auto factor = get_numbers(*pbr, "baseColorFactor", 4, where);
        if (!factor) return factor.status();
        out.factor = {(*factor)[0], (*factor)[1], (*factor)[2]};
      }
      if (const Json* texture = member(*pbr, "baseColorTexture"); texture != nullptr) {
        const auto t = read_texture(*texture, where);
        if (!t) return t.status();
        out.texture = *t;
      }
    }
    mesh_.materials.push_back(out);
    return material_of_[*index] = static_cast<std::uint32_t>(mesh_.materials.size() - 1);
  }

  Result<std::int32_t> read_texture(const Json& info, const std::string& where) {
    const auto index = file_.index(info, "index", "textures", where);
    if (!index) return index.status();
    if (const Json* set = member(info, "texCoord"); set != nullptr && *set != 0) {
      warn(where + ": a texture by TEXCOORD_" + set->dump() + " is taken by TEXCOORD_0");
    }
    const Json& texture = **file_.item("textures", *index);
    if (member(texture, "source") == nullptr) {
      warn(file_.where("textures", *index) + " has no source; the material's colour is taken");
      return -1;
    }
    const auto source = file_.index(texture, "source", "images", file_.where("textures", *index));
    if (!source) return source.status();
    if (const auto have = texture_of_.find(*source); have != texture_of_.end()) return have->second;
    const auto picture = read_picture(*source);
    if (!picture) {
      if (picture.code() != Errc::unsupported) return picture.status();
      warn(picture.message() + "; the material's colour is taken");
      return texture_of_[*source] = -1;
    }
    Texture out{static_cast<std::size_t>(picture->width), static_cast<std::size_t>(picture->height), {}};
    const std::size_t c = static_cast<std::size_t>(picture->channels);
    const int shift = picture->bits == 16 ? 8 : 0;
    out.rgba.resize(4 * out.width * out.height);
    for (std::size_t i = 0; i < out.width * out.height; ++i) {
      const std::uint16_t* p = picture->samples.data() + i * c;
      for (std::size_t k = 0; k < 3; ++k) out.rgba[4 * i + k] = static_cast<std::uint8_t>(p[c >= 3 ? k : 0] >> shift);
      out.rgba[4 * i + 3] = c == 2 || c == 4 ? static_cast<std::uint8_t>(p[c - 1] >> shift) : std::uint8_t{255};
    }
    mesh_.textures.push_back(std::move(out));
    return texture_of_[*source] = static_cast<std::int32_t>(mesh_.textures.size() - 1);
  }

  Result<PngImage> read_picture(std::size_t index) {
    const Json& image = **file_.item("images", index);
    const std::string where = file_.where("images", index);
    std::vector<std::byte> own;
    std::span<const std::byte> bytes;
    if (const Json* uri = member(image, "uri"); uri != nullptr && uri->is_string()) {
      auto b = file_.uri_bytes(uri->get<std::string>(), where);
      if (!b) return b.status();
      own = std::move(*b);
      bytes = own;
    } else {
      const auto view = file_.index(image, "bufferView", "bufferViews", where);
      if (!view) return view.status();
      const auto b = file_.view(*view);
      if (!b) return b.status();
      bytes = *b;
    }
    const auto begins = [&](std::initializer_list<int> magic) {
      std::size_t k = 0;
      for (const int m : magic) {
        if (k >= bytes.size() || std::to_integer<int>(bytes[k++]) != m) return false;
      }
      return true;
    };
    if (begins({0x89, 'P', 'N', 'G'})) return decode_png(bytes, where);
    if (begins({0xff, 0xd8})) return decode_jpeg(bytes, where);
    return {Errc::unsupported, where + ": neither PNG nor JPEG"};
  }

  void finish() {
    if (has_uvs_) mesh_.uvs = std::move(uvs_);
    if (has_colors_) mesh_.colors = std::move(colors_);
    for (const auto& row : rows_) mesh_.influences = std::max(mesh_.influences, row.size());
    for (const auto& row : rows_) {
      for (std::size_t k = 0; k < mesh_.influences; ++k) {
        mesh_.joint_indices.push_back(static_cast<std::uint16_t>(k < row.size() ? row[k].first : row[0].first));
        mesh_.weights.push_back(k < row.size() ? static_cast<float>(row[k].second) : 0.0f);
      }
    }
    SkinnedMeshReport& report = out_.report;
    report.vertices = mesh_.positions.size();
    report.triangles = mesh_.triangles.size();
    if (report.unequal_weights != 0) {
      warn("the weights of " + std::to_string(report.unequal_weights) +
           " vertices do not sum to 1; they were divided by their sums");
    }
    if (others_ != 0) warn(std::to_string(others_) + " meshes are not moved by this skin and are left out");
  }

  const GltfFile& file_;
  const GltfSkin& skin_;
  LoadedSkinnedMesh& out_;
  SkinnedMesh& mesh_;
  std::size_t vertices_ = 0, others_ = 0;
  bool has_uvs_ = false, has_colors_ = false;
  std::vector<std::array<double, 2>> uvs_;
  std::vector<Vec3d> colors_;
  std::vector<std::vector<std::pair<std::size_t, double>>> rows_;  // joints and weights of each vertex
  std::map<std::size_t, std::uint32_t> material_of_;
  std::map<std::size_t, std::int32_t> texture_of_;
};

}  // namespace

Status read_surface(const GltfFile& file, const GltfSkin& skin, std::size_t index, LoadedSkinnedMesh& out) {
  return SurfaceReader(file, skin, out).run(index);
}

}  // namespace gsnav::io::detail
