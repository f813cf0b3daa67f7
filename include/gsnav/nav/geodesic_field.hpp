// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Exact geodesic distances from anywhere on a NavMesh to the nearest of fixed goals, computed once: a lookup
/// searches nothing. For rewards and distances to goal that are asked for every step of an episode.
/// Constant, so any number of threads may look up; valid for as long as its NavMesh.
class GeodesicField {
 public:
  /// Errors: invalid_argument for no goals; nothing_navigable naming a goal that is off the mesh.
  static Result<GeodesicField> make(const NavMesh& mesh, std::span<const Vec3d> goals,
                                    const SnapOptions& options = {});
  GeodesicField(GeodesicField&&) noexcept;
  GeodesicField& operator=(GeodesicField&&) noexcept;
  ~GeodesicField();

  /// Metres to the nearest goal; infinity where none is on the point's island or it has no polygon.
  double distance(const NavPoint& p) const noexcept;

 private:
  struct Impl;
  explicit GeodesicField(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gsnav
