// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Geodesic distances from anywhere on a NavMesh to the nearest of fixed goals, exact or to a chosen
/// error, computed once: a lookup searches nothing. For rewards and distances to goal that are asked for
/// every step of an episode.
///
/// A face of the surface is cut into cells when a lookup first falls on it (microseconds, once a face);
/// the values do not depend on who asks, or in which order. Any number of threads may look up; valid for
/// as long as its NavMesh. Memory: 56 bytes a window of the search, of which a face has 2 to 16; for
/// faces that were looked up on at most 17 times that, four or five times on hills.
class GeodesicField {
 public:
  /// Distances are at most `relative_error` (0 to 0.1) above the exact ones, in parts of them, and never
  /// below; 0 is exact to rounding. Errors: invalid_argument for no goals or another relative error;
  /// nothing_navigable naming a goal that is off the mesh.
  static Result<GeodesicField> make(const NavMesh& mesh, std::span<const Vec3d> goals,
                                    const SnapOptions& options = {}, double relative_error = 0.0);
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
