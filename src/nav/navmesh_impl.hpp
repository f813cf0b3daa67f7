// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <DetourNavMesh.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "corner_hubs.hpp"
#include "face_views.hpp"
#include "geodesic_search.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "landmarks.hpp"
#include "poly_mesh.hpp"

namespace gsnav {

namespace detail {

struct DetourDeleter {
  void operator()(dtNavMesh* p) const noexcept { dtFreeNavMesh(p); }
};
using NavMeshPtr = std::unique_ptr<dtNavMesh, DetourDeleter>;

/// Makes a NavMesh from the tiles that Detour holds. `height` moves vertices to the height of the true
/// floor.
NavMesh assemble_navmesh(const NavMeshSettings& settings, const Vec3d& origin, NavMeshPtr mesh,
                         const std::function<double(const Vec3d&)>& height = {});

}  // namespace detail

struct NavMesh::Impl {
  NavMeshSettings settings;
  Vec3d origin{};  ///< World position of the mesh's origin.
  detail::NavMeshPtr mesh;
  detail::PolyMesh polys;
  /// Unfolded surface. Created at its first use, to keep memory low for files whose queries do not need
  /// it. Shared with geodesic fields.
  const detail::UnfoldedMesh& unfolded() const {
    const detail::UnfoldedMesh* made = unfolded_mesh.load(std::memory_order_acquire);
    return made != nullptr ? *made : *share_unfolded();
  }
  std::shared_ptr<const detail::UnfoldedMesh> share_unfolded() const {
    std::call_once(unfolded_once, [&] {
      made_unfolded = std::make_shared<const detail::UnfoldedMesh>(polys);
      unfolded_mesh.store(made_unfolded.get(), std::memory_order_release);
    });
    return made_unfolded;
  }
  mutable std::once_flag unfolded_once;
  mutable std::shared_ptr<const detail::UnfoldedMesh> made_unfolded;
  mutable std::atomic<const detail::UnfoldedMesh*> unfolded_mesh{nullptr};
  /// Shortest distances between corners. Created at the first distance query.
  const detail::CornerHubs& hubs() const {
    const detail::CornerHubs* made = corner_hubs.load(std::memory_order_acquire);
    return made != nullptr ? *made : make_hubs();
  }
  const detail::CornerHubs& make_hubs() const {
    std::call_once(hubs_once, [&] {
      made_hubs = std::make_unique<const detail::CornerHubs>(unfolded());
      if (made_hubs->empty()) {
        made_landmarks = detail::Landmarks(unfolded());
      } else {
        made_views = detail::FaceViews(unfolded());
      }
      corner_hubs.store(made_hubs.get(), std::memory_order_release);
    });
    return *made_hubs;
  }
  /// Visibility of faces. Created together with the hubs.
  const detail::FaceViews& views() const noexcept { return made_views; }
  /// Landmarks. Created in place of the hubs if there are too many corners or lines of sight.
  const detail::Landmarks& landmarks() const noexcept { return made_landmarks; }
  mutable std::once_flag hubs_once;
  mutable std::unique_ptr<const detail::CornerHubs> made_hubs;
  mutable std::atomic<const detail::CornerHubs*> corner_hubs{nullptr};
  mutable detail::FaceViews made_views;
  mutable detail::Landmarks made_landmarks;
  Aabb<double> bounds;                     ///< World coordinates.
  std::vector<dtPolyRef> refs;             ///< Detour's reference of each polygon.
  std::vector<PolyId> first_poly;          ///< First polygon of each Detour tile.
  std::vector<std::uint32_t> first_point;  ///< First element of `polys.points` for each Detour tile.

  detail::Site site(const NavPoint& p) const noexcept;
  /// Length of the shortest path. Infinity if there is none.
  double distance(const detail::Site& start, const detail::Site& goal) const;
  /// Length of the shortest path with a relative error.
  BoundedDistance distance(const detail::Site& start, const detail::Site& goal,
                           double relative_error) const;
  /// The shortest path, relative to the mesh's origin. It has no points if there is no path.
  NavPath path(const detail::Site& start, const detail::Site& goal) const;

  PolyId id_of(dtPolyRef ref) const noexcept {
    return first_poly[mesh->decodePolyIdTile(ref)] + mesh->decodePolyIdPoly(ref);
  }
};

}  // namespace gsnav
