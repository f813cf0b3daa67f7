// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <string>

#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "navmesh_impl.hpp"

namespace gsnav {

Status save_navmesh_obj(const NavMesh& mesh, const std::filesystem::path& path) {
  const NavMeshTriangles surface = mesh.surface();
  std::string text;
  char line[128];
  for (const Vec3d& v : surface.vertices) {
    std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", v.x, v.y, v.z);
    text += line;
  }
  const detail::PolyMesh& m = mesh.impl().polys;
  std::size_t t = 0;
  for (std::size_t island = 0; island < m.islands.size(); ++island) {
    text.append("g island_").append(std::to_string(island)).append("\n");
    std::size_t end = t;
    for (std::uint32_t i = 0; i < m.islands[island].count; ++i) {
      end += m.polys[m.by_island[m.islands[island].first + i]].tri_count;
    }
    for (; t < end; ++t) {
      text.append("f");
      for (const std::uint32_t v : surface.triangles[t]) text.append(" ").append(std::to_string(v + 1));
      text.append("\n");
    }
  }
  return replace_file(path, text);
}

}  // namespace gsnav
