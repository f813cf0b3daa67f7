// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/try_step.hpp"

namespace gsnav {

std::optional<NavPoint> try_step(const NavMesh& mesh, const Vec3d& start, const Vec3d& end, bool slide,
                                 const SnapOptions& options) {
  if (!is_finite(end)) return std::nullopt;
  const std::optional<NavPoint> from = mesh.snap_point(start, options);
  if (!from) return std::nullopt;
  const SurfaceWalk walk = mesh.walk(*from, end - from->position, slide);
  if (walk.points.empty()) return std::nullopt;
  return NavPoint{walk.points.back().position, walk.points.back().poly};
}

}  // namespace gsnav
