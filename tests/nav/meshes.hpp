// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav_test {

/// Triangles for tests.
struct Soup {
  std::vector<gsnav::Vec3d> vertices;
  std::vector<gsnav::NavMesh::Triangle> triangles;

  /// Adds the quad a b c d, counter-clockwise from its outer side.
  void quad(const gsnav::Vec3d& a, const gsnav::Vec3d& b, const gsnav::Vec3d& c, const gsnav::Vec3d& d) {
    const auto n = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), {a, b, c, d});
    triangles.push_back({n, n + 1, n + 2});
    triangles.push_back({n, n + 2, n + 3});
  }
  /// A walkable rectangle at height y.
  void floor(double x0, double z0, double x1, double z1, double y = 0) {
    quad({x0, y, z0}, {x0, y, z1}, {x1, y, z1}, {x1, y, z0});
  }
  /// A closed box.
  void box(double x0, double z0, double x1, double z1, double y0, double y1) {
    floor(x0, z0, x1, z1, y1);
    quad({x0, y0, z0}, {x0, y1, z0}, {x1, y1, z0}, {x1, y0, z0});
    quad({x1, y0, z1}, {x1, y1, z1}, {x0, y1, z1}, {x0, y0, z1});
    quad({x0, y0, z1}, {x0, y1, z1}, {x0, y1, z0}, {x0, y0, z0});
    quad({x1, y0, z0}, {x1, y1, z0}, {x1, y1, z1}, {x1, y0, z1});
  }
};

/// The NavMesh of a soup.
inline gsnav::NavMesh build(const Soup& soup, const gsnav::NavMeshSettings& settings = {},
                            int threads = 2) {
  return gsnav::NavMesh::build(settings, soup.vertices, soup.triangles, threads).value();
}
/// The NavMesh of a soup with default settings but for the sizes of cells and tiles.
inline gsnav::NavMesh build_cells(const Soup& soup, double cell = 0.1, int tile_size = 0) {
  gsnav::NavMeshSettings s;
  s.cell_size = cell;
  s.tile_size = tile_size;
  return build(soup, s);
}

/// A square floor from the origin with boxes of random place and size on it.
inline Soup random_boxes(std::uint64_t seed, int count, double side) {
  Soup soup;
  soup.floor(0, 0, side, side);
  gsnav::Rng rng(seed);
  for (int i = 0; i < count; ++i) {
    const double x = rng.uniform(0.5, side - 2), z = rng.uniform(0.5, side - 2);
    // One after the other: the order in which arguments are evaluated is the compiler's.
    const double depth = rng.uniform(0.1, 1.5), width = rng.uniform(0.1, 2.5);
    soup.box(x, z, x + width, z + depth, 0, 2);
  }
  return soup;
}

/// Positions and faces of a Wavefront OBJ file (positive indices); empty where it cannot be read.
inline Soup read_obj(const std::string& path) {
  Soup soup;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string tag;
    words >> tag;
    if (tag == "v") {
      gsnav::Vec3d p;
      words >> p.x >> p.y >> p.z;
      soup.vertices.push_back(p);
    } else if (tag == "f") {
      std::vector<std::uint32_t> face;
      for (std::string w; words >> w;) face.push_back(static_cast<std::uint32_t>(std::stoul(w)) - 1);
      for (std::size_t k = 2; k < face.size(); ++k)
        soup.triangles.push_back({face[0], face[k - 1], face[k]});
    }
  }
  return soup;
}

}  // namespace gsnav_test
