// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/math/curves.hpp"
#include "gsnav/detail/mesh/mesh_raster.hpp"

// Shading of visible triangles. Each pixel is shaded once, regardless of how many triangles lie behind
// it.

namespace gsnav {

/// Images of the meshes alone, in a backend's memory. Null pointers are images that are not requested.
template <class S>
struct MeshImages {
  S* color = nullptr;   ///< [H][W][3], sRGB-encoded; 0 where there is no mesh
  S* normal = nullptr;  ///< [H][W][3], unit vectors in world axes, facing the camera; 0 where there is
                        ///< no mesh
  std::uint32_t* instance = nullptr;  ///< [H][W], MeshInstance::id; kNoInstance where there is no mesh
  std::uint32_t* triangle = nullptr;  ///< [H][W], index of the triangle in its mesh; kNoInstance where
                                      ///< there is no mesh

  GSNAV_HD bool empty() const noexcept {
    return color == nullptr && normal == nullptr && instance == nullptr && triangle == nullptr;
  }
};

/// Arguments of shading.
template <class S>
struct MeshShadeArgs {
  View<const MeshPlacement> placements;
  View<const MeshTriangle<S>> triangles;
  const S* depth = nullptr;                ///< [H][W]
  const std::uint32_t* visible = nullptr;  ///< [H][W]
  std::size_t width = 0;
  bool unlit = true;
  Vec3<S> ambient{}, light{}, diffuse{};  ///< light is a unit vector in world axes, towards the light
  MeshImages<S> images;

  GSNAV_HD bool lights(const MeshView& mesh) const noexcept { return !unlit && !mesh.unlit; }
};

/// Colour of a surface point, sRGB-encoded. `normal` is read only if the mesh is lit.
template <class S>
GSNAV_HD Vec3<S> shaded_color(const MeshShadeArgs<S>& args, const MeshView& mesh,
                              const MeshTriangle<S>& t, const SurfacePoint<S>& at,
                              const Vec3<S>& normal) noexcept {
  Vec3<S> color = surface_color(mesh, t, at);
  if (args.lights(mesh)) {
    const S cosine = max(dot(normal, args.light), S(0));
    color = {color.x * fma(args.diffuse.x, cosine, args.ambient.x),
             color.y * fma(args.diffuse.y, cosine, args.ambient.y),
             color.z * fma(args.diffuse.z, cosine, args.ambient.z)};
  }
  return {srgb_encoded(color.x), srgb_encoded(color.y), srgb_encoded(color.z)};
}

/// Shades one pixel that shows triangle `id` (or kNoTriangle) at `depth`.
template <class S>
GSNAV_HD void shade_mesh_pixel(const MeshShadeArgs<S>& args, std::size_t pixel, std::uint32_t id,
                               S depth) noexcept {
  const MeshImages<S>& out = args.images;
  const auto write = [pixel](S* image, const Vec3<S>& v) GSNAV_INLINED {
    if (image == nullptr) return;
    image[3 * pixel] = v.x;
    image[3 * pixel + 1] = v.y;
    image[3 * pixel + 2] = v.z;
  };
  if (id == kNoTriangle) {
    if (out.triangle != nullptr) out.triangle[pixel] = kNoInstance;
    if (out.instance != nullptr) out.instance[pixel] = kNoInstance;
    write(out.color, {});
    write(out.normal, {});
    return;
  }
  const MeshTriangle<S>& t = args.triangles[id];
  if (out.triangle != nullptr) out.triangle[pixel] = t.triangle;
  if (out.instance != nullptr) out.instance[pixel] = args.placements[t.placement].id;
  if (out.color == nullptr && out.normal == nullptr) return;

  const MeshPlacement& placement = args.placements[t.placement];
  const MeshView& mesh = placement.mesh;
  const SurfacePoint<S> at = surface_point(mesh, t, static_cast<int>(pixel % args.width),
                                           static_cast<int>(pixel / args.width), depth);
  Vec3<S> normal{};
  if (out.normal != nullptr || args.lights(mesh)) {
    normal = surface_normal(placement, t, at);
    write(out.normal, normal);
  }
  if (out.color != nullptr) write(out.color, shaded_color(args, mesh, t, at, normal));
}

template <class S>
GSNAV_HD void shade_mesh_pixel(const MeshShadeArgs<S>& args, std::size_t pixel) noexcept {
  shade_mesh_pixel(args, pixel, args.visible[pixel], args.depth[pixel]);
}

/// Kernel that shades one row of pixels.
template <class S>
struct ShadeMeshRow {
  MeshShadeArgs<S> args;
  GSNAV_HD void operator()(std::size_t y) const noexcept {
    for (std::size_t x = 0; x < args.width; ++x) shade_mesh_pixel(args, y * args.width + x);
  }
};

}  // namespace gsnav
