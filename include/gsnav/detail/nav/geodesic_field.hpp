// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Precomputed distances along a NavMesh from any point to the nearest of fixed goals. A lookup needs no
/// search, which suits rewards and distances that are evaluated in every step of an episode.
///
/// Distances are exact, or accurate to a chosen relative error. A face of the surface is divided into
/// cells at its first lookup, which takes microseconds. Values do not depend on the order of lookups.
/// Lookups are thread-safe. The NavMesh must outlive the field. Memory: 56 bytes per window of the
/// search (2 to 16 windows per face), plus up to 17 times that for faces that were looked up (four to
/// five times on hills).
class GeodesicField {
 public:
  /// Computes the field.
  /// @param mesh Mesh of the field. It must outlive the field.
  /// @param goals Goals, world coordinates, metres.
  /// @param options Limits of snapping the goals to the mesh.
  /// @param relative_error Distances are never below the exact ones, and at most this fraction above
  /// them. 0 to 0.1; 0 is exact up to rounding.
  /// @return invalid_argument if there are no goals or the error is out of range; nothing_navigable,
  /// with the goal, if a goal is off the mesh.
  static Result<GeodesicField> make(const NavMesh& mesh, std::span<const Vec3d> goals,
                                    const SnapOptions& options = {}, double relative_error = 0.0);
  GeodesicField(GeodesicField&&) noexcept;
  GeodesicField& operator=(GeodesicField&&) noexcept;
  ~GeodesicField();

  /// Distance to the nearest goal, metres. Infinity if the point has no polygon or no goal lies on its
  /// island.
  double distance(const NavPoint& p) const noexcept;

 private:
  struct Impl;
  explicit GeodesicField(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gsnav
