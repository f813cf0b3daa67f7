// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "gltf_nodes.hpp"
#include "gsnav/io/mesh_file.hpp"

namespace gsnav::io {
namespace {

using detail::GltfFile;
using detail::GltfInstance;
using detail::GltfValues;
using detail::Json;
using detail::member;

constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;

class MeshReader {
 public:
  explicit MeshReader(const GltfFile& file) : file_(file) {}

  Result<TriangleMesh> run() {
    const auto instances = detail::read_instances(file_);
    if (!instances) return instances.status();
    for (const GltfInstance& instance : *instances) {
      const auto mesh = file_.item("meshes", instance.mesh);
      if (!mesh) return mesh.status();
      const Json* primitives = member(**mesh, "primitives");
      if (primitives == nullptr || !primitives->is_array()) {
        return {Errc::invalid_file, where(instance) + ": its mesh has no 'primitives'"};
      }
      for (const Json& primitive : *primitives) {
        if (Status s = add(primitive, instance); !s) return s;
      }
    }
    if (mesh_.triangles.empty()) {
      return {Errc::invalid_file, file_.source() + ": no triangles in the scene"};
    }
    return std::move(mesh_);
  }

 private:
  std::string where(const GltfInstance& instance) const {
    return file_.source() + ": node " + std::to_string(instance.node);
  }

  Status add(const Json& primitive, const GltfInstance& instance) {
    const std::string at = where(instance);
    const auto mode = detail::get_index(primitive, "mode", kTriangles, at);
    if (!mode) return mode.status();
    if (*mode < kTriangles || *mode > kFan) return {};
    const Json* attributes = member(primitive, "attributes");
    const auto position = detail::get_index(attributes == nullptr ? primitive : *attributes, "POSITION",
                                            detail::kNoIndex, at);
    const auto list = detail::get_index(primitive, "indices", detail::kNoIndex, at);
    for (const Status& s : {position.status(), list.status()}) {
      if (!s) return s;
    }
    if (*position == detail::kNoIndex) {
      return {Errc::invalid_file, at + ": a primitive without attribute POSITION"};
    }
    const auto points = file_.values(*position, "VEC3");
    if (!points) return points.status();
    const std::size_t count = points->size();
    // Nodes may share a mesh: a small file could ask for any number of copies.
    if (mesh_.vertices.size() + count > file_.size() || count > 0xffffffff - mesh_.vertices.size()) {
      return {Errc::invalid_file, at + ": more vertices than the file has bytes"};
    }
    std::vector<std::uint32_t> corners;
    if (*list == detail::kNoIndex) {
      corners.resize(count);
      std::iota(corners.begin(), corners.end(), 0u);
    } else {
      const auto held = file_.values(*list, "SCALAR");
      if (!held) return held.status();
      if (mesh_.triangles.size() + held->size() > file_.size()) {
        return {Errc::invalid_file, at + ": more triangles than the file has bytes"};
      }
      auto read = file_.indices(*list);
      if (!read) return read.status();
      corners = std::move(*read);
    }
    for (const std::uint32_t c : corners) {
      if (c >= count) {
        return {Errc::invalid_file,
                at + ": corner " + std::to_string(c) + " of " + std::to_string(count) + " vertices"};
      }
    }
    return place(*points, corners, *mode, instance);
  }

  Status place(const GltfValues& points, const std::vector<std::uint32_t>& corners, std::size_t mode,
               const GltfInstance& instance) {
    const std::uint32_t first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3d p{points.at(i, 0), points.at(i, 1), points.at(i, 2)};
      const Vec3f v = vec_cast<float>(instance.world_from_mesh * p);
      if (!is_finite(v)) {
        return {Errc::invalid_file,
                where(instance) + ": vertex " + std::to_string(i) + " is not finite"};
      }
      mesh_.vertices.push_back(v);
    }
    const bool mirrored = determinant(instance.world_from_mesh.linear) < 0;
    const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (mirrored) std::swap(b, c);
      mesh_.triangles.push_back({first + a, first + b, first + c});
    };
    for (std::size_t k = 2; k < corners.size(); k += mode == kTriangles ? 3 : 1) {
      if (mode == kFan) {
        triangle(corners[0], corners[k - 1], corners[k]);
      } else if (mode == kStrip && k % 2 != 0) {
        triangle(corners[k - 1], corners[k - 2], corners[k]);
      } else {
        triangle(corners[k - 2], corners[k - 1], corners[k]);
      }
    }
    return {};
  }

  const GltfFile& file_;
  TriangleMesh mesh_;
};

}  // namespace

Result<TriangleMesh> load_gltf_mesh(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<TriangleMesh> {
    const auto file = GltfFile::open(path);
    if (!file) return file.status();
    return MeshReader(*file).run();
  });
}

}  // namespace gsnav::io
