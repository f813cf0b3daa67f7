// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/mesh_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "gsnav/detail/math/curves.hpp"

namespace gsnav {

MeshColors::MeshColors(const SkinnedMesh& mesh)
    : mesh_(mesh), linear_(linear_from_srgb_bytes<double>()) {}

SurfaceColor MeshColors::color(std::size_t t, const Vec3d& at) const {
  const auto& corners = mesh_.triangles[t];
  SurfaceColor out;
  if (!mesh_.colors.empty()) {
    out.rgb = mesh_.colors[corners[0]] * at.x + mesh_.colors[corners[1]] * at.y +
              mesh_.colors[corners[2]] * at.z;
  }
  if (mesh_.materials.empty()) return out;
  const SurfaceMaterial& material =
      mesh_.materials[mesh_.materials_of.empty() ? 0 : mesh_.materials_of[t]];
  for (int k = 0; k < 3; ++k) out.rgb[k] *= material.factor[k];
  if (material.texture < 0 || mesh_.uvs.empty()) return out;
  double u = 0, v = 0;
  for (int k = 0; k < 3; ++k) {
    const auto& uv = mesh_.uvs[corners[static_cast<std::size_t>(k)]];
    u += uv[0] * at[k];
    v += uv[1] * at[k];
  }
  const std::array<double, 4> texel =
      sample(mesh_.textures[static_cast<std::size_t>(material.texture)], u, v);
  for (int k = 0; k < 3; ++k) out.rgb[k] *= texel[static_cast<std::size_t>(k)];
  out.hole = texel[3] < material.alpha_cutoff;
  return out;
}

std::array<double, 4> MeshColors::sample(const TextureImage& t, double u, double v) const {
  const double x = u * static_cast<double>(t.width) - 0.5, y = v * static_cast<double>(t.height) - 0.5;
  const double fx = x - std::floor(x), fy = y - std::floor(y);
  const auto wrap = [](double i, std::size_t n) {
    const double m = i - std::floor(i / static_cast<double>(n)) * static_cast<double>(n);
    return std::min(static_cast<std::size_t>(m), n - 1);
  };
  std::array<double, 4> out{};
  for (int corner = 0; corner < 4; ++corner) {
    const int dx = corner & 1, dy = corner >> 1;
    const double w = (dx != 0 ? fx : 1 - fx) * (dy != 0 ? fy : 1 - fy);
    const std::uint8_t* p =
        &t.rgba[4 * (wrap(std::floor(y) + dy, t.height) * t.width + wrap(std::floor(x) + dx, t.width))];
    for (std::size_t k = 0; k < 3; ++k) out[k] += w * linear_[p[k]];
    out[3] += w * p[3] / 255.0;
  }
  return out;
}

}  // namespace gsnav
