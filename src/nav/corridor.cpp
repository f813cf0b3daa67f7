// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <vector>

#include "landmarks.hpp"
#include "tolerances.hpp"

// Finds a sequence of faces by landmarks, and the shortest path inside it.

namespace gsnav::detail {
namespace {

/// Transform from the plane of a face to that of the first face.
struct FaceTransform {
  double cosine = 1, sine = 0, dx = 0, dy = 0;
  Flat operator()(const Flat& p) const noexcept {
    return {cosine * p.x - sine * p.y + dx, sine * p.x + cosine * p.y + dy};
  }
  /// Composed with the turn of an edge: from the plane of its face to that of its neighbour.
  FaceTransform after(const UnfoldedMesh::Edge& e) const noexcept {
    if (e.same_plane) return *this;
    const Flat d = (*this)({e.dx, e.dy});
    return {cosine * e.cosine - sine * e.sine, sine * e.cosine + cosine * e.sine, d.x, d.y};
  }
};

struct Gate {
  Flat right, left;
};

/// Length of the shortest path from a point through all gates. The last gate is a point.
double straightened(const Flat& start, const std::vector<Gate>& gates) noexcept {
  double sum = 0;
  Flat apex = start, right = start, left = start;
  std::size_t right_at = 0, left_at = 0;
  const auto at_apex = [&](const Flat& p) { return length(p - apex) < kSame; };
  for (std::size_t i = 0; i < gates.size(); ++i) {
    Gate g = gates[i];
    // Rounding gives a corner slightly different coordinates in different planes.
    if (at_apex(g.right)) g.right = apex;
    if (at_apex(g.left)) g.left = apex;
    if (cross(right - apex, g.right - apex) >= 0) {
      if ((right.x == apex.x && right.y == apex.y) || cross(left - apex, g.right - apex) < 0) {
        right = g.right;
        right_at = i;
      } else {
        sum += length(left - apex);
        apex = right = left;
        i = right_at = left_at;
        continue;
      }
    }
    if (cross(left - apex, g.left - apex) > 0) continue;
    if ((left.x == apex.x && left.y == apex.y) || cross(right - apex, g.left - apex) > 0) {
      left = g.left;
      left_at = i;
    } else {
      sum += length(right - apex);
      apex = left = right;
      i = left_at = right_at;
    }
  }
  return sum + length(gates.back().right - apex);
}

}  // namespace

double corridor_length(const UnfoldedMesh& mesh, const LandmarkLead& lead, const Site& start,
                       const Site& goal) {
  constexpr std::size_t kMostFaces = 512;
  thread_local std::vector<Gate> gates;
  gates.clear();
  FaceTransform placed;
  Flat at = start.at;
  std::uint32_t face = start.face, entered = UnfoldedMesh::kNone;
  while (face != goal.face) {
    const UnfoldedMesh::Face& f = mesh.faces[face];
    double best = kInfinity;
    std::uint32_t out = UnfoldedMesh::kNone;
    Flat to;
    for (std::uint32_t e = f.first; e < f.first + f.count; ++e) {
      const UnfoldedMesh::Edge &edge = mesh.edges[e], &after = mesh.edges[mesh.next(e)];
      if (edge.twin == UnfoldedMesh::kNone || e == entered) continue;
      // Exclude the ends of the edge, because the path could circle around them forever.
      for (std::uint32_t k = 1; k < Landmarks::kParts; ++k) {
        const double t = static_cast<double>(k) / Landmarks::kParts;
        const Flat p = edge.at + (after.at - edge.at) * t;
        const double d =
            length(p - at) +
            max(lead.toward(e, k), distance(lerp(edge.corner, after.corner, t), goal.position));
        if (d >= best) continue;
        best = d;
        out = e;
        to = p;
      }
    }
    if (out == UnfoldedMesh::kNone || gates.size() == kMostFaces) return kInfinity;
    const UnfoldedMesh::Edge& edge = mesh.edges[out];
    gates.push_back({placed(edge.at), placed(mesh.edges[mesh.next(out)].at)});
    placed = placed.after(mesh.edges[edge.twin]);
    at = UnfoldedMesh::across(edge, to);
    face = mesh.edges[edge.twin].face;
    entered = edge.twin;
  }
  const Flat end = placed(goal.at);
  gates.push_back({end, end});
  return straightened(start.at, gates);
}

}  // namespace gsnav::detail
