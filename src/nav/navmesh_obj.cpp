// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "gsnav/core/replace_file.hpp"
#include "gsnav/nav/navmesh_file.hpp"
#include "navmesh_impl.hpp"

namespace gsnav {

Status save_navmesh_obj(const NavMesh& mesh, const std::filesystem::path& path) {
  const detail::PolyMesh& m = mesh.impl().polys;
  const Vec3d origin = mesh.impl().origin;
  std::map<std::array<double, 3>, std::size_t> numbers;  // from 1
  std::string vertices, faces;
  char line[128];
  for (std::size_t island = 0; island < m.islands.size(); ++island) {
    faces.append("g island_").append(std::to_string(island)).append("\n");
    const auto& is = m.islands[island];
    for (std::uint32_t i = is.first; i < is.first + is.count; ++i) {
      const detail::PolyMesh::Poly& p = m.polys[m.by_island[i]];
      for (std::uint32_t t = p.tri_first; t < p.tri_first + p.tri_count; ++t) {
        faces.append("f");
        std::array<Vec3d, 3> v = m.triangle(m.tris[t]);
        if (cross(v[1] - v[0], v[2] - v[0]).y < 0) std::swap(v[1], v[2]);  // facing up
        for (const Vec3d& q : v) {
          const auto [it, added] = numbers.try_emplace({q.x, q.y, q.z}, numbers.size() + 1);
          if (added) {
            const Vec3d w = q + origin;
            std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", w.x, w.y, w.z);
            vertices += line;
          }
          faces.append(" ").append(std::to_string(it->second));
        }
        faces.append("\n");
      }
    }
  }
  return replace_file(path, vertices + faces);
}

}  // namespace gsnav
