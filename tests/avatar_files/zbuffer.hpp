// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "gsnav/detail/avatar/skinned_mesh.hpp"
#include "gsnav/image/camera.hpp"

namespace gsnav_test {

/// A picture of a mesh, pixel by pixel.
struct MeshImage {
  int width = 0, height = 0;
  std::vector<gsnav::Vec3d> rgb;  // display-referred
  std::vector<double> depth;      // planar, metres; 0: nothing
};

/// Draws posed vertices with a z-buffer, double, nearest texels, unlit. Shares no code with the
/// library's sampling of surfaces.
inline MeshImage draw_mesh(const gsnav::SkinnedMesh& mesh, const std::vector<gsnav::Vec3d>& vertices,
                           const gsnav::Camera& camera) {
  using gsnav::Vec3d;
  MeshImage out{camera.width, camera.height, {}, {}};
  const std::size_t pixels = static_cast<std::size_t>(out.width * out.height);
  out.rgb.assign(pixels, Vec3d{});
  out.depth.assign(pixels, 0.0);
  std::vector<Vec3d> seen;
  for (const Vec3d& v : vertices) seen.push_back(camera.viewmat * v);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Vec3d p[3];
    double x[3], y[3];
    bool ahead = true;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = seen[mesh.triangles[t][k]];
      ahead = ahead && p[k].z > 0.1;
      x[k] = camera.fx * p[k].x / p[k].z + camera.cx;
      y[k] = camera.fy * p[k].y / p[k].z + camera.cy;
    }
    const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (!ahead || area == 0) continue;
    const int x0 = std::max(0, static_cast<int>(std::floor(std::min({x[0], x[1], x[2]})))),
              x1 = std::min(out.width - 1, static_cast<int>(std::max({x[0], x[1], x[2]})));
    const int y0 = std::max(0, static_cast<int>(std::floor(std::min({y[0], y[1], y[2]})))),
              y1 = std::min(out.height - 1, static_cast<int>(std::max({y[0], y[1], y[2]})));
    for (int j = y0; j <= y1; ++j) {
      for (int i = x0; i <= x1; ++i) {
        const double px = i + 0.5, py = j + 0.5;
        double w[3];
        for (int k = 0; k < 3; ++k) {
          const int a = (k + 1) % 3, b = (k + 2) % 3;
          w[k] = ((x[b] - x[a]) * (py - y[a]) - (px - x[a]) * (y[b] - y[a])) / area;
        }
        if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
        const double inverse = w[0] / p[0].z + w[1] / p[1].z + w[2] / p[2].z, z = 1 / inverse;
        const std::size_t at = static_cast<std::size_t>(j * out.width + i);
        if (out.depth[at] > 0 && out.depth[at] <= z) continue;
        out.depth[at] = z;
        Vec3d color{1, 1, 1};
        const auto& material = mesh.materials.at(mesh.materials_of.empty() ? 0 : mesh.materials_of[t]);
        double uv[2] = {0, 0};
        for (std::size_t k = 0; k < 3; ++k) {
          const double share = w[k] / p[k].z * z;
          if (k == 0) color = mesh.colors.empty() ? color : Vec3d{};
          if (!mesh.colors.empty()) color += mesh.colors[mesh.triangles[t][k]] * share;
          if (!mesh.uvs.empty()) {
            uv[0] += share * mesh.uvs[mesh.triangles[t][k]][0];
            uv[1] += share * mesh.uvs[mesh.triangles[t][k]][1];
          }
        }
        for (int c = 0; c < 3; ++c) color[c] *= material.factor[c];
        for (int c = 0; c < 3; ++c)
          color[c] =
              color[c] <= 0.0031308 ? 12.92 * color[c] : 1.055 * std::pow(color[c], 1 / 2.4) - 0.055;
        if (material.texture >= 0) {
          const auto& tex = mesh.textures[static_cast<std::size_t>(material.texture)];
          std::size_t texel[2];
          const std::size_t size[2] = {tex.width, tex.height};
          for (std::size_t k = 0; k < 2; ++k) {
            const double f = uv[k] - std::floor(uv[k]);
            texel[k] = std::min(size[k] - 1, static_cast<std::size_t>(f * static_cast<double>(size[k])));
          }
          // Factors are white where there are textures in these files: a product of encoded values would
          // be wrong else.
          for (int c = 0; c < 3; ++c)
            color[c] *=
                tex.rgba[4 * (texel[1] * tex.width + texel[0]) + static_cast<std::size_t>(c)] / 255.0;
        }
        out.rgb[at] = color;
      }
    }
  }
  return out;
}

}  // namespace gsnav_test
