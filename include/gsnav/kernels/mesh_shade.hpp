// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/kernels/color_space.hpp"
#include "gsnav/kernels/mesh_raster.hpp"

// What the visible triangles look like, one pixel after the other: each is shaded once, however many triangles lie
// behind it.

namespace gsnav {

/// Images of meshes alone, in a backend's memory; a null pointer is one not asked for.
template <class S>
struct MeshImages {
  S* color = nullptr;   ///< [H][W][3], display-referred; 0 where there is no mesh
  S* normal = nullptr;  ///< [H][W][3], unit, world axes, on the camera's side; 0 where there is no mesh
  std::uint32_t* instance = nullptr;  ///< [H][W], MeshInstance::id; kNoInstance
  std::uint32_t* triangle = nullptr;  ///< [H][W], of the instance's mesh; kNoInstance

  GSNAV_HD bool empty() const noexcept {
    return color == nullptr && normal == nullptr && instance == nullptr && triangle == nullptr;
  }
};

template <class S>
struct MeshShadeArgs {
  View<const MeshPlacement> placements;
  View<const MeshTriangle<S>> triangles;
  const S* depth = nullptr;                ///< [H][W]
  const std::uint32_t* visible = nullptr;  ///< [H][W]
  std::size_t width = 0;
  bool unlit = true;
  Vec3<S> ambient{}, light{}, diffuse{};   ///< light: unit, world axes
  MeshImages<S> images;
};

namespace detail {

template <class S>
GSNAV_HD Vec3<S> mixed(const Vec3f& a, const Vec3f& b, const Vec3f& c, S wb, S wc) noexcept {
  const S wa = S(1) - wb - wc;
  const auto mix = [=](float x, float y, float z) { return fma(S(x), wa, fma(S(y), wb, S(z) * wc)); };
  return {mix(a.x, b.x, c.x), mix(a.y, b.y, c.y), mix(a.z, b.z, c.z)};
}

/// Largest whole number not above x, |x| < 2^31.
template <class S>
GSNAV_HD std::int32_t floor_of(S x) noexcept {
  const std::int32_t i = static_cast<std::int32_t>(x);
  return S(i) > x ? i - 1 : i;
}

/// Linear RGB of one level at (u, v), bilinear; `texels`: the level's first.
template <class S>
GSNAV_HD Vec3<S> sample_level(const TextureView& t, const std::uint8_t* texels, int width, int height, S u,
                              S v) noexcept {
  const S x = u * S(width) - S(0.5), y = v * S(height) - S(0.5);
  const std::int32_t x0 = floor_of(x), y0 = floor_of(y);
  const S fx = x - S(x0), fy = y - S(y0);
  const auto wrap = [](std::int32_t i, int n) { return i < 0 ? i + n : (i >= n ? i - n : i); };
  Vec3<S> sum{};
  for (int k = 0; k < 4; ++k) {
    const std::int32_t i = wrap(x0 + (k & 1), width), j = wrap(y0 + (k >> 1), height);
    const std::uint8_t* const p = texels + 4 * (std::size_t(j) * std::size_t(width) + std::size_t(i));
    const S w = ((k & 1) != 0 ? fx : S(1) - fx) * ((k >> 1) != 0 ? fy : S(1) - fy);
    sum.x = fma(w, S(t.decode[p[0]]), sum.x);
    sum.y = fma(w, S(t.decode[p[1]]), sum.y);
    sum.z = fma(w, S(t.decode[p[2]]), sum.z);
  }
  return sum;
}

/// Linear RGB at (u, v), which repeat; `footprint2`: square of how many texels of level 0 a pixel spans.
template <class S>
GSNAV_HD Vec3<S> sample_texture(const TextureView& t, S u, S v, S footprint2) noexcept {
  constexpr S kFar(1e6);  // beyond, coordinates in float mean nothing
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
  const Vec3<S> fine = sample_level(t, texels, w, h, u, v);
  const S f = level - S(lower);
  if (!(f > S(0))) return fine;
  texels += 4 * (std::size_t(w) * std::size_t(h));
  const Vec3<S> coarse = sample_level(t, texels, max(w / 2, 1), max(h / 2, 1), u, v);
  return {fma(f, coarse.x - fine.x, fine.x), fma(f, coarse.y - fine.y, fine.y), fma(f, coarse.z - fine.z, fine.z)};
}

}  // namespace detail

/// Shades one pixel.
template <class S>
GSNAV_HD void shade_mesh_pixel(const MeshShadeArgs<S>& args, std::size_t pixel) noexcept {
  const MeshImages<S>& out = args.images;
  const auto write = [pixel](S* image, const Vec3<S>& v) {
    if (image == nullptr) return;
    image[3 * pixel] = v.x;
    image[3 * pixel + 1] = v.y;
    image[3 * pixel + 2] = v.z;
  };
  const std::uint32_t id = args.visible[pixel];
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
  const std::uint32_t* const index = mesh.indices.data + 3 * std::size_t{t.triangle};
  const std::uint32_t i0 = index[0], i1 = index[1], i2 = index[2];
  const S dx = S(static_cast<int>(pixel % args.width) - t.x0), dy = S(static_cast<int>(pixel / args.width) - t.y0);
  const S z = args.depth[pixel];
  const S b1 = clamp(t.b1.at(dx, dy) * z, S(0), S(1)), b2 = clamp(t.b2.at(dx, dy) * z, S(0), S(1) - b1);

  const bool lit = !args.unlit && !mesh.unlit;
  Vec3<S> normal{};
  if (out.normal != nullptr || lit) {
    if (mesh.normals.empty()) {
      const Vec3f& v0 = mesh.vertices[i0];
      normal = cross(vec_cast<S>(mesh.vertices[i1] - v0), vec_cast<S>(mesh.vertices[i2] - v0));
    } else {
      normal = detail::mixed(mesh.normals[i0], mesh.normals[i1], mesh.normals[i2], b1, b2);
    }
    normal = mat_cast<S>(placement.rotation) * normal;
    // Relative to the largest entry, so that a small face's is not lost.
    const S largest = max(abs(normal.x), max(abs(normal.y), abs(normal.z)));
    if (largest > S(0)) {
      normal = normal * (S(1) / largest);
      normal = normal * ((t.back ? S(-1) : S(1)) / norm(normal));
    }
    write(out.normal, normal);
  }
  if (out.color == nullptr) return;

  Vec3<S> color = vec_cast<S>(mesh.base_color);
  const auto times = [&color](const Vec3<S>& c) { color = {color.x * c.x, color.y * c.y, color.z * c.z}; };
  if (!mesh.colors.empty()) times(detail::mixed(mesh.colors[i0], mesh.colors[i1], mesh.colors[i2], b1, b2));
  if (!mesh.texture.empty() && !mesh.uvs.empty()) {
    const Vec2<float> uv0 = mesh.uvs[i0], uv1 = mesh.uvs[i1], uv2 = mesh.uvs[i2];
    const Vec2<S> e1{S(uv1.x) - S(uv0.x), S(uv1.y) - S(uv0.y)}, e2{S(uv2.x) - S(uv0.x), S(uv2.y) - S(uv0.y)};
    const S u = fma(e1.x, b1, fma(e2.x, b2, S(uv0.x))), v = fma(e1.y, b1, fma(e2.y, b2, S(uv0.y)));
    // A weight is its plane over that of 1 / z.
    const auto footprint2 = [&](S b1_step, S b2_step, S inverse_z_step) {
      const S d1 = fma(-b1, inverse_z_step, b1_step) * z, d2 = fma(-b2, inverse_z_step, b2_step) * z;
      const S du = fma(e1.x, d1, e2.x * d2) * S(mesh.texture.width);
      const S dv = fma(e1.y, d1, e2.y * d2) * S(mesh.texture.height);
      return fma(du, du, dv * dv);
    };
    times(detail::sample_texture(mesh.texture, u, v,
                                 max(footprint2(t.b1.x, t.b2.x, S(t.inverse_z.x)),
                                     footprint2(t.b1.y, t.b2.y, S(t.inverse_z.y)))));
  }
  if (lit) {
    const S cosine = max(dot(normal, args.light), S(0));
    times({fma(args.diffuse.x, cosine, args.ambient.x), fma(args.diffuse.y, cosine, args.ambient.y),
           fma(args.diffuse.z, cosine, args.ambient.z)});
  }
  write(out.color, {srgb_encoded(color.x), srgb_encoded(color.y), srgb_encoded(color.z)});
}

/// Shades one row of pixels.
template <class S>
struct ShadeMeshRow {
  MeshShadeArgs<S> args;
  GSNAV_HD void operator()(std::size_t y) const noexcept {
    for (std::size_t x = 0; x < args.width; ++x) shade_mesh_pixel(args, y * args.width + x);
  }
};

}  // namespace gsnav
