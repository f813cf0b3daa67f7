// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "geodesic_search.hpp"
#include "tolerances.hpp"

namespace gsnav::detail {
namespace {

constexpr double kHeightError = 0.01;  // Largest distance of a path from the surface, metres.

struct PathPoint {
  Vec3d position{};
  bool corner = false;
};

/// Position where the line from target to root crosses the window, as a fraction of its edge.
double crossing(const GeodesicSearch::Node& n, const Flat& a, const Flat& b,
                const Flat& target) noexcept {
  const Flat e = n.left - n.right, d = n.root - target;
  const double rate = cross(e, d);
  const double t = rate != 0 ? clamp(cross(target - n.right, d) / rate, 0.0, 1.0) : 0.0;
  const Flat at = n.right + e * t, whole = b - a;
  return segment_fraction(dot(at - a, whole), dot(whole, whole));
}

/// Appends the points of (first, last] that a straight line misses, including the last
/// (Douglas-Peucker).
void simplify(const std::vector<PathPoint>& p, std::size_t first, std::size_t last,
              std::vector<Vec3d>& out) {
  std::size_t worst = first;
  double error = kHeightError;
  const Vec3d a = p[first].position, b = p[last].position;
  for (std::size_t i = first + 1; i < last; ++i) {
    const double off = sqrt(segment_distance2(a, b, p[i].position));
    if (off <= error) continue;
    error = off;
    worst = i;
  }
  if (worst != first) {
    simplify(p, first, worst, out);
    simplify(p, worst, last, out);
  } else {
    out.push_back(p[last].position);
  }
}

}  // namespace

std::vector<Vec3d> GeodesicSearch::path() const {
  std::vector<PathPoint> points{{goal_.position, true}};
  const auto add = [&](const Vec3d& p, bool corner) {
    if (norm(p - points.back().position) > kSame) {
      points.push_back({p, corner});
    } else {
      points.back().corner |= corner;
    }
  };
  Flat target = goal_.at;
  for (std::uint32_t i = best_node_; i != kNone; i = nodes_[i].parent) {
    const Node& n = nodes_[i];
    const UnfoldedMesh::Edge& e = mesh_->edges[n.edge];
    if (n.is_vertex) {
      add(e.corner, true);
      target = e.at;
      continue;
    }
    const UnfoldedMesh::Edge &end = mesh_->edges[mesh_->next(n.edge)], &twin = mesh_->edges[e.twin];
    const double t = crossing(n, e.at, end.at, target);
    // A path through a vertex may have been found as the end of a window before the vertex itself.
    const double side = length(end.at - e.at);
    const bool at_turn = (t * side < kSame && mesh_->vertices[e.vertex].turning) ||
                         ((1 - t) * side < kSame && mesh_->vertices[end.vertex].turning);
    add(lerp(e.corner, end.corner, t), at_turn);
    target = twin.at + (mesh_->edges[mesh_->next(e.twin)].at - twin.at) * (1 - t);
  }
  add(start_.position, true);
  points.back() = {start_.position, true};
  std::reverse(points.begin(), points.end());
  std::vector<Vec3d> out{start_.position};
  std::size_t first = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (!points[i].corner) continue;
    simplify(points, first, i, out);
    first = i;
  }
  if (out.size() == 1) out.push_back(goal_.position);
  return out;
}

}  // namespace gsnav::detail
