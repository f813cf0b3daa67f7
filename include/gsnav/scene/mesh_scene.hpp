// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "gsnav/detail/mesh/mesh.hpp"
#include "gsnav/detail/scene/triangle_mesh.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// A base-colour texture with its mip chain. Each texel of a level is the mean, in linear light, of the
/// texels that it covers in the finer level.
class MeshTexture {
 public:
  /// Builds a texture and its mip chain from `rgba`, [height][width][4] bytes, RGB sRGB-encoded, top row
  /// first. Sides are in [1, 32768]. Error: invalid_argument where the sizes do not fit.
  static Result<MeshTexture> make(std::size_t width, std::size_t height,
                                  std::vector<std::uint8_t> rgba) {
    constexpr std::size_t kLargest = 32768;
    if (width < 1 || height < 1 || width > kLargest || height > kLargest ||
        rgba.size() != 4 * width * height) {
      return Status(Errc::invalid_argument, "MeshTexture: " + std::to_string(width) + " x " +
                                                std::to_string(height) + " with " +
                                                std::to_string(rgba.size()) +
                                                " bytes: needs four a pixel and sides in [1, 32768]");
    }
    MeshTexture t;
    t.decode_ = linear_from_srgb_bytes<float>();
    t.width_ = static_cast<int>(width);
    t.height_ = static_cast<int>(height);
    t.texels_ = std::move(rgba);
    std::size_t from = 0;
    for (int w = t.width_, h = t.height_; w > 1 || h > 1; ++t.levels_) {
      const std::size_t next = t.texels_.size();
      t.reduce(from, w, h);
      from = next;
      w = max(w / 2, 1);
      h = max(h / 2, 1);
    }
    return t;
  }
  /// View of all levels. Valid while the texture lives.
  TextureView view() const& noexcept {
    return {view_of(texels_), {decode_.data(), decode_.size()}, width_, height_, levels_};
  }
  /// Deleted: the view would point into a temporary.
  TextureView view() const&& = delete;

 private:
  /// Appends the next coarser level to a level of w x h texels whose first texel is at `from`. If a side
  /// is odd, the last texel averages three texels instead of two.
  void reduce(std::size_t from, int w, int h) {
    const int half_w = max(w / 2, 1), half_h = max(h / 2, 1);
    for (int y = 0; y < half_h; ++y) {
      const int y1 = y + 1 == half_h ? h : 2 * y + 2;
      for (int x = 0; x < half_w; ++x) {
        const int x1 = x + 1 == half_w ? w : 2 * x + 2;
        double sum[4] = {};
        for (int j = 2 * y; j < y1; ++j) {
          for (int i = 2 * x; i < x1; ++i) {
            const std::size_t p = from + 4 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(w) +
                                              static_cast<std::size_t>(i));
            for (std::size_t c = 0; c < 3; ++c) sum[c] += static_cast<double>(decode_[texels_[p + c]]);
            sum[3] += texels_[p + 3];
          }
        }
        const double n = (y1 - 2 * y) * (x1 - 2 * x);
        for (std::size_t c = 0; c < 3; ++c) texels_.push_back(srgb_byte_from_linear(sum[c] / n));
        texels_.push_back(static_cast<std::uint8_t>(sum[3] / n + 0.5));
      }
    }
  }

  std::vector<std::uint8_t> texels_;
  std::array<float, 256> decode_{};
  int width_ = 0, height_ = 0, levels_ = 1;
};

/// A mesh with its material. Vectors that are not needed stay empty and take no memory.
struct SurfaceMesh {
  TriangleMesh geometry;         ///< Vertices and triangles.
  std::vector<Vec3f> normals;    ///< One for each vertex, unit. Empty: the normals of the faces.
  std::vector<Vec3f> colors;     ///< One for each vertex, linear RGB. Empty: white.
  std::vector<Vec2<float>> uvs;  ///< One for each vertex; (0, 0) is the top left of the texture. Empty:
                                 ///< no texture.
  std::shared_ptr<const MeshTexture> texture;  ///< Base-colour texture; null: white.
  Vec3f base_color{1, 1, 1};                   ///< Linear RGB, multiplied with the colours of vertices
                                               ///< and texture.
  /// Whether triangles are drawn from behind too.
  bool two_sided = false;
  bool unlit = false;                        ///< Whether the colour is drawn as it is, without shading.
  MeshAlpha alpha_mode = MeshAlpha::opaque;  ///< How the surface's alpha is used. It is the product of
                                             ///< base_alpha, the vertex's and the texture's alpha.
  float base_alpha = 1;                      ///< Alpha of the material, in [0, 1].
  float alpha_cutoff = 0.5f;  ///< For MeshAlpha::mask: the surface has a hole where alpha is lower.
  std::vector<float> alphas;  ///< One for each vertex, in [0, 1]. Empty: 1.
};

/// Owns meshes and makes instances of them: an instance is a view of a mesh with a transform.
class MeshScene {
 public:
  /// Adds a mesh and returns its index. Errors: invalid_argument for an index beyond the vertices,
  /// arrays whose lengths are not the number of vertices, or a base_alpha out of range; the message
  /// names the field. On an error the scene is unchanged.
  Result<std::size_t> add(SurfaceMesh mesh) {
    const std::size_t n = mesh.geometry.vertices.size();
    const BadArgument bad{"SurfaceMesh: "};
    for (std::size_t t = 0; t < mesh.geometry.triangles.size(); ++t) {
      for (const std::uint32_t i : mesh.geometry.triangles[t]) {
        if (i >= n) {
          return bad("triangle " + std::to_string(t) + " has vertex " + std::to_string(i) + " of " +
                     std::to_string(n));
        }
      }
    }
    const auto fits = [n](const auto& v) { return v.empty() || v.size() == n; };
    if (!fits(mesh.normals))
      return bad("normals: " + std::to_string(mesh.normals.size()) + " for " + std::to_string(n) +
                 " vertices");
    if (!fits(mesh.colors))
      return bad("colors: " + std::to_string(mesh.colors.size()) + " for " + std::to_string(n) +
                 " vertices");
    if (!fits(mesh.uvs))
      return bad("uvs: " + std::to_string(mesh.uvs.size()) + " for " + std::to_string(n) + " vertices");
    if (!fits(mesh.alphas))
      return bad("alphas: " + std::to_string(mesh.alphas.size()) + " for " + std::to_string(n) +
                 " vertices");
    if (!(mesh.base_alpha >= 0 && mesh.base_alpha <= 1)) {
      return bad("base_alpha = " + std::to_string(mesh.base_alpha) + ": must be in [0, 1]");
    }
    meshes_.push_back({std::move(mesh), {}, {}});
    find_box(meshes_.back());
    return meshes_.size() - 1;
  }
  /// Number of meshes.
  std::size_t size() const noexcept { return meshes_.size(); }
  /// Mesh `i`. Valid while the scene lives and no mesh is added.
  const SurfaceMesh& mesh(std::size_t i) const& noexcept { return meshes_[i].surface; }
  /// Deleted: the reference would point into a temporary.
  const SurfaceMesh& mesh(std::size_t i) const&& = delete;

  /// Views of the arrays of mesh `i`. Valid while the scene lives and no mesh is added.
  MeshView view(std::size_t i) const& noexcept {
    const Held& held = meshes_[i];
    const SurfaceMesh& m = held.surface;
    MeshView v;
    v.vertices = view_of(m.geometry.vertices);
    if (!m.geometry.triangles.empty())
      v.indices = {m.geometry.triangles.front().data(), 3 * m.geometry.triangles.size()};
    v.normals = view_of(m.normals);
    v.colors = view_of(m.colors);
    v.uvs = view_of(m.uvs);
    if (m.texture != nullptr) v.texture = m.texture->view();
    v.base_color = m.base_color;
    v.two_sided = m.two_sided;
    v.unlit = m.unlit;
    v.low = held.low;
    v.high = held.high;
    v.alpha_mode = m.alpha_mode;
    v.base_alpha = m.base_alpha;
    v.alpha_cutoff = m.alpha_cutoff;
    v.alphas = view_of(m.alphas);
    return v;
  }
  /// Deleted: the view would point into a temporary.
  MeshView view(std::size_t i) const&& = delete;
  /// An instance of mesh `i` in the world. Valid while the scene lives and no mesh is added.
  /// @param id value of the instance image where this mesh is visible, below kNoInstance.
  MeshInstance instance(std::size_t i, const Similarity& world_from_mesh = {},
                        std::uint32_t id = 0) const& noexcept {
    return {view(i), world_from_mesh, id};
  }
  /// Deleted: the instance would point into a temporary.
  MeshInstance instance(std::size_t i, const Similarity& world_from_mesh = {},
                        std::uint32_t id = 0) const&& = delete;

 private:
  struct Held {
    SurfaceMesh surface;
    Vec3f low, high;
  };
  static void find_box(Held& held) noexcept {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    held.low = {kInfinity, kInfinity, kInfinity};
    held.high = -held.low;
    for (const Vec3f& v : held.surface.geometry.vertices) {
      if (!is_finite(v)) {  // An empty box marks a mesh with vertices that are not finite: it is
                            // processed in every frame, so that its left-out triangles are counted.
        held.low = {1, 1, 1};
        held.high = {};
        return;
      }
      held.low = {min(held.low.x, v.x), min(held.low.y, v.y), min(held.low.z, v.z)};
      held.high = {max(held.high.x, v.x), max(held.high.y, v.y), max(held.high.z, v.z)};
    }
  }
  std::vector<Held> meshes_;
};

/// The arrays of a mesh in a backend's memory. Other backends than host backends get a copy. On host
/// backends nothing is copied, and the arrays that `mesh` views must outlive this object
/// (docs/reference/ownership.md).
template <Backend B>
class MeshArrays {
 public:
  /// Uploads the arrays of `mesh` where the backend has a memory of its own.
  MeshArrays(B& backend, const MeshView& mesh) : mesh_(mesh) {
    if constexpr (!is_host_backend<B>) {
      to_device(backend, mesh_.vertices, vectors_);
      to_device(backend, mesh_.indices, indices_);
      to_device(backend, mesh_.normals, vectors_);
      to_device(backend, mesh_.colors, vectors_);
      to_device(backend, mesh_.uvs, uvs_);
      to_device(backend, mesh_.texture.texels, bytes_);
      to_device(backend, mesh_.texture.decode, floats_);
      to_device(backend, mesh_.alphas, floats_);
    }
  }
  /// The mesh placed in the world. Valid while this object lives.
  MeshInstance instance(const Similarity& world_from_mesh = {}, std::uint32_t id = 0) const& noexcept {
    return {mesh_, world_from_mesh, id};
  }
  /// Deleted: the instance would point into a temporary.
  MeshInstance instance(const Similarity& world_from_mesh = {}, std::uint32_t id = 0) const&& = delete;

 private:
  template <class T>
  static void to_device(B& backend, View<const T>& v, std::vector<Buffer<T, B>>& held) {
    if (v.empty()) return;
    held.emplace_back(backend).upload(v.data, v.size);
    v = {held.back().data(), v.size};
  }
  MeshView mesh_;
  std::vector<Buffer<Vec3f, B>> vectors_;
  std::vector<Buffer<std::uint32_t, B>> indices_;
  std::vector<Buffer<Vec2<float>, B>> uvs_;
  std::vector<Buffer<std::uint8_t, B>> bytes_;
  std::vector<Buffer<float, B>> floats_;
};

}  // namespace gsnav
