// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/scene/mesh_scene.hpp"

// Meshes for tests, and what a ray meets of them: Moeller and Trumbore's intersection in long double,
// every triangle at every pixel. It shares no formula with the rasteriser.

namespace gsnav_test {

struct MeshTruth {
  std::vector<double> depth;            ///< infinity: nothing
  std::vector<std::uint32_t> triangle;  ///< of its instance
  std::vector<std::uint8_t> undecided;  ///< another triangle, or none, is met 2e-4 px away
};

/// A point where a ray (u, v, 1) meets a triangle beyond the near plane; z: infinity where it meets
/// none.
struct MeshHit {
  long double z = std::numeric_limits<long double>::infinity();
  std::uint32_t instance = gsnav::kNoInstance, triangle = gsnav::kNoInstance;
  std::size_t place = 0;     ///< of the instance among all
  long double u = 0, v = 0;  ///< weights of corners 1 and 2
};

/// Calls f(hit) for all of them, in the order of instances and triangles.
template <class F>
void for_each_hit(const std::vector<gsnav::MeshInstance>& meshes, const gsnav::Camera& camera,
                  long double px, long double py, const F& f) {
  using V = gsnav::Vec3<long double>;
  const V ray{(px - camera.cx) / camera.fx, (py - camera.cy) / camera.fy, 1};
  const auto plain_cross = [](const V& a, const V& b) {
    return V{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  };
  const auto plain_dot = [](const V& a, const V& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const gsnav::MeshView& mesh = meshes[m].mesh;
    for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
      V p[3];
      bool finite = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const gsnav::Vec3f& v = mesh.vertices[mesh.indices[3 * t + k]];
        finite = finite && gsnav::is_finite(v);
        p[k] = gsnav::vec_cast<long double>(camera.viewmat *
                                            (meshes[m].world_from_mesh * gsnav::vec_cast<double>(v)));
      }
      if (!finite) continue;
      const V e1 = p[1] - p[0], e2 = p[2] - p[0], q = plain_cross(ray, e2);
      const long double det = plain_dot(e1, q);
      // A front turns counter-clockwise: its normal e1 x e2 points against the ray.
      if (det == 0 || (det < 0 && !mesh.two_sided)) continue;
      const V s = -p[0], r = plain_cross(s, e1);
      const long double u = plain_dot(s, q) / det, v = plain_dot(ray, r) / det,
                        z = plain_dot(e2, r) / det;
      if (u < 0 || v < 0 || u + v > 1 || z < static_cast<long double>(camera.near_plane)) continue;
      f(MeshHit{z, meshes[m].id, static_cast<std::uint32_t>(t), m, u, v});
    }
  }
}

/// The nearest.
inline MeshHit trace(const std::vector<gsnav::MeshInstance>& meshes, const gsnav::Camera& camera,
                     long double px, long double py) {
  MeshHit best;
  for_each_hit(meshes, camera, px, py, [&best](const MeshHit& hit) {
    if (hit.z < best.z) best = hit;
  });
  return best;
}

inline MeshTruth mesh_truth(const std::vector<gsnav::MeshInstance>& meshes,
                            const gsnav::Camera& camera) {
  MeshTruth truth;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const long double px = x + 0.5L, py = y + 0.5L, step = 2e-4L;
      const MeshHit hit = trace(meshes, camera, px, py);
      bool undecided = false;
      for (int k = 0; k < 4; ++k) {
        const MeshHit near = trace(meshes, camera, px + (k < 2 ? (2 * k - 1) * step : 0),
                                   py + (k < 2 ? 0 : (2 * k - 5) * step));
        undecided = undecided || near.triangle != hit.triangle || near.instance != hit.instance;
      }
      truth.depth.push_back(static_cast<double>(hit.z));
      truth.triangle.push_back(hit.triangle);
      truth.undecided.push_back(undecided ? 1 : 0);
    }
  }
  return truth;
}

inline gsnav::SurfaceMesh quad(const gsnav::Vec3f& a, const gsnav::Vec3f& b, const gsnav::Vec3f& c,
                               const gsnav::Vec3f& d) {
  gsnav::SurfaceMesh m;
  m.geometry = {{a, b, c, d}, {{0, 1, 2}, {0, 2, 3}}};
  m.two_sided = true;
  return m;
}

/// A closed sphere, seen from outside.
inline gsnav::SurfaceMesh sphere(double radius, std::uint32_t around, std::uint32_t down) {
  using std::numbers::pi;
  gsnav::SurfaceMesh m;
  const auto point = [&](double polar, double turn) {
    return gsnav::vec_cast<float>(gsnav::Vec3d{std::sin(polar) * std::cos(turn), std::cos(polar),
                                               std::sin(polar) * std::sin(turn)} *
                                  radius);
  };
  auto& vertices = m.geometry.vertices;
  vertices.push_back(point(0, 0));
  for (std::uint32_t i = 1; i < down; ++i) {
    for (std::uint32_t j = 0; j < around; ++j)
      vertices.push_back(point(pi * i / down, 2 * pi * j / around));
  }
  vertices.push_back(point(pi, 0));
  const std::uint32_t last = static_cast<std::uint32_t>(vertices.size() - 1);
  const auto at = [&](std::uint32_t i, std::uint32_t j) {
    return i == 0 ? 0 : i == down ? last : 1 + (i - 1) * around + j % around;
  };
  for (std::uint32_t i = 0; i < down; ++i) {
    for (std::uint32_t j = 0; j < around; ++j) {
      if (i > 0) m.geometry.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
      if (i + 1 < down) m.geometry.triangles.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return m;
}

/// Triangles of any shape before, beside and behind a camera at the origin that looks along +z;
/// two-sided.
inline gsnav::SurfaceMesh random_triangles(std::uint64_t seed, std::size_t count) {
  gsnav::Rng rng(seed);
  gsnav::SurfaceMesh m;
  m.two_sided = true;
  for (std::uint32_t t = 0; t < count; ++t) {
    const double z = std::pow(10.0, rng.uniform(-0.5, 1.5)),
                 size = z * std::pow(10.0, rng.uniform(-2, 0.5));
    const gsnav::Vec3d center{rng.uniform(-1, 1) * z, rng.uniform(-1, 1) * z, z};
    for (int k = 0; k < 3; ++k) {
      m.geometry.vertices.push_back(gsnav::vec_cast<float>(
          center + gsnav::Vec3d{rng.normal(), rng.normal(), rng.normal()} * size));
      m.colors.push_back(
          gsnav::vec_cast<float>(gsnav::Vec3d{rng.uniform(), rng.uniform(), rng.uniform()}));
    }
    m.geometry.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return m;
}

}  // namespace gsnav_test
