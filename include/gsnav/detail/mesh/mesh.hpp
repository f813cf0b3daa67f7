// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/image/mesh_layer.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"

// Triangle meshes as kernels read them. How they are drawn: docs/reference/composition.md.

namespace gsnav {

/// A base-colour texture and its mip chain. Owns nothing.
struct TextureView {
  /// RGBA, 8 bits each, sRGB-encoded: level 0 from its top row on, then each level of half the size
  /// (rounded down, at least 1).
  View<const std::uint8_t> texels;
  View<const float> decode;  ///< [256], the linear value of an sRGB byte
  int width = 0, height = 0, levels = 0;

  GSNAV_HD bool empty() const noexcept { return texels.empty(); }
};

/// What a surface's alpha (base, times that of vertices and of the texture) does.
enum class MeshAlpha : std::uint8_t {
  opaque,  ///< nothing
  mask,    ///< a surface where it is at least alpha_cutoff, a hole elsewhere
  blend,   ///< what is behind is seen through it
};

/// Read-only arrays of an indexed triangle mesh. Owns nothing. Metres in the mesh's own frame;
/// counter-clockwise seen from outside. Every index must be below vertices.size.
struct MeshView {
  View<const Vec3f> vertices;
  View<const std::uint32_t> indices;  ///< [3 T]
  View<const Vec3f> normals;          ///< unit, one a vertex; empty: those of the faces
  View<const Vec3f> colors;           ///< linear RGB, one a vertex; empty: white
  View<const Vec2<float>> uvs;  ///< (0, 0) is the texture's top left; one a vertex; empty: no texture
  TextureView texture;          ///< repeats; empty: white
  Vec3f base_color{1, 1, 1};    ///< linear RGB, times colours and texture
  bool two_sided = false;       ///< false: what is seen from behind is not drawn
  bool unlit = false;           ///< its colour is what is seen, whatever the light
  Vec3f low{}, high{};          ///< box of the finite vertices; low.x > high.x: not known
  MeshAlpha alpha_mode = MeshAlpha::opaque;
  float base_alpha = 1;       ///< in [0, 1]
  float alpha_cutoff = 0.5f;  ///< of MeshAlpha::mask
  View<const float> alphas;   ///< in [0, 1], one a vertex; empty: 1
  bool base_color_only =
      false;  ///< base_color is what is seen, whatever colours and texture are; alpha stays

  GSNAV_HD std::size_t triangle_count() const noexcept { return indices.size / 3; }
};

/// A mesh in the world. Moving it costs nothing: its transform is read when a frame is drawn.
struct MeshInstance {
  MeshView mesh;
  Similarity world_from_mesh{};
  std::uint32_t id = 0;  ///< what the instance image shows; below kNoInstance
};
// On the host alone (docs/architecture.md, "Sizes of arguments").
static_assert(sizeof(void*) != 8 || (sizeof(MeshView) <= 256 && sizeof(MeshInstance) <= 280));
inline constexpr std::uint32_t kNoInstance = 0xffffffffu;  ///< pixels without a mesh

/// How meshes are lit; linear RGB.
struct MeshLight {
  bool unlit = true;  ///< all colours as they are
  Vec3d ambient{0.4, 0.4, 0.4};
  Vec3d direction{0.4, 0.8, 0.4};  ///< towards the light, world; need not be of unit length
  Vec3d diffuse{0.6, 0.6, 0.6};    ///< times the cosine to the normal
};

/// How Gaussians and meshes become one image.
enum class Composite : std::uint8_t {
  merged,      ///< the contract: each Gaussian against the mesh at each pixel
  hard_depth,  ///< Habitat-GS's: a pixel is the Gaussians' or the mesh's, by their expected depth
};

/// An instance as one camera sees it.
struct MeshPlacement {
  MeshView mesh;
  Mat3d linear{};          ///< mesh axes to camera axes, scale in it
  Vec3d translation{};     ///< camera axes, metres
  Mat3<float> rotation{};  ///< mesh axes to world axes
  std::uint32_t id = 0;
  std::size_t first_vertex = 0;  ///< of its vertices among all
};

inline constexpr std::size_t kMeshChunk = 256;

/// Work items of meshes: kMeshChunk vertices or triangles of one placement, from `begin` on.
struct MeshChunk {
  std::uint32_t placement = 0, begin = 0;
  /// Where it ends, of n in all.
  GSNAV_HD std::size_t end(std::size_t n) const noexcept {
    return begin + kMeshChunk < n ? begin + kMeshChunk : n;
  }
};

}  // namespace gsnav
