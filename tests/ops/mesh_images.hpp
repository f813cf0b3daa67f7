// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/detail/render/draw_meshes.hpp"
#include "gsnav/scene/mesh_scene.hpp"
#include "ops/backends.hpp"
#include "support/mesh_truth.hpp"

namespace gsnav_test {

/// A camera at the origin that looks along z.
inline gsnav::Camera mesh_lens(int width = 64, int height = 48, double f = 40) {
  gsnav::Camera c;
  c.width = width;
  c.height = height;
  c.fx = c.fy = f;
  c.cx = 0.5 * width;
  c.cy = 0.5 * height;
  c.near_plane = 0.05;
  return c;
}

/// Every image of meshes, in host memory.
template <class S>
struct MeshPictures {
  std::vector<S> depth, tile_far, color, normal;
  std::vector<std::uint32_t> instance, triangle;
  gsnav::MeshStats stats;

  bool operator==(const MeshPictures& o) const {
    return depth == o.depth && color == o.color && normal == o.normal && instance == o.instance &&
           triangle == o.triangle;
  }
};

template <class S, gsnav::Backend B>
MeshPictures<S> draw(B& backend, const std::vector<gsnav::MeshInstance>& meshes,
                     const gsnav::Camera& camera, const gsnav::MeshLight& light = {},
                     int tile_size = 16) {
  using namespace gsnav;
  std::vector<MeshArrays<B>> arrays;
  std::vector<MeshInstance> instances;
  arrays.reserve(meshes.size());
  for (const MeshInstance& m : meshes) {
    instances.push_back(arrays.emplace_back(backend, m.mesh).instance(m.world_from_mesh, m.id));
  }
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  Buffer<S, B> color(backend), normal(backend);
  Buffer<std::uint32_t, B> instance(backend), triangle(backend);
  color.resize_discard(3 * pixels);
  normal.resize_discard(3 * pixels);
  instance.resize_discard(pixels);
  triangle.resize_discard(pixels);
  MeshWorkspace<S, B> ws(backend);
  MeshPictures<S> out{};
  const Status s =
      draw_meshes<S>(backend, ws, std::span<const MeshInstance>(instances), camera, light, tile_size,
                     false, {color.data(), normal.data(), instance.data(), triangle.data()}, &out.stats);
  s.throw_if_error();
  const auto fetch = [](auto& to, const auto& from) {
    to.resize(from.size());
    from.download(to.data(), from.size());
  };
  fetch(out.depth, ws.depth);
  fetch(out.tile_far, ws.tile_far);
  fetch(out.color, color);
  fetch(out.normal, normal);
  fetch(out.instance, instance);
  fetch(out.triangle, triangle);
  return out;
}

/// One mesh standing in the world, kept alive.
struct OneMesh {
  explicit OneMesh(gsnav::SurfaceMesh mesh, const gsnav::Similarity& place = {}, std::uint32_t id = 7) {
    scene.add(std::move(mesh)).value();
    instances.push_back(scene.instance(0, place, id));
  }
  gsnav::MeshScene scene;
  std::vector<gsnav::MeshInstance> instances;
};

}  // namespace gsnav_test
