// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>

#include "gltf_nodes.hpp"
#include "gltf_primitive.hpp"
#include "gsnav/detail/io/mesh_file.hpp"

namespace gsnav::io {
namespace {

using detail::GltfFile;
using detail::GltfGeometry;
using detail::GltfInstance;
using detail::Json;

class MeshReader {
 public:
  explicit MeshReader(const GltfFile& file) : file_(file) {}

  Result<TriangleMesh> run() {
    const auto instances = detail::read_instances(file_);
    if (!instances) return instances.status();
    for (const GltfInstance& instance : *instances) {
      const auto read = [&](const Json& primitive, const std::string& at) {
        auto geometry = detail::read_geometry(file_, primitive, at);
        return geometry ? add(std::move(*geometry), instance) : geometry.status();
      };
      if (Status s = detail::for_each_primitive(file_, instance.mesh, read); !s) return s;
    }
    if (mesh_.triangles.empty()) {
      return {Errc::invalid_file, file_.source() + ": no triangles in the scene"};
    }
    return std::move(mesh_);
  }

 private:
  Status add(GltfGeometry geometry, const GltfInstance& instance) {
    const std::string at = file_.where("nodes", instance.node);
    const auto& [points, triangles] = geometry;
    // Nodes may share a mesh, so a small file could ask for any number of copies.
    const std::size_t first = mesh_.vertices.size();
    if (first + points.count > file_.size() || points.count > 0xffffffff - first ||
        mesh_.triangles.size() + triangles.size() > file_.size()) {
      return {Errc::invalid_file, at + ": more vertices or triangles than the file has bytes"};
    }
    for (std::size_t i = 0; i < points.count; ++i) {
      const double* p = points.row(i);
      const Vec3f v = vec_cast<float>(instance.world_from_mesh * Vec3d{p[0], p[1], p[2]});
      if (!is_finite(v)) {
        return {Errc::invalid_file, at + ": vertex " + std::to_string(i) + " is not finite"};
      }
      mesh_.vertices.push_back(v);
    }
    detail::keep_sides(geometry.triangles, instance.world_from_mesh);
    const auto base = static_cast<std::uint32_t>(first);
    for (const auto& [a, b, c] : triangles) {
      mesh_.triangles.push_back({base + a, base + b, base + c});
    }
    return {};
  }

  const GltfFile& file_;
  TriangleMesh mesh_;
};

}  // namespace

Result<TriangleMesh> load_gltf_mesh(const std::filesystem::path& path, const ReadLimits& limits) {
  return detail::guarded(path.string(), [&]() -> Result<TriangleMesh> {
    const auto file = GltfFile::open(path, limits);
    if (!file) return file.status();
    return MeshReader(*file).run();
  });
}

}  // namespace gsnav::io
