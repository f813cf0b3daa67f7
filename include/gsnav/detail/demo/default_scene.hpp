// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// The embedded flat: what runs where no scene was given.
///
/// World frame: metres, Y up, floor at y = 0, ceiling at 2.7; inside walls x in [0, 10], z in [0, 8].
/// Four furnished rooms joined by five openings, so that most targets can be reached two ways.
struct DefaultScene {
  GaussianCloud cloud;                                  ///< SH degree 0, light baked in
  std::vector<Vec3d> vertices;                          ///< the same surfaces as a mesh
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from the front
  Aabb<double> bounds{};                                ///< of the Gaussians' means
};

/// A viewpoint in the flat that shows a room.
struct DefaultView {
  const char* name;
  Vec3d eye, target;
};

/// Eye-level viewpoints, one a room, the living room first.
std::array<DefaultView, 4> default_scene_views() noexcept;

/// Makes the flat; the same arguments give the same bits. `density` scales the number of Gaussians
/// (1: about 390,000) and widens them to match, so that surfaces stay closed; the mesh does not
/// depend on it. Errors: invalid_argument where density is not in [0.05, 20].
Result<DefaultScene> make_default_scene(double density = 1.0);

}  // namespace gsnav
