// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/geodesic_field.hpp"

#include <atomic>
#include <limits>
#include <new>
#include <string>

#include "field_patches.hpp"
#include "navmesh_impl.hpp"

namespace gsnav {

using detail::FieldGrid;
using detail::FieldPatches;
using detail::FieldSource;
using detail::GeodesicSearch;
using detail::Site;

struct GeodesicField::Impl {
  ~Impl() {
    if (faces == nullptr) return;
    for (std::uint32_t f = 0; f + 1 < first.size(); ++f)
      delete faces[f].patches.load(std::memory_order_relaxed);
  }

  /// Creates the patches of a face at its first lookup. If several threads do so at once, they make the
  /// same patches and one copy is kept. Returns null if memory is exhausted or the face has more sources
  /// than patches can count.
  const FieldPatches* make_patches(std::uint32_t face) const noexcept {
    const std::span<const FieldSource> own = sources_of(face);
    if (own.size() > FieldPatches::kMostSources) return nullptr;
    try {
      const Face& f = faces[face];
      auto made = std::make_unique<const FieldPatches>(*unfolded, face, f.grid, own, relative_error);
      const FieldPatches* kept = nullptr;
      if (f.patches.compare_exchange_strong(kept, made.get(), std::memory_order_acq_rel))
        return made.release();
      return kept;
    } catch (const std::bad_alloc&) {
      return nullptr;
    }
  }
  std::span<const FieldSource> sources_of(std::uint32_t face) const noexcept {
    return std::span(sources).subspan(first[face], first[face + 1] - first[face]);
  }

  const NavMesh::Impl* mesh = nullptr;
  std::shared_ptr<const detail::UnfoldedMesh> unfolded;
  double relative_error = 0;
  std::vector<std::uint32_t> first;  ///< Begin of each face in `sources`, and one past the last.
  std::vector<FieldSource> sources;
  struct Face {
    FieldGrid grid;
    mutable std::atomic<const FieldPatches*> patches{nullptr};
  };
  std::unique_ptr<Face[]> faces;
};

GeodesicField::GeodesicField(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
GeodesicField::GeodesicField(GeodesicField&&) noexcept = default;
GeodesicField& GeodesicField::operator=(GeodesicField&&) noexcept = default;
GeodesicField::~GeodesicField() = default;

Result<GeodesicField> GeodesicField::make(const NavMesh& mesh, std::span<const Vec3d> goals,
                                          const SnapOptions& options, double relative_error) {
  if (goals.empty()) return Status(Errc::invalid_argument, "geodesic field: there are no goals");
  if (!(relative_error >= 0 && relative_error <= 0.1)) {
    return Status(Errc::invalid_argument, "geodesic field: relative_error is " +
                                              std::to_string(relative_error) +
                                              ": give 0 (exact) to 0.1");
  }
  auto impl = std::make_unique<Impl>();
  impl->relative_error = relative_error;
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

  std::vector<std::vector<FieldSource>> by_face(m.faces.size());
  for (const Site& s : sites) by_face[s.face].push_back({s.at, s.at, s.at, 0.0});
  for (const GeodesicSearch::Node& n : search.nodes()) {
    if (!n.is_vertex) by_face[m.edges[n.edge].face].push_back({n.root, n.right, n.left, n.g});
  }
  for (std::uint32_t f = 0; f < m.faces.size(); ++f) {
    for (std::uint32_t k = 0; k < m.faces[f].count; ++k) {
      const auto& e = m.edges[m.faces[f].first + k];
      const double d = search.vertex_distance(e.vertex);
      // Near a vertex at which no path bends, windows cover the paths.
      const bool needed = m.vertices[e.vertex].turning || d <= 0 || by_face[f].empty();
      if (needed && d < std::numeric_limits<double>::infinity())
        by_face[f].push_back({e.at, e.at, e.at, d});
    }
    impl->first.push_back(static_cast<std::uint32_t>(impl->sources.size()));
    impl->sources.insert(impl->sources.end(), by_face[f].begin(), by_face[f].end());
  }
  impl->first.push_back(static_cast<std::uint32_t>(impl->sources.size()));
  impl->sources.shrink_to_fit();
  impl->faces = std::make_unique<Impl::Face[]>(m.faces.size());
  for (std::uint32_t f = 0; f < m.faces.size(); ++f)
    impl->faces[f].grid = FieldGrid(m, f, by_face[f].size());
  return GeodesicField(std::move(impl));
}

double GeodesicField::distance(const NavPoint& p) const noexcept {
  double best = std::numeric_limits<double>::infinity();
  if (p.poly >= impl_->mesh->polys.polys.size() || !is_finite(p.position)) return best;
  const Site at = impl_->mesh->site(p);
  const Impl::Face& face = impl_->faces[at.face];
  const FieldPatches* patches = face.patches.load(std::memory_order_acquire);
  if (patches == nullptr) patches = impl_->make_patches(at.face);
  if (patches != nullptr) return patches->least(face.grid.patch(at.at), at.at);
  for (const FieldSource& s : impl_->sources_of(at.face)) best = s.least(at.at, best);
  return best;
}

}  // namespace gsnav
