// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "gsnav/core/view.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"

// Triangle meshes in the form in which kernels read them. docs/reference/composition.md describes how
// they are drawn.

namespace gsnav {

/// A base-colour texture with its mip chain. It owns nothing.
struct TextureView {
  /// RGBA, 8 bits each, sRGB-encoded, top row first. Level 0, then each further level at half the size
  /// (rounded down, at least 1).
  View<const std::uint8_t> texels;
  View<const float> decode;               ///< [256], linear value of each sRGB byte
  int width = 0, height = 0, levels = 0;  ///< Size of level 0 in pixels, and number of levels.

  /// Whether there is no texture.
  GSNAV_HD bool empty() const noexcept { return texels.empty(); }
};

/// Effect of a surface's alpha, which is the product of the base, vertex and texture alpha.
enum class MeshAlpha : std::uint8_t {
  opaque,  ///< Alpha is ignored.
  mask,    ///< The surface exists where alpha is at least alpha_cutoff and has a hole elsewhere.
  blend,   ///< The surface is see-through.
};

/// Read-only arrays of an indexed triangle mesh with T triangles. It owns nothing. Coordinates are
/// metres in the mesh's own frame; corners are counter-clockwise seen from outside. Every index must be
/// less than vertices.size.
struct MeshView {
  View<const Vec3f> vertices;         ///< [V], metres.
  View<const std::uint32_t> indices;  ///< [3 T], three corners per triangle
  View<const Vec3f> normals;          ///< one unit vector per vertex. Empty: normals of the faces.
  View<const Vec3f> colors;           ///< linear RGB, one per vertex. Empty: white.
  View<const Vec2<float>> uvs;  ///< One per vertex; (0, 0) is the texture's top left. Empty: no texture.
  TextureView texture;          ///< Repeats outside of [0, 1]. Empty: white.
  Vec3f base_color{1, 1, 1};    ///< Linear RGB; multiplied with colours and texture.
  bool two_sided = false;       ///< False: triangles seen from behind are not drawn.
  bool unlit = false;           ///< True: light does not affect the colour.
  Vec3f low{}, high{};          ///< Box of the finite vertices. low.x > high.x: unknown.
  MeshAlpha alpha_mode = MeshAlpha::opaque;  ///< How alpha is used.
  float base_alpha = 1;                      ///< in [0, 1]
  float alpha_cutoff = 0.5f;                 ///< threshold of MeshAlpha::mask
  View<const float> alphas;                  ///< in [0, 1], one per vertex. Empty: 1.
  bool base_color_only = false;  ///< True: the colour is base_color alone, without vertex colours and
                                 ///< texture. Alpha is unaffected.

  /// Number of triangles T.
  GSNAV_HD std::size_t triangle_count() const noexcept { return indices.size / 3; }
};

/// A mesh placed in the world. It can be moved at no cost: its transform is read when a frame is drawn.
struct MeshInstance {
  MeshView mesh;                 ///< The mesh.
  Similarity world_from_mesh{};  ///< Takes the mesh's frame to the world.
  std::uint32_t id = 0;          ///< value in the instance image, less than kNoInstance
};
// Host only, so the size is not limited by kernel arguments (docs/architecture.md, "Sizes of
// arguments").
static_assert(sizeof(void*) != 8 || (sizeof(MeshView) <= 256 && sizeof(MeshInstance) <= 280));
inline constexpr std::uint32_t kNoInstance = 0xffffffffu;  ///< value of pixels without a mesh

/// Light on meshes, in linear RGB.
struct MeshLight {
  bool unlit = true;               ///< True: all colours are shown as they are.
  Vec3d ambient{0.4, 0.4, 0.4};    ///< Light from everywhere.
  Vec3d direction{0.4, 0.8, 0.4};  ///< direction towards the light, world axes, of any length
  Vec3d diffuse{0.6, 0.6, 0.6};    ///< Light from `direction`, times the cosine between it
                                   ///< and the normal.
};

/// Meshes of a frame and their light.
struct MeshFrame {
  std::span<const MeshInstance> instances;  ///< instances; their arrays are in the backend's memory
  MeshLight light{};                        ///< light on all of them
};

}  // namespace gsnav
