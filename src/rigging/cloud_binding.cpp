// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/cloud_binding.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "../avatar/cell_rings.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "mesh_weights.hpp"

namespace gsnav {

namespace {

/// Barycentric coordinates of the point of triangle a b c nearest to p.
Vec3d nearest_in_triangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& p) {
  const Vec3d n = cross(b - a, c - a);
  const double area2 = dot(n, n);
  if (area2 > 0) {
    const Vec3d w{dot(cross(c - b, p - b), n) / area2, dot(cross(a - c, p - c), n) / area2,
                  dot(cross(b - a, p - a), n) / area2};
    if (w.x >= 0 && w.y >= 0 && w.z >= 0) return w;
  }
  const double s = segment_fraction(a, b, p), t = segment_fraction(b, c, p),
               u = segment_fraction(c, a, p);
  const Vec3d candidates[3] = {{1 - s, s, 0}, {0, 1 - t, t}, {u, 0, 1 - u}};
  Vec3d best{1, 0, 0};
  double least = std::numeric_limits<double>::max();
  for (const Vec3d& w : candidates) {
    const Vec3d d = a * w.x + b * w.y + c * w.z - p;
    if (dot(d, d) < least) least = dot(d, d), best = w;
  }
  return best;
}

}  // namespace

namespace detail {

NearestTriangle::NearestTriangle(const SkinnedMesh& mesh) : mesh_(mesh), around_(mesh.positions.size()) {
  double edges = 0.0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = mesh.triangles[t][k];
      around_[v].push_back(static_cast<std::uint32_t>(t));
      edges += norm(mesh.positions[v] - mesh.positions[mesh.triangles[t][(k + 1) % 3]]);
    }
  }
  cell_ = max(2 * edges / (3 * static_cast<double>(mesh.triangles.size())), 1e-9);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (around_[v].empty()) continue;
    cells_[key(cell_of(mesh.positions[v]))].push_back(static_cast<std::uint32_t>(v));
  }
}

MeshSample NearestTriangle::find(const Vec3d& p, double& distance) const {
  MeshSample best;
  distance = std::numeric_limits<double>::max();
  const auto c = cell_of(p);
  // Search rings of cells outwards, and one ring beyond the first with a vertex, because the triangle of
  // a farther vertex may be nearer.
  for (std::int64_t ring = 0, last = kRings; ring <= last; ++ring) {
    for_each_cell_in_ring(c, ring, [&](const GridCell& cell) {
      const auto found = cells_.find(key(cell));
      if (found == cells_.end()) return;
      last = std::min(last, ring + 1);
      for (const std::uint32_t v : found->second) {
        for (const std::uint32_t t : around_[v]) look(t, p, best, distance);
      }
    });
  }
  if (distance == std::numeric_limits<double>::max()) {  // far away from the mesh
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
      look(static_cast<std::uint32_t>(t), p, best, distance);
  }
  return best;
}

void NearestTriangle::look(std::uint32_t t, const Vec3d& p, MeshSample& best, double& distance) const {
  const auto& v = mesh_.triangles[t];
  const Vec3d &a = mesh_.positions[v[0]], &b = mesh_.positions[v[1]], &c = mesh_.positions[v[2]];
  const Vec3d w = nearest_in_triangle(a, b, c, p), q = a * w.x + b * w.y + c * w.z;
  if (norm(q - p) < distance) {
    distance = norm(q - p);
    best.triangle = t;
    best.at = w;
    best.position = q;
  }
}

std::array<std::int64_t, 3> NearestTriangle::cell_of(const Vec3d& p) const {
  const auto part = [&](double v) {
    return static_cast<std::int64_t>(std::floor(clamp(v / cell_, -1e9, 1e9)));
  };
  return {part(p.x), part(p.y), part(p.z)};
}

std::uint64_t NearestTriangle::key(const std::array<std::int64_t, 3>& cell) noexcept {
  const auto part = [](std::int64_t v) { return static_cast<std::uint64_t>(v) & 0x1fffffu; };
  return part(cell[0]) << 42 | part(cell[1]) << 21 | part(cell[2]);
}

}  // namespace detail

Result<BoundCloud> bind_cloud(const GaussianCloud& cloud, const SkinnedMesh& mesh,
                              const CloudBindingOptions& options) {
  const BadArgument bad{"bind_cloud: "};
  if (Status s = mesh.validate(); !s) return s;
  const Similarity& to = options.mesh_from_cloud;
  if (!(to.scale > 0) || !is_finite(to.scale) || !is_finite(to.translation))
    return bad("mesh_from_cloud has no scale above zero");
  if (!(options.furthest > 0)) return bad("furthest must be positive");
  if (cloud.compact()) return bad("the cloud is compact: expand_sh first");
  if (cloud.sh_degree > 0 && !(abs(to.rotation.w) > 1 - 1e-9)) {
    return {Errc::unsupported, "bind_cloud: colours of SH degree " + std::to_string(cloud.sh_degree) +
                                   " in a turned frame"};
  }
  BoundCloud out;
  AvatarAsset& asset = out.asset;
  asset.name = mesh.name;
  asset.skeleton = mesh.skeleton;
  GaussianCloudBuilder builder(cloud.sh_degree, mesh.name);
  builder.reserve(cloud.size());
  const detail::NearestTriangle nearest(mesh);
  const std::size_t rest = cloud.shN.size() / max<std::size_t>(1, cloud.size());
  std::vector<std::vector<std::pair<std::uint16_t, double>>> rows;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    RawGaussian g;
    g.mean = to * cloud.mean(i);
    double distance = 0.0;
    const detail::MeshSample at = nearest.find(g.mean, distance);
    if (distance > options.furthest) {
      ++out.left_out;
      continue;
    }
    g.quat = to.rotation * cloud.quat(i);
    for (std::size_t k = 0; k < 3; ++k) {
      g.log_scales[static_cast<int>(k)] = std::log(to.scale * static_cast<double>(cloud.scales[k][i]));
      g.sh0[k] = cloud.sh0[3 * i + k];
    }
    g.opacity_logit = logit_by_logs(static_cast<double>(cloud.opacities[i]));
    g.shN = rest == 0 ? nullptr : cloud.shN.data() + rest * i;
    if (!builder.add(g)) continue;
    out.furthest = max(out.furthest, distance);
    detail::blend_weights(mesh, at, rows.emplace_back());
  }
  if (rows.empty())
    return bad("no Gaussian lies within " + std::to_string(options.furthest) + " m of the surface");
  if (Status s = detail::finish_avatar(asset, builder, rows, options.weights, out.weights); !s) return s;
  return out;
}

}  // namespace gsnav
