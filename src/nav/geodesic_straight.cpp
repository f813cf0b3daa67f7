// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "geodesic_search.hpp"
#include "tolerances.hpp"

// Paths without bends: from a site to a goal, and from a vertex in all directions.

namespace gsnav::detail {

double GeodesicSearch::run_straight(const UnfoldedMesh& mesh, const Site& start, const Site& goal,
                                    double bound, const GoalBound* least, const FaceViews* views) {
  start_ = start;
  goal_ = goal;
  has_goal_ = straight_ = true;
  every_vertex_ = false;
  if (start.face == goal.face) return length(goal.at - start.at);
  begin(mesh, bound);
  least_ = least;
  views_ = views != nullptr && !views->empty() ? views : nullptr;
  leave(start);
  // There are few windows, so sorting them would not save time.
  constexpr std::size_t kMost = 1 << 14;
  while (!heap_.empty() && nodes_.size() < kMost) {
    const std::uint32_t node = heap_.back().second;
    heap_.pop_back();
    spread_window(node);
  }
  least_ = nullptr;
  views_ = nullptr;
  if (!heap_.empty()) return run(mesh, start, goal, bound);
  return found_ ? best_ : kInfinity;
}

std::size_t GeodesicSearch::look_around(const UnfoldedMesh& mesh, std::uint32_t vertex) {
  has_goal_ = every_vertex_ = false;
  straight_ = true;
  begin(mesh);
  const UnfoldedMesh::Vertex& v = mesh.vertices[vertex];
  reached_[vertex] = round_;
  distance_[vertex] = 0;
  if (v.closed || v.total > 2 * kPi - kRounding) {
    leave_vertex(vertex, 0.0, kNone, 0.0, v.total);
    settle();
    return nodes_.size();
  }
  // A path that bends here leaves at least half a turn between itself and one of the two walls.
  leave_vertex(vertex, 0.0, kNone, 0.0, v.total - kPi + kRounding);
  leave_vertex(vertex, 0.0, kNone, kPi - kRounding, v.total);
  settle();
  const std::size_t bending = nodes_.size();
  leave_vertex(vertex, 0.0, kNone, v.total - kPi, kPi);
  settle();
  return bending;
}

void GeodesicSearch::open_straight(std::uint32_t edge, const Flat& root, Flat right, Flat left,
                                   std::uint32_t parent) {
  const UnfoldedMesh::Edge &here = mesh_->edges[edge], &there = mesh_->edges[here.twin],
                           &after = mesh_->edges[mesh_->next(edge)];
  if (views_ != nullptr) {
    const FaceViews::Range range = views_->toward(goal_.face, edge);
    if (range.low > range.high) return;
    const Flat side = after.at - here.at;
    const double inverse = 1.0 / dot(side, side);
    const auto along = [&](const Flat& p) { return dot(p - here.at, side) * inverse; };
    const double right_was = along(right), left_was = along(left);
    double r = right_was, l = left_was;
    if (!FaceViews::narrow(range, along(root), max(cross(side, root - here.at) * inverse, 0.0), r, l))
      return;
    if (r > right_was) right = here.at + side * r;
    if (l < left_was) left = here.at + side * l;
  }
  const double to_right = length(right - root), to_left = length(left - root);
  // Worthwhile only for many windows. When the crossing point moves away from a corner, the remaining
  // distance may decrease by that amount and the distance to the root increases by less. The minimum is
  // therefore at the far end.
  constexpr std::size_t kMany = 24;
  if (least_ != nullptr && nodes_.size() > kMany) {
    if (to_left + least_->from(here.vertex) - length(left - here.at) >= best_ ||
        to_right + least_->from(there.vertex) - length(right - after.at) >= best_) {
      return;
    }
  }
  const Node n = window_beyond(here, root, right, left, 0, parent);
  const Flat e = left - right;
  const double width = length(e);
  if (there.face == goal_.face) {
    const Flat to = goal_.at - n.right, along = n.left - n.right;
    const double f = length_through(n.root, n.right, n.left, dot(to, along) / width,
                                    std::abs(cross(along, to)) / width);
    if (f >= best_) return;
    nodes_.push_back(n);
    offer_goal(f, static_cast<std::uint32_t>(nodes_.size() - 1));
    return;
  }
  // An end of the window is at most half its width from its middle.
  const Flat side = after.at - here.at;
  const double at = dot((left + right) * 0.5 - here.at, side) / dot(side, side);
  const Vec3d &a = here.corner, &b = after.corner;
  const Vec3d middle{a.x + at * (b.x - a.x), a.y + at * (b.y - a.y), a.z + at * (b.z - a.z)};
  const double beyond = distance(goal_.position, middle);
  if (0.5 * (to_right + to_left) + beyond - width >= best_) return;
  heap_.emplace_back(0.0, static_cast<std::uint32_t>(nodes_.size()));
  nodes_.push_back(n);
}

}  // namespace gsnav::detail
