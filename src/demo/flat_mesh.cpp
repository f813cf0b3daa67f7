// SPDX-License-Identifier: Apache-2.0
// Turns painted surfaces into a mesh whose vertices have the colours that Gaussians have there.
#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "flat_patch.hpp"
#include "gsnav/detail/core/run_guarded.hpp"

namespace gsnav::flat {

Vec3d Painter::shown(const Patch& patch, const PatchLight* light, double s, double t,
                     const Vec3d& normal) const {
  Vec3d color = patch.color(s, t);
  if (light != nullptr) {
    Vec3d incoming = light->at(s, t);
    if (sun_at(rooms_[patch.room], patch.position(s, t), normal)) incoming += Vec3d{2.3, 2.0, 1.5} * 0.8;
    color = {color.x * incoming.x, color.y * incoming.y, color.z * incoming.z};
  }
  return {display(color.x), display(color.y), display(color.z)};
}

void Painter::emit_painted(const Patch& patch, double stretch, TexturedPart& out) const {
  const double length_t = column_length(patch.position, 0.5, patch.flat);
  const double widest = widest_row(patch.position, patch.flat);
  const int rows = std::max(count_for(length_t, patch.spacing.v * stretch), patch.cells_t);
  const int columns = std::max(count_for(widest, patch.spacing.u * stretch), patch.cells_s);
  std::optional<PatchLight> light;
  if (!patch.glows) light.emplace(*this, patch, widest, length_t);
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const double s = static_cast<double>(i) / columns, t = static_cast<double>(j) / rows;
      const Vec3d color =
          shown(patch, light ? &*light : nullptr, s, t, tangents(patch.position, s, t).normal);
      out.geometry.vertices.push_back(vec_cast<float>(patch.position(s, t)));
      out.colors.push_back(vec_cast<float>(
          Vec3d{linear_from_srgb(color.x), linear_from_srgb(color.y), linear_from_srgb(color.z)}));
    }
  }
  const auto width = static_cast<std::uint32_t>(columns + 1);
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(rows); ++j) {
    for (std::uint32_t a = j * width; a + 1 < (j + 1) * width; ++a) {
      out.geometry.triangles.push_back({a, a + 1, a + width + 1});
      out.geometry.triangles.push_back({a, a + width + 1, a + width});
    }
  }
}

Status Painter::emit_painted(const PatchSplit& cut, const SceneSampling& sampling, ThreadPool& pool,
                             DefaultScene& scene) const {
  std::vector<TexturedPart> made(patches_.size());
  const Status s = detail::run_guarded(pool, static_cast<std::uint32_t>(patches_.size()),
                                       [&](std::uint32_t p) -> Status {
                                         emit_painted(patches_[p], cut.stretch, made[p]);
                                         return {};
                                       });
  if (!s) return s;
  TexturedPart& all = scene.painted;
  for (const TexturedPart& patch : made) {
    const auto first = static_cast<std::uint32_t>(all.geometry.vertices.size());
    all.geometry.vertices.insert(all.geometry.vertices.end(), patch.geometry.vertices.begin(),
                                 patch.geometry.vertices.end());
    all.colors.insert(all.colors.end(), patch.colors.begin(), patch.colors.end());
    for (const auto& [a, b, c] : patch.geometry.triangles) {
      all.geometry.triangles.push_back({first + a, first + b, first + c});
    }
  }
  for (const Vec3f& v : all.geometry.vertices) scene.bounds.add(vec_cast<double>(v));
  all.material.unlit = true;  // The light is part of the colours.
  all.material.double_sided = true;
  if (sampling.progress) sampling.progress(1.0);
  return {};
}

}  // namespace gsnav::flat
