// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/mesh/mesh_setup.hpp"

// Properties of a triangle's surface at a pixel: the point on it, its colour and its alpha.

namespace gsnav {

namespace detail {

template <class S>
GSNAV_HD Vec3<S> mixed(const Vec3f& a, const Vec3f& b, const Vec3f& c, S wb, S wc) noexcept {
  const S wa = S(1) - wb - wc;
  const auto mix = [=](float x, float y, float z)
                       GSNAV_INLINED { return fma(S(x), wa, fma(S(y), wb, S(z) * wc)); };
  return {mix(a.x, b.x, c.x), mix(a.y, b.y, c.y), mix(a.z, b.z, c.z)};
}

/// Largest integer <= x, for |x| < 2^31.
template <class S>
GSNAV_HD std::int32_t floor_of(S x) noexcept {
  const std::int32_t i = static_cast<std::int32_t>(x);
  return S(i) > x ? i - 1 : i;
}

}  // namespace detail

/// Part of a texture to read.
enum class Texel { color, alpha };

/// Weighted sum of texels: linear RGB, or in x the sum of alpha - 255. The latter is exactly 0 where all
/// texels are opaque.
template <Texel What, class S>
struct TexelSum {
  Vec3<S> value{};
  GSNAV_HD void add(const TextureView& t, const std::uint8_t* p, S w) noexcept {
    if constexpr (What == Texel::color) {
      value.x = fma(w, S(t.decode[p[0]]), value.x);
      value.y = fma(w, S(t.decode[p[1]]), value.y);
      value.z = fma(w, S(t.decode[p[2]]), value.z);
    } else {
      value.x = fma(w, S(p[3]) - S(255), value.x);
    }
  }
};

namespace detail {

/// Bilinear sample of one mip level at (u, v). `texels` points to the level's first texel.
template <Texel What, class S>
GSNAV_HD Vec3<S> sample_level(const TextureView& t, const std::uint8_t* texels, int width, int height,
                              S u, S v) noexcept {
  const S x = u * S(width) - S(0.5), y = v * S(height) - S(0.5);
  const std::int32_t x0 = floor_of(x), y0 = floor_of(y);
  const S fx = x - S(x0), fy = y - S(y0);
  const auto wrap = [](std::int32_t i, int n)
                        GSNAV_INLINED { return i < 0 ? i + n : (i >= n ? i - n : i); };
  TexelSum<What, S> sum;
  for (int k = 0; k < 4; ++k) {
    const std::int32_t i = wrap(x0 + (k & 1), width), j = wrap(y0 + (k >> 1), height);
    const std::uint8_t* const p = texels + 4 * (std::size_t(j) * std::size_t(width) + std::size_t(i));
    const S w = ((k & 1) != 0 ? fx : S(1) - fx) * ((k >> 1) != 0 ? fy : S(1) - fy);
    sum.add(t, p, w);
  }
  return sum.value;
}

/// Trilinear sample at (u, v), repeating. `footprint2` is the square of the number of level-0 texels
/// that a pixel spans.
template <Texel What, class S>
GSNAV_HD Vec3<S> sample_texture(const TextureView& t, S u, S v, S footprint2) noexcept {
  constexpr S kFar(1e6);  // beyond this, float coordinates have no useful fraction
  u = clamp(u, -kFar, kFar);
  v = clamp(v, -kFar, kFar);
  u = u - S(floor_of(u));
  v = v - S(floor_of(v));
  const S level = clamp(S(0.5) * log2(max(footprint2, S(1))), S(0), S(t.levels - 1));
  const int lower = static_cast<int>(level);
  const std::uint8_t* texels = t.texels.data;
  int w = t.width, h = t.height;
  for (int l = 0; l < lower; ++l) {
    texels += 4 * (std::size_t(w) * std::size_t(h));
    w = max(w / 2, 1);
    h = max(h / 2, 1);
  }
  const Vec3<S> fine = sample_level<What>(t, texels, w, h, u, v);
  const S f = level - S(lower);
  if (!(f > S(0))) return fine;
  texels += 4 * (std::size_t(w) * std::size_t(h));
  const Vec3<S> coarse = sample_level<What>(t, texels, max(w / 2, 1), max(h / 2, 1), u, v);
  return {fma(f, coarse.x - fine.x, fine.x), fma(f, coarse.y - fine.y, fine.y),
          fma(f, coarse.z - fine.z, fine.z)};
}

}  // namespace detail

/// Point of a triangle that a pixel shows.
template <class S>
struct SurfacePoint {
  std::uint32_t corner[3];  ///< indices of the mesh's vertices
  S b1, b2;                 ///< weights of corners 1 and 2
  S z;                      ///< planar z, metres
};

/// Surface point at the pixel (x, y) of a triangle's box, at depth z.
template <class S>
GSNAV_HD SurfacePoint<S> surface_point(const MeshView& mesh, const MeshTriangle<S>& t, int x, int y,
                                       S z) noexcept {
  const std::uint32_t* const index = mesh.indices.data + 3 * std::size_t{t.triangle};
  const S dx = S(x - t.x0), dy = S(y - t.y0);
  const S b1 = clamp(t.b1.at(dx, dy) * z, S(0), S(1));
  return {{index[0], index[1], index[2]}, b1, clamp(t.b2.at(dx, dy) * z, S(0), S(1) - b1), z};
}

/// Sample of the mesh's texture at a surface point. The mesh must have a texture.
template <Texel What, class S>
GSNAV_HD Vec3<S> surface_texel(const MeshView& mesh, const MeshTriangle<S>& t,
                               const SurfacePoint<S>& at) noexcept {
  const Vec2<float> uv0 = mesh.uvs[at.corner[0]], uv1 = mesh.uvs[at.corner[1]],
                    uv2 = mesh.uvs[at.corner[2]];
  const Vec2<S> e1{S(uv1.x) - S(uv0.x), S(uv1.y) - S(uv0.y)},
      e2{S(uv2.x) - S(uv0.x), S(uv2.y) - S(uv0.y)};
  const S u = fma(e1.x, at.b1, fma(e2.x, at.b2, S(uv0.x))),
          v = fma(e1.y, at.b1, fma(e2.y, at.b2, S(uv0.y)));
  // A weight is its plane divided by that of 1 / z, hence the quotient rule.
  const auto footprint2 = [&](S b1_step, S b2_step, S inverse_z_step) GSNAV_INLINED {
    const S d1 = fma(-at.b1, inverse_z_step, b1_step) * at.z,
            d2 = fma(-at.b2, inverse_z_step, b2_step) * at.z;
    const S du = fma(e1.x, d1, e2.x * d2) * S(mesh.texture.width);
    const S dv = fma(e1.y, d1, e2.y * d2) * S(mesh.texture.height);
    return fma(du, du, dv * dv);
  };
  return detail::sample_texture<What>(
      mesh.texture, u, v,
      max(footprint2(t.b1.x, t.b2.x, S(t.inverse_z.x)), footprint2(t.b1.y, t.b2.y, S(t.inverse_z.y))));
}

/// Colour of the surface before lighting, linear RGB.
template <class S>
GSNAV_HD Vec3<S> surface_color(const MeshView& mesh, const MeshTriangle<S>& t,
                               const SurfacePoint<S>& at) noexcept {
  Vec3<S> color = vec_cast<S>(mesh.base_color);
  if (mesh.base_color_only) return color;
  const auto times = [&color](const Vec3<S>& c) GSNAV_INLINED {
    color = {color.x * c.x, color.y * c.y, color.z * c.z};
  };
  if (!mesh.colors.empty()) {
    times(detail::mixed(mesh.colors[at.corner[0]], mesh.colors[at.corner[1]], mesh.colors[at.corner[2]],
                        at.b1, at.b2));
  }
  if (!mesh.texture.empty() && !mesh.uvs.empty()) times(surface_texel<Texel::color>(mesh, t, at));
  return color;
}

/// Alpha of the surface in [0, 1]; 0 if it is NaN.
template <class S>
GSNAV_HD S surface_alpha(const MeshView& mesh, const MeshTriangle<S>& t,
                         const SurfacePoint<S>& at) noexcept {
  S alpha = S(mesh.base_alpha);
  if (!mesh.alphas.empty()) {
    const S wa = S(1) - at.b1 - at.b2;
    alpha = alpha * fma(S(mesh.alphas[at.corner[0]]), wa,
                        fma(S(mesh.alphas[at.corner[1]]), at.b1, S(mesh.alphas[at.corner[2]]) * at.b2));
  }
  if (!mesh.texture.empty() && !mesh.uvs.empty()) {
    alpha = alpha * ((surface_texel<Texel::alpha>(mesh, t, at).x + S(255)) / S(255));
  }
  return alpha > S(0) ? min(alpha, S(1)) : S(0);
}

/// True if a MeshAlpha::mask surface has a hole at the pixel.
template <class S>
GSNAV_HD bool surface_hole(const MeshView& mesh, const MeshTriangle<S>& t, int x, int y, S z) noexcept {
  return !(surface_alpha(mesh, t, surface_point(mesh, t, x, y, z)) >= S(mesh.alpha_cutoff));
}

/// Unit normal at a surface point, in world axes, facing the camera.
template <class S>
GSNAV_HD Vec3<S> surface_normal(const MeshPlacement& placement, const MeshTriangle<S>& t,
                                const SurfacePoint<S>& at) noexcept {
  const MeshView& mesh = placement.mesh;
  Vec3<S> normal;
  if (mesh.normals.empty()) {
    const Vec3f& v0 = mesh.vertices[at.corner[0]];
    normal = cross(vec_cast<S>(mesh.vertices[at.corner[1]] - v0),
                   vec_cast<S>(mesh.vertices[at.corner[2]] - v0));
  } else {
    normal = detail::mixed(mesh.normals[at.corner[0]], mesh.normals[at.corner[1]],
                           mesh.normals[at.corner[2]], at.b1, at.b2);
  }
  normal = mat_cast<S>(placement.rotation) * normal;
  // Divide by the largest component first, so that the normal of a small face does not underflow.
  const S largest = max(abs(normal.x), max(abs(normal.y), abs(normal.z)));
  if (largest > S(0)) {
    normal = normal * (S(1) / largest);
    normal = normal * ((t.back ? S(-1) : S(1)) / norm(normal));
  }
  return normal;
}

}  // namespace gsnav
