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

/// A NavMesh of the tiles that Detour holds; `height` moves its vertices to the true floor.
NavMesh assemble_navmesh(const NavMeshSettings& settings, const Vec3d& origin, NavMeshPtr mesh,
                         const std::function<double(const Vec3d&)>& height = {});

}  // namespace detail

struct NavMesh::Impl {
  NavMeshSettings settings;
  Vec3d origin{};  ///< world position of the mesh's own zero
  detail::NavMeshPtr mesh;
  detail::PolyMesh polys;
  /// Made when first asked for, so that a file takes no more memory than its queries need; shared with
  /// geodesic fields.
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
  /// Made when first asked for: who never asks for a distance pays nothing.
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
  /// Made with the hubs.
  const detail::FaceViews& views() const noexcept { return made_views; }
  /// Made in place of the hubs where there are too many corners or sights for them.
  const detail::Landmarks& landmarks() const noexcept { return made_landmarks; }
  mutable std::once_flag hubs_once;
  mutable std::unique_ptr<const detail::CornerHubs> made_hubs;
  mutable std::atomic<const detail::CornerHubs*> corner_hubs{nullptr};
  mutable detail::FaceViews made_views;
  mutable detail::Landmarks made_landmarks;
  Aabb<double> bounds;                     ///< world
  std::vector<dtPolyRef> refs;             ///< Detour's name of each polygon
  std::vector<PolyId> first_poly;          ///< of each of Detour's tiles
  std::vector<std::uint32_t> first_point;  ///< the same, of `polys.points`

  detail::Site site(const NavPoint& p) const noexcept;
  /// Length of the shortest path; infinity where there is none.
  double distance(const detail::Site& start, const detail::Site& goal) const;
  /// The same to an error.
  BoundedDistance distance(const detail::Site& start, const detail::Site& goal,
                           double relative_error) const;
  /// The shortest path, relative to the mesh's origin; no points where there is none.
  NavPath path(const detail::Site& start, const detail::Site& goal) const;

  dtPolyRef ref_of(PolyId id) const noexcept { return refs[id]; }
  PolyId id_of(dtPolyRef ref) const noexcept {
    return first_poly[mesh->decodePolyIdTile(ref)] + mesh->decodePolyIdPoly(ref);
  }
};

}  // namespace gsnav
