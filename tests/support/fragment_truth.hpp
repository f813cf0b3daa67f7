// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "gsnav/detail/eval/oracle_config.hpp"
#include "support/mesh_truth.hpp"

// What the pixels of an image see of meshes, some of them seen through, from rays in long double. It
// shares no formula with the rasteriser; surfaces have vertex colours and alphas, no textures and no
// light.

namespace gsnav_test {

struct FragmentTruth {
  gsnav::eval::OracleMesh mesh;
  std::vector<std::uint8_t>
      undecided;         ///< other triangles are met 2e-4 px away, or two 1e-6 m from one another
  std::size_t most = 0;  ///< fragments of a pixel
};

inline double encoded_truth(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

inline FragmentTruth fragment_truth(const std::vector<gsnav::MeshInstance>& meshes,
                                    const gsnav::Camera& camera) {
  using namespace gsnav;
  const auto weighted = [](const MeshHit& h, double a, double b, double c) {
    return (1 - static_cast<double>(h.u) - static_cast<double>(h.v)) * a + static_cast<double>(h.u) * b +
           static_cast<double>(h.v) * c;
  };
  const auto alpha_of = [&](const MeshHit& h) {
    const MeshView& m = meshes[h.place].mesh;
    const std::uint32_t* const i = m.indices.data + 3 * std::size_t{h.triangle};
    const auto at = [&m](std::uint32_t v) { return static_cast<double>(m.alphas[v]); };
    const double a = static_cast<double>(m.base_alpha) *
                     (m.alphas.empty() ? 1.0 : weighted(h, at(i[0]), at(i[1]), at(i[2])));
    return std::clamp(a, 0.0, 1.0);
  };
  const auto color_of = [&](const MeshHit& h) {
    const MeshView& m = meshes[h.place].mesh;
    const std::uint32_t* const i = m.indices.data + 3 * std::size_t{h.triangle};
    Vec3d c = vec_cast<double>(m.base_color);
    for (int k = 0; k < 3; ++k) {
      const auto at = [&](std::uint32_t v) { return static_cast<double>(m.colors[v][k]); };
      c[k] = encoded_truth(c[k] * (m.colors.empty() ? 1.0 : weighted(h, at(i[0]), at(i[1]), at(i[2]))));
    }
    return c;
  };
  const auto all_hits = [&](long double px, long double py) {
    std::vector<MeshHit> hits;
    for_each_hit(meshes, camera, px, py, [&hits](const MeshHit& h) { hits.push_back(h); });
    std::stable_sort(hits.begin(), hits.end(),
                     [](const MeshHit& a, const MeshHit& b) { return a.z < b.z; });
    return hits;
  };
  FragmentTruth out;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const long double px = x + 0.5L, py = y + 0.5L, step = 2e-4L;
      const std::vector<MeshHit> hits = all_hits(px, py);
      bool undecided = false;
      for (int k = 0; k < 4; ++k) {
        const auto near =
            all_hits(px + (k < 2 ? (2 * k - 1) * step : 0), py + (k < 2 ? 0 : (2 * k - 5) * step));
        undecided = undecided || !std::equal(near.begin(), near.end(), hits.begin(), hits.end(),
                                             [](const MeshHit& a, const MeshHit& b) {
                                               return a.place == b.place && a.triangle == b.triangle;
                                             });
      }
      double opaque = std::numeric_limits<double>::infinity();
      Vec3d rgb{};
      std::vector<eval::OracleFragment> fragments;
      double last = -1;
      for (const MeshHit& h : hits) {
        const MeshView& m = meshes[h.place].mesh;
        const double z = static_cast<double>(h.z), alpha = alpha_of(h);
        undecided = undecided || (z > last && z - last < 1e-6 * z);
        last = z;
        if (m.alpha_mode == MeshAlpha::blend) {
          if (alpha > 0) fragments.push_back({z, alpha, color_of(h)});
          continue;
        }
        if (m.alpha_mode == MeshAlpha::mask) {
          undecided = undecided || std::abs(alpha - static_cast<double>(m.alpha_cutoff)) < 1e-5;
          if (alpha < static_cast<double>(m.alpha_cutoff)) continue;
        }
        opaque = z;
        rgb = color_of(h);
        break;
      }
      out.most = std::max(out.most, fragments.size());
      out.mesh.depth.push_back(opaque);
      for (int k = 0; k < 3; ++k) out.mesh.rgb.push_back(rgb[k]);
      out.mesh.fragments.push_back(std::move(fragments));
      out.undecided.push_back(undecided ? 1 : 0);
    }
  }
  return out;
}

}  // namespace gsnav_test
