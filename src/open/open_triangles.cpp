// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <utility>

#include "gsnav/core/text.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "gsnav/detail/scene/placed_meshes.hpp"
#include "parts.hpp"

namespace gsnav::detail {
namespace {

/// Adds triangles to those from which a NavMesh may be built.
Status add_obstacles(OpeningScene& s, const TriangleMesh& mesh, const Similarity& placed) {
  std::vector<Vec3d> vertices;
  vertices.reserve(mesh.vertices.size());
  for (const Vec3f& v : mesh.vertices) vertices.push_back(vec_cast<double>(v));
  const NavMeshPart parts[] = {{s.triangles.vertices, s.triangles.triangles, {}},
                               {vertices, mesh.triangles, placed}};
  auto joined = gather_parts({}, parts);
  if (!joined) return joined.status();
  s.triangles = std::move(*joined);
  return {};
}

/// Reads a file whose triangles are drawn.
Status add_drawn(OpeningScene& s, const std::string& file, const Similarity& placed) {
  auto surface = io::load_textured_scene(file);
  if (!surface) return surface.status();
  const std::string kind = lower_case(std::filesystem::path(file).extension().string());
  std::size_t triangles = 0;
  for (TexturedPart& part : surface->parts) {
    triangles += part.geometry.triangles.size();
    // Formats without materials are drawn grey.
    if (kind == ".obj" || kind == ".ply") part.material = {{0.5, 0.5, 0.5}, 0, -1, true, false};
  }
  if (s.wants_obstacles()) {
    TriangleMesh all;
    for (const TexturedScene::Instance& i : surface->instances) {
      const TriangleMesh& part = surface->parts[i.part].geometry;
      const auto first = static_cast<std::uint32_t>(all.vertices.size());
      for (const Vec3f& v : part.vertices)
        all.vertices.push_back(vec_cast<float>(i.world_from_part * vec_cast<double>(v)));
      for (const auto& t : part.triangles)
        all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    if (Status status = add_obstacles(s, all, placed); !status) return status;
  }
  auto ready = placed_meshes(std::move(*surface));
  if (!ready) return {ready.code(), file + ": " + ready.message()};
  s.note(file + ": " + std::to_string(triangles) + " triangles in " +
         std::to_string(ready->instances.size()) + " places");
  for (const std::string& w : ready->warnings) s.warn(file + ": " + w);
  s.scene.meshes.push_back({std::make_shared<const PlacedMeshes>(std::move(*ready)), placed});
  return {};
}

}  // namespace

Status open_triangles(OpeningScene& s) {
  const Similarity stage = s.source.has_frame ? s.source.world_from_mesh : s.world_from_file;
  if (!s.source.stage_mesh.empty()) {
    if (Status status = add_drawn(s, s.source.stage_mesh, stage); !status) return status;
  }
  for (const std::string& file : s.options.meshes) {
    if (Status status = add_drawn(s, file, s.world_from_file); !status) return status;
  }
  if (s.source.collision_mesh.empty() || !s.wants_obstacles()) return {};
  const auto mesh = io::load_mesh(s.source.collision_mesh);
  if (!mesh) return mesh.status();
  return add_obstacles(s, *mesh, stage);
}

}  // namespace gsnav::detail
