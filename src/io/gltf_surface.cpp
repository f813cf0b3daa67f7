// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "gltf_material.hpp"
#include "gltf_primitive.hpp"
#include "gltf_skin.hpp"

namespace gsnav::io::detail {
namespace {

class SurfaceReader {
 public:
  SurfaceReader(const GltfFile& file, const GltfSkin& skin, LoadedSkinnedMesh& out)
      : file_(file),
        skin_(skin),
        out_(out),
        mesh_(out.mesh),
        materials_(file, out.mesh.textures, out.report.warnings) {}

  Status run() {
    for (std::size_t n = 0; n < file_.count("nodes"); ++n) {
      const Json& node = **file_.item("nodes", n);
      const Json *which = member(node, "skin"), *mesh = member(node, "mesh");
      if (mesh == nullptr) continue;
      part_ = nullptr;
      for (const GltfSkinPart& p : skin_.parts) {
        if (which != nullptr && which->is_number() &&
            which->get<double>() == static_cast<double>(p.index))
          part_ = &p;
      }
      if (part_ == nullptr) {
        ++others_;
        continue;
      }
      const auto m = file_.index(node, "mesh", "meshes", file_.where("nodes", n));
      if (!m) return m.status();
      const auto read = [this](const Json& primitive, const std::string& at) {
        return read_primitive(primitive, at);
      };
      if (Status s = for_each_primitive(file_, *m, read); !s) return s;
    }
    if (mesh_.triangles.empty()) {
      return {Errc::invalid_file, file_.source() + ": no triangles are moved by skins[" +
                                      std::to_string(skin_.parts[0].index) + "]"};
    }
    finish();
    return {};
  }

 private:
  void warn(const std::string& what) { out_.report.warnings.push_back(what); }

  Result<GltfNumbers> attribute(const Json& primitive, const std::string& name, const std::string& types,
                                const std::string& at) const {
    return read_attribute(file_, primitive, name, types, vertices_, at);
  }

  Status read_primitive(const Json& primitive, const std::string& at) {
    const auto geometry = read_geometry(file_, primitive, at);
    if (!geometry) return geometry.status();
    const auto& [points, triangles] = *geometry;
    if (points.count == 0) {
      return {Errc::unsupported,
              at + ": 'mode' is " + shown(*member(primitive, "mode")) + "; triangles are read"};
    }
    if (member(primitive, "targets") != nullptr) warn(at + ": morph targets are left out");
    vertices_ = points.count;
    const std::size_t first = mesh_.positions.size();
    for (std::size_t v = 0; v < vertices_; ++v) {
      const double* p = points.row(v);
      mesh_.positions.push_back(skin_.canonical_from_mesh *
                                (part_->rig_from_mesh * Vec3d{p[0], p[1], p[2]}));
    }
    if (Status s = read_weights(primitive, at); !s) return s;
    const auto material = materials_.of(primitive, at);
    if (!material) return material.status();
    if (material->surface.blend) warn(at + ": a blended surface is taken as opaque");
    mesh_.materials.push_back(material->surface);
    const auto uv = attribute(primitive, "TEXCOORD_" + std::to_string(material->texcoord), "VEC2", at),
               color = attribute(primitive, "COLOR_0", "VEC3 VEC4", at);
    if (!uv) return uv.status();
    if (!color) return color.status();
    uvs_.resize(first, {0, 0});
    colors_.resize(first, {1, 1, 1});
    for (std::size_t v = 0; v < vertices_; ++v) {
      uvs_.push_back(uv->count == 0 ? std::array<double, 2>{0, 0}
                                    : material->uv(uv->row(v)[0], uv->row(v)[1]));
      colors_.push_back(color->count == 0 ? Vec3d{1, 1, 1}
                                          : Vec3d{color->row(v)[0], color->row(v)[1], color->row(v)[2]});
    }
    has_uvs_ = has_uvs_ || uv->count != 0;
    has_colors_ = has_colors_ || color->count != 0;
    const auto base = static_cast<std::uint32_t>(first);
    for (const auto& [a, b, c] : triangles) mesh_.triangles.push_back({base + a, base + b, base + c});
    mesh_.materials_of.insert(mesh_.materials_of.end(), triangles.size(),
                              static_cast<std::uint32_t>(mesh_.materials.size() - 1));
    return {};
  }

  Status read_weights(const Json& primitive, const std::string& at) {
    std::vector<GltfNumbers> joints, weights;
    for (std::size_t set = 0;; ++set) {
      auto j = attribute(primitive, "JOINTS_" + std::to_string(set), "VEC4", at);
      auto w = attribute(primitive, "WEIGHTS_" + std::to_string(set), "VEC4", at);
      if (!j) return j.status();
      if (!w) return w.status();
      if (j->count == 0 && w->count == 0) break;
      if (j->count == 0 || w->count == 0)
        return {Errc::invalid_file,
                at + ": JOINTS and WEIGHTS " + std::to_string(set) + " must come together"};
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
            return {Errc::invalid_file,
                    at + ": vertex " + std::to_string(v) + " has weight " + std::to_string(w)};
          if (!(w > 0)) continue;
          if (!(j >= 0 && j < static_cast<double>(part_->joint_of.size())) || j != std::floor(j)) {
            return {Errc::invalid_file, at + ": vertex " + std::to_string(v) + " names joint " +
                                            std::to_string(j) + " of " +
                                            std::to_string(part_->joint_of.size())};
          }
          row.emplace_back(part_->joint_of[static_cast<std::size_t>(j)], w);
          sum += w;
        }
      }
      if (!(sum > 0))
        return {Errc::invalid_file,
                at + ": the weights of vertex " + std::to_string(v) + " are all zero"};
      SkinnedMeshReport& report = out_.report;
      report.unequal_weights += std::fabs(sum - 1.0) > 1e-3 ? 1 : 0;
      report.least_weight_sum = std::min(report.least_weight_sum, sum);
      report.greatest_weight_sum = std::max(report.greatest_weight_sum, sum);
      for (auto& influence : row) influence.second /= sum;
    }
    return {};
  }

  void finish() {
    if (has_uvs_) mesh_.uvs = std::move(uvs_);
    if (has_colors_) mesh_.colors = std::move(colors_);
    for (const auto& row : rows_) mesh_.influences = std::max(mesh_.influences, row.size());
    for (const auto& row : rows_) {
      for (std::size_t k = 0; k < mesh_.influences; ++k) {
        mesh_.joint_indices.push_back(
            static_cast<std::uint16_t>(k < row.size() ? row[k].first : row[0].first));
        mesh_.weights.push_back(k < row.size() ? static_cast<float>(row[k].second) : 0.0f);
      }
    }
    SkinnedMeshReport& report = out_.report;
    report.vertices = mesh_.positions.size();
    report.triangles = mesh_.triangles.size();
    report.skins = skin_.parts.size();
    report.skins_in_file = file_.count("skins");
    if (report.unequal_weights != 0) {
      warn("the weights of " + std::to_string(report.unequal_weights) +
           " vertices do not sum to 1; they were divided by their sums");
    }
    if (others_ != 0)
      warn(std::to_string(others_) + " meshes are moved by no skin that is read and are left out");
  }

  const GltfFile& file_;
  const GltfSkin& skin_;
  LoadedSkinnedMesh& out_;
  SkinnedMesh& mesh_;
  GltfMaterials materials_;
  const GltfSkinPart* part_ = nullptr;  // the skin of the mesh that is being read
  std::size_t vertices_ = 0, others_ = 0;
  bool has_uvs_ = false, has_colors_ = false;
  std::vector<std::array<double, 2>> uvs_;
  std::vector<Vec3d> colors_;
  std::vector<std::vector<std::pair<std::size_t, double>>> rows_;  // joints and weights of each vertex
};

}  // namespace

Status read_surface(const GltfFile& file, const GltfSkin& skin, LoadedSkinnedMesh& out) {
  return SurfaceReader(file, skin, out).run();
}

}  // namespace gsnav::io::detail
