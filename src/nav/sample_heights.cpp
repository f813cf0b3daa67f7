// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "navmesh_stages.hpp"

namespace gsnav::detail {
namespace {

/// Some polygons of a mesh, without a copy.
class PolygonRange {
 public:
  PolygonRange(const rcPolyMesh& mesh, int first, int count) {
    part_.verts = mesh.verts;
    part_.nverts = mesh.nverts;
    part_.polys = mesh.polys + std::ptrdiff_t{2} * mesh.nvp * first;
    part_.regs = mesh.regs + first;
    part_.areas = mesh.areas + first;
    part_.npolys = part_.maxpolys = count;
    part_.nvp = mesh.nvp;
    std::copy_n(mesh.bmin, 3, part_.bmin);
    std::copy_n(mesh.bmax, 3, part_.bmax);
    part_.cs = mesh.cs;
    part_.ch = mesh.ch;
    part_.borderSize = mesh.borderSize;
    part_.maxEdgeError = mesh.maxEdgeError;
  }
  PolygonRange(const PolygonRange&) = delete;
  PolygonRange& operator=(const PolygonRange&) = delete;
  ~PolygonRange() {  // Recast would free the arrays.
    part_.verts = part_.polys = part_.regs = nullptr;
    part_.areas = nullptr;
  }
  const rcPolyMesh& operator*() const noexcept { return part_; }

 private:
  rcPolyMesh part_;
};

}  // namespace

Result<RecastPtr<rcPolyMeshDetail>> sample_heights(RecastLog& log, const NavMeshSettings& s,
                                                   const rcPolyMesh& polys,
                                                   const rcCompactHeightfield& compact,
                                                   const Progress& progress) {
  // A distance above the length of any edge means no samples. (For 0, Recast reads an empty hull, see
  // its issue 650.)
  constexpr double kNoSamples = 1e9;
  const double sample = s.detail_sample_dist < 0.9 ? kNoSamples : s.detail_sample_dist * s.cell_size;
  // The polygons do not depend on each other, so they are done in parts.
  const int count = polys.npolys, part = progress ? count / 64 + 1 : count;
  std::vector<RecastPtr<rcPolyMeshDetail>> parts;
  for (int first = 0; first < count; first += part) {
    const PolygonRange range(polys, first, min(part, count - first));
    parts.emplace_back(rcAllocPolyMeshDetail());
    if (parts.back() == nullptr ||
        !rcBuildPolyMeshDetail(&log, *range, compact, static_cast<float>(sample),
                               static_cast<float>(s.cell_height * s.detail_sample_max_error),
                               *parts.back())) {
      return stage("sampling heights", log);
    }
    if (progress) progress(kPolygons + (1 - kPolygons) * min(first + part, count) / count);
  }
  if (parts.size() == 1) return std::move(parts.front());
  std::vector<rcPolyMeshDetail*> all;
  for (const auto& p : parts) all.push_back(p.get());
  RecastPtr<rcPolyMeshDetail> out(rcAllocPolyMeshDetail());
  if (out == nullptr || !rcMergePolyMeshDetails(&log, all.data(), static_cast<int>(all.size()), *out)) {
    return stage("joining heights", log);
  }
  return out;
}

}  // namespace gsnav::detail
