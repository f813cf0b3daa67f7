// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
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
  GaussianCloud cloud;                                  ///< light baked in
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

/// Most Gaussians that SceneSampling::gaussians may ask for. They take 6 GB while they are made, 15 GB
/// with SH degree 3.
inline constexpr std::size_t kMostSceneGaussians = 50'000'000;

/// How finely the surfaces of a generated scene are covered with Gaussians. Gaussians are as wide as
/// their distance asks for, so surfaces stay closed; the mesh does not depend on it. Images look alike
/// from a density of 0.3 on; below, edges blur.
struct SceneSampling {
  /// Number of Gaussians, at most kMostSceneGaussians; 0: as many as `density` gives. A scene needs at
  /// least one for each of its surfaces, some ten thousand: the error says how many.
  std::size_t gaussians = 0;
  double density = 1.0;  ///< scales the number of Gaussians, [0.05, 20]; 1: about 390,000 for the flat
  /// 0 to 3. Above 0 surfaces have a sheen: they are brighter where the light of windows and lamps is
  /// mirrored, and as bright as with degree 0 on average over all directions.
  int sh_degree = 0;
  int threads = 0;                       ///< 0: one a core, at most 16. Does not change the scene.
  std::function<void(double)> progress;  ///< called with the share that is done, (0, 1], by one thread
};

/// Errors: invalid_argument naming the member.
Status validate(const SceneSampling& sampling);

/// Makes the flat; the same arguments give the same bits. Errors: invalid_argument (`sampling`),
/// out_of_memory.
Result<DefaultScene> make_default_scene(const SceneSampling& sampling);

/// The same with so dense a sampling.
Result<DefaultScene> make_default_scene(double density = 1.0);

}  // namespace gsnav
