// SPDX-License-Identifier: Apache-2.0
#include "gsnav/nav/geodesic_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "navmesh_impl.hpp"

namespace gsnav {

using detail::Flat;
using detail::GeodesicSearch;
using detail::Site;

struct GeodesicField::Impl {
  /// A point in the plane of a face with its distance to the goal, and the window of the face's edge that it
  /// sees the face through; no width where it lies in or on the face.
  struct Source {
    Flat root, right, left;
    double g = 0;
    double least = 0;  ///< no point of the face is nearer
  };

  static Source seen_through(const GeodesicSearch::Node& n) noexcept {
    const Flat e = n.left - n.right;
    const double t = clamp(detail::dot(n.root - n.right, e) / detail::dot(e, e), 0.0, 1.0);
    return {n.root, n.right, n.left, n.g, n.g + detail::length(n.right + e * t - n.root)};
  }

  const NavMesh::Impl* mesh = nullptr;
  std::shared_ptr<const detail::UnfoldedMesh> unfolded;
  std::vector<std::uint32_t> first;  ///< of each face in `sources`, and one past the last
  std::vector<Source> sources;
};

GeodesicField::GeodesicField(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
GeodesicField::GeodesicField(GeodesicField&&) noexcept = default;
GeodesicField& GeodesicField::operator=(GeodesicField&&) noexcept = default;
GeodesicField::~GeodesicField() = default;

Result<GeodesicField> GeodesicField::make(const NavMesh& mesh, std::span<const Vec3d> goals,
                                          const SnapOptions& options) {
  if (goals.empty()) return Status(Errc::invalid_argument, "geodesic field: there are no goals");
  auto impl = std::make_unique<Impl>();
  impl->mesh = &mesh.impl();
  impl->unfolded = mesh.impl().share_unfolded();
  const detail::UnfoldedMesh& m = *impl->unfolded;
  std::vector<Site> sites;
  for (std::size_t i = 0; i < goals.size(); ++i) {
    const auto at = mesh.snap_point(goals[i], options);
    if (!at) {
      return Status(Errc::nothing_navigable,
                    "geodesic field: goal " + std::to_string(i) + " is not near the NavMesh");
    }
    sites.push_back(mesh.impl().site(*at));
  }
  GeodesicSearch& search = detail::thread_search();
  search.flood(m, sites);

  std::vector<std::vector<Impl::Source>> by_face(m.faces.size());
  for (const Site& s : sites) by_face[s.face].push_back({s.at, s.at, s.at, 0.0, 0.0});
  for (const GeodesicSearch::Node& n : search.nodes()) {
    if (!n.is_vertex) by_face[m.edges[n.edge].face].push_back(Impl::seen_through(n));
  }
  for (std::uint32_t f = 0; f < m.faces.size(); ++f) {
    for (std::uint32_t k = 0; k < m.faces[f].count; ++k) {
      const auto& e = m.edges[m.faces[f].first + k];
      const double d = search.vertex_distance(e.vertex);
      // Through a vertex that no path bends at windows lead beside it.
      const bool needed = m.vertices[e.vertex].turning || d <= 0 || by_face[f].empty();
      if (needed && d < std::numeric_limits<double>::infinity()) by_face[f].push_back({e.at, e.at, e.at, d, d});
    }
    std::stable_sort(by_face[f].begin(), by_face[f].end(),
                     [](const Impl::Source& a, const Impl::Source& b) { return a.least < b.least; });
    impl->first.push_back(static_cast<std::uint32_t>(impl->sources.size()));
    impl->sources.insert(impl->sources.end(), by_face[f].begin(), by_face[f].end());
  }
  impl->first.push_back(static_cast<std::uint32_t>(impl->sources.size()));
  return GeodesicField(std::move(impl));
}

double GeodesicField::distance(const NavPoint& p) const noexcept {
  double best = std::numeric_limits<double>::infinity();
  if (p.poly >= impl_->mesh->polys.polys.size() || !is_finite(p.position)) return best;
  const Site at = impl_->mesh->site(p);
  for (std::uint32_t i = impl_->first[at.face]; i < impl_->first[at.face + 1]; ++i) {
    const Impl::Source& s = impl_->sources[i];
    if (s.least >= best) break;
    const Flat d = at.at - s.root;
    const double straight = s.g + detail::length(d);
    if (straight >= best) continue;
    // Through the window: the root is on its outer side, the point on its inner side.
    const double right = detail::cross(s.right - s.root, d), left = detail::cross(s.left - s.root, d);
    if (right >= 0 && left <= 0) {
      best = straight;
    } else {
      const Flat end = right < 0 ? s.right : s.left;
      best = min(best, s.g + detail::length(end - s.root) + detail::length(at.at - end));
    }
  }
  return best;
}

}  // namespace gsnav
