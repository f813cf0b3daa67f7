// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/scene/textured_scene.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// The embedded flat: the scene that programs use if none is given.
///
/// World frame: metres, Y up, floor at y = 0, ceiling at 2.7; inside walls x in [0, 10], z in [0, 8].
/// Four furnished rooms are joined by five openings, so that most targets can be reached in two ways.
struct DefaultScene {
  GaussianCloud cloud;                                  ///< The Gaussians, with baked light.
  std::vector<Vec3d> vertices;                          ///< The same surfaces as a mesh, metres.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< Counter-clockwise seen from the front.
  Aabb<double> bounds{};  ///< Box of the Gaussians' means, or of the vertices of `painted`.
  /// With SurfaceKind::mesh: the same surfaces as fine triangles. `cloud` is then empty. Vertices have
  /// the colours that Gaussians would have, with baked light.
  TexturedPart painted{};
};

/// A viewpoint in the flat that shows a room.
struct DefaultView {
  const char* name;   ///< Name of the view.
  Vec3d eye, target;  ///< Position of the camera, and the point that it looks at; metres.
};

/// Viewpoints at eye level, one for each room, the living room first.
std::array<DefaultView, 4> default_scene_views() noexcept;

/// Upper limit of SceneSampling::gaussians. Making that many takes 6 GB of memory, or 15 GB with SH
/// degree 3.
inline constexpr std::size_t kMostSceneGaussians = 50'000'000;

/// Material of a generated scene.
enum class SurfaceKind {
  gaussians,  ///< Gaussians: DefaultScene::cloud.
  mesh,       ///< Triangles: DefaultScene::painted.
};

/// How densely the surfaces of a generated scene are covered with Gaussians. Gaussians are as wide as
/// their spacing requires, so surfaces stay closed; the mesh does not change. Images look alike from a
/// density of 0.3 on; below that, edges blur.
struct SceneSampling {
  /// Number of Gaussians, at most kMostSceneGaussians. 0: determined by `density`. A scene needs at
  /// least one for each of its surfaces, some ten thousand; the error names the number.
  std::size_t gaussians = 0;
  double density = 1.0;  ///< Factor on the number of Gaussians, in [0.05, 20]. 1 is about 390,000 for
                         ///< the flat.
  /// SH degree of the colours, 0 to 3. Above 0, surfaces have a sheen: they are brighter in directions
  /// that mirror the light of windows and lamps. The average over all directions is as with degree 0.
  int sh_degree = 0;
  SurfaceKind kind = SurfaceKind::gaussians;  ///< Whether Gaussians or painted triangles are made. The
                                              ///< vertices are as far apart as the Gaussians would be.
  int threads = 0;  ///< Number of threads; 0: one for each core, at most 16. Does not change the scene.
  std::function<void(double)> progress;  ///< Called with the share of work that is done, in (0, 1], by
                                         ///< one thread.
};

/// Checks the settings. Error: invalid_argument naming the member.
Status validate(const SceneSampling& sampling);

/// Makes the flat. The same arguments give the same bits. Errors: invalid_argument (`sampling`),
/// out_of_memory.
Result<DefaultScene> make_default_scene(const SceneSampling& sampling);

/// Makes the flat with SceneSampling::density set to `density`.
Result<DefaultScene> make_default_scene(double density = 1.0);

}  // namespace gsnav
