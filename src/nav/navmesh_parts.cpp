// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <limits>
#include <string>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

Result<NavMeshTriangles> gather_parts(const NavMeshSettings& settings,
                                      std::span<const NavMeshPart> parts) {
  NavMeshTriangles out;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const NavMeshPart& part = parts[i];
    const auto bad = [i](const std::string& what) {
      return Status(Errc::invalid_argument, "NavMesh: part " + std::to_string(i) + ": " + what);
    };
    const Similarity& placed = part.world_from_part;
    const Vec3d moved = placed * Vec3d{1, 1, 1};
    if (!is_finite(moved) || !(placed.scale > 0))
      return bad("world_from_part is not finite or has no positive scale");
    for (std::size_t t = 0; t < part.triangles.size(); ++t) {
      for (const std::uint32_t v : part.triangles[t]) {
        if (v < part.vertices.size()) continue;
        return bad("triangle " + std::to_string(t) + " names vertex " + std::to_string(v) + " of " +
                   std::to_string(part.vertices.size()));
      }
    }
    if (part.static_object && !settings.include_static_objects) continue;
    const std::size_t first = out.vertices.size();
    if (first + part.vertices.size() > std::numeric_limits<std::uint32_t>::max()) {
      return bad("all parts together have more than 2^32 vertices");
    }
    out.vertices.reserve(first + part.vertices.size());
    for (const Vec3d& v : part.vertices) out.vertices.push_back(placed * v);
    out.triangles.reserve(out.triangles.size() + part.triangles.size());
    const auto base = static_cast<std::uint32_t>(first);
    for (const auto& t : part.triangles)
      out.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  }
  return out;
}

Result<NavMesh> NavMesh::build(const NavMeshSettings& settings, std::span<const NavMeshPart> parts,
                               int threads, const std::function<void(double)>& progress) {
  const auto all = gather_parts(settings, parts);
  if (!all) return all.status();
  return build(settings, all->vertices, all->triangles, threads, progress);
}

}  // namespace gsnav
