// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "gltf_material.hpp"
#include "gltf_nodes.hpp"
#include "gltf_primitive.hpp"
#include "gsnav/detail/io/mesh_file.hpp"

namespace gsnav::io {
namespace {

using detail::GltfFile;
using detail::GltfInstance;
using detail::Json;

Vec3f vec3_of(const double* p) { return vec_cast<float>(Vec3d{p[0], p[1], p[2]}); }

/// Applies a transform to a part. Normals transform by the cofactors, which keeps them perpendicular;
/// triangles are reversed if the transform mirrors. Returns false if a vertex is then not finite.
bool transform(TexturedPart& part, const Affine3<double>& a) {
  const Mat3d of_normals = cofactors(a.linear) * (determinant(a.linear) < 0 ? -1.0 : 1.0);
  bool finite = true;
  for (Vec3f& v : part.geometry.vertices) {
    v = vec_cast<float>(a * vec_cast<double>(v));
    finite = finite && is_finite(v);
  }
  for (Vec3f& n : part.normals) {
    const Vec3d turned = of_normals * vec_cast<double>(n);
    const double length = norm(turned);
    if (length > 0) n = vec_cast<float>(turned * (1.0 / length));
  }
  detail::keep_sides(part.geometry.triangles, a);
  return finite;
}

constexpr std::size_t kUnused = static_cast<std::size_t>(-1);

class SceneReader {
 public:
  explicit SceneReader(const GltfFile& file)
      : file_(file), materials_(file, out_.textures, out_.warnings) {}

  Result<TexturedScene> run() {
    const auto instances = detail::read_instances(file_);
    if (!instances) return instances.status();
    for (const GltfInstance& instance : *instances) {
      if (Status s = place(instance); !s) return s;
    }
    if (out_.instances.empty()) {
      return {Errc::invalid_file, file_.source() + ": no triangles in the scene"};
    }
    drop_unused();
    return std::move(out_);
  }

 private:
  /// Removes parts without an instance: uneven nodes have transformed copies of them.
  void drop_unused() {
    std::vector<std::size_t> place(out_.parts.size(), kUnused);
    for (const auto& instance : out_.instances) place[instance.part] = 0;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < place.size(); ++i) {
      if (place[i] == kUnused) continue;
      place[i] = kept++;
      if (place[i] != i) out_.parts[place[i]] = std::move(out_.parts[i]);
    }
    out_.parts.resize(kept);
    for (auto& instance : out_.instances) instance.part = place[instance.part];
  }

  Status place(const GltfInstance& instance) {
    const std::string at = file_.where("nodes", instance.node);
    if (parts_of_.count(instance.mesh) == 0) {
      if (Status s = read_mesh(instance.mesh); !s) return s;
    }
    Similarity world;
    const bool similar = detail::as_similarity(instance.world_from_mesh, world);
    for (const std::size_t part : parts_of_[instance.mesh]) {
      std::size_t shown = part;
      if (!similar) {
        TexturedPart own = out_.parts[part];
        if (!transform(own, instance.world_from_mesh)) {
          return {Errc::invalid_file, at + ": a vertex is not finite"};
        }
        if (Status s = keep(std::move(own), at); !s) return s;
        shown = out_.parts.size() - 1;
        world = {};
      }
      out_.instances.push_back({shown, world});
    }
    return {};
  }

  Status read_mesh(std::size_t mesh) {
    std::vector<std::size_t>& parts = parts_of_[mesh];
    return detail::for_each_primitive(file_, mesh,
                                      [&](const Json& primitive, const std::string& at) -> Status {
                                        auto geometry = detail::read_geometry(file_, primitive, at);
                                        if (!geometry) return geometry.status();
                                        if (geometry->points.count == 0) return {};
                                        auto part = read_part(primitive, std::move(*geometry), at);
                                        if (!part) return part.status();
                                        parts.push_back(out_.parts.size());
                                        return keep(std::move(*part), at);
                                      });
  }

  /// Keeps a part. Accessors and meshes may be shared, so a small file could ask for any number of
  /// copies.
  Status keep(TexturedPart part, const std::string& at) {
    held_ += part.geometry.vertices.size() + part.geometry.triangles.size();
    if (held_ > 2 * file_.size()) {
      return {Errc::invalid_file, at + ": more vertices or triangles than the file has bytes"};
    }
    out_.parts.push_back(std::move(part));
    return {};
  }

  Result<TexturedPart> read_part(const Json& primitive, detail::GltfGeometry geometry,
                                 const std::string& at) {
    const auto material = materials_.of(primitive, at);
    if (!material) return material.status();
    TexturedPart out;
    out.material = material->surface;
    const std::size_t n = geometry.points.count;
    for (std::size_t i = 0; i < n; ++i) {
      out.geometry.vertices.push_back(vec3_of(geometry.points.row(i)));
    }
    out.geometry.triangles = std::move(geometry.triangles);
    const auto read = [&](const std::string& name, const char* types) {
      return detail::read_attribute(file_, primitive, name, types, n, at);
    };
    const auto normals = read("NORMAL", "VEC3"), colors = read("COLOR_0", "VEC3 VEC4"),
               uvs = read("TEXCOORD_" + std::to_string(material->texcoord), "VEC2");
    for (const Status& s : {normals.status(), colors.status(), uvs.status()}) {
      if (!s) return s;
    }
    for (std::size_t i = 0; i < normals->count; ++i) {
      const double* v = normals->row(i);
      const double length = norm(Vec3d{v[0], v[1], v[2]});
      if (!(length > 0)) {
        out_.warnings.push_back(at + ": normal " + std::to_string(i) +
                                " is zero; those of the faces are taken");
        out.normals.clear();
        break;
      }
      out.normals.push_back(vec_cast<float>(Vec3d{v[0], v[1], v[2]} * (1.0 / length)));
    }
    for (std::size_t i = 0; i < colors->count; ++i) out.colors.push_back(vec3_of(colors->row(i)));
    if (colors->width == 4 && (out.material.blend || out.material.alpha_cutoff > 0)) {
      for (std::size_t i = 0; i < colors->count; ++i) {
        out.alphas.push_back(static_cast<float>(std::clamp(colors->row(i)[3], 0.0, 1.0)));
      }
    }
    for (std::size_t i = 0; i < uvs->count; ++i) {
      const auto uv = material->uv(uvs->row(i)[0], uvs->row(i)[1]);
      out.uvs.push_back({static_cast<float>(uv[0]), static_cast<float>(uv[1])});
    }
    if (out.material.texture >= 0 && out.uvs.empty()) {
      out_.warnings.push_back(at + " has a texture and no coordinates; the material's colour is taken");
      out.material.texture = -1;
    }
    return out;
  }

  const GltfFile& file_;
  TexturedScene out_;
  detail::GltfMaterials materials_;
  std::map<std::size_t, std::vector<std::size_t>> parts_of_;  ///< parts of each mesh in use
  std::size_t held_ = 0;  ///< number of vertices and triangles of all parts, together
};

}  // namespace

Result<TexturedScene> load_gltf_scene(const std::filesystem::path& path, const ReadLimits& limits) {
  return detail::guarded(path.string(), [&]() -> Result<TexturedScene> {
    const auto file = GltfFile::open(path, limits);
    if (!file) return file.status();
    return SceneReader(*file).run();
  });
}

}  // namespace gsnav::io
