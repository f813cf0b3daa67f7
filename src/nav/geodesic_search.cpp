// SPDX-License-Identifier: Apache-2.0
#include "geodesic_search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "landmarks.hpp"
#include "tolerances.hpp"

namespace gsnav::detail {
namespace {

constexpr double kNarrowest = 1e-11;  // Metres. Narrower windows are points.

Flat turned(const Flat& d, double angle) noexcept {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * d.x - s * d.y, s * d.x + c * d.y};
}

}  // namespace

double length_through(const Flat& root, const Flat& right, const Flat& left, double along,
                      double beyond) noexcept {
  const Flat e = left - right;
  const double width = length(e), inverse = 1.0 / width;
  const Flat r = root - right;
  const double rx = dot(r, e) * inverse, ry = std::abs(cross(e, r)) * inverse;
  const double depth = ry + beyond;
  double x = depth > 0 ? rx + (along - rx) * (ry / depth) : along;
  if (x >= 0 && x <= width) return std::sqrt((along - rx) * (along - rx) + depth * depth);
  x = x < 0 ? 0 : width;
  return std::sqrt((x - rx) * (x - rx) + ry * ry) +
         std::sqrt((along - x) * (along - x) + beyond * beyond);
}

GeodesicSearch& thread_search() {
  thread_local GeodesicSearch search;
  return search;
}

void GeodesicSearch::begin(const UnfoldedMesh& mesh, double bound) {
  mesh_ = &mesh;
  best_ = bound;
  found_ = false;
  best_node_ = kNone;
  slack_ = 0;
  nodes_.clear();
  heap_.clear();
  if (reached_.size() < mesh.vertices.size()) {
    reached_.resize(mesh.vertices.size(), 0);
    distance_.resize(mesh.vertices.size());
  }
  ++round_;
}

double GeodesicSearch::run(const UnfoldedMesh& mesh, const Site& start, const Site& goal, double bound) {
  start_ = start;
  goal_ = goal;
  has_goal_ = true;
  straight_ = false;
  if (start.face == goal.face) {
    begin(mesh);
    return length(goal.at - start.at);
  }
  for (const bool every : {false, true}) {
    every_vertex_ = every;
    begin(mesh, bound);
    leave(start);
    settle();
    if (found_) return best_;
  }
  return kInfinity;
}

double GeodesicSearch::run_led(const UnfoldedMesh& mesh, const Site& start, const Site& goal,
                               const LandmarkLead& lead, double bound, double slack) {
  start_ = start;
  goal_ = goal;
  has_goal_ = true;
  straight_ = every_vertex_ = false;
  begin(mesh, bound);
  lead_ = &lead;
  slack_ = slack;
  leave(start);
  settle();
  lead_ = nullptr;
  return best_;
}

void GeodesicSearch::flood(const UnfoldedMesh& mesh, const std::vector<Site>& starts) {
  has_goal_ = every_vertex_ = straight_ = false;
  begin(mesh);
  for (const Site& s : starts) leave(s);
  settle();
}

void GeodesicSearch::settle() {
  // Bounds the search for bent or folded polygons of a file, whose windows might never end. Meshes built
  // by Recast do not need it.
  const std::size_t most = 100000 + 1000 * mesh_->edges.size();
  while (!heap_.empty() && nodes_.size() < most) {
    const auto [f, node] = heap_.front();
    if (f * (1 + slack_) >= best_) break;
    if (lead_ != nullptr && lead_->least() * (1 + slack_) >= best_) break;
    std::pop_heap(heap_.begin(), heap_.end(), std::greater<>());
    heap_.pop_back();
    if (nodes_[node].is_vertex) {
      spread_vertex(node);
    } else {
      spread_window(node);
    }
  }
}

void GeodesicSearch::push(double f, const Node& node) {
  if (!(f * (1 + slack_) < best_)) return;
  heap_.emplace_back(f, static_cast<std::uint32_t>(nodes_.size()));
  std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
  nodes_.push_back(node);
}

void GeodesicSearch::offer_goal(double total, std::uint32_t node) {
  if (total >= best_) return;
  found_ = true;
  best_ = total;
  best_node_ = node;
}

void GeodesicSearch::leave(const Site& start) {
  const UnfoldedMesh::Face& face = mesh_->faces[start.face];
  for (std::uint32_t k = 0; k < face.count; ++k) {
    const UnfoldedMesh::Edge& e = mesh_->edges[face.first + k];
    if (length(e.at - start.at) > kRounding) continue;
    // The start lies on a vertex. A window on an adjacent edge would turn around it forever.
    const UnfoldedMesh::Vertex& v = mesh_->vertices[e.vertex];
    reached_[e.vertex] = round_;
    distance_[e.vertex] = 0;
    leave_vertex(e.vertex, 0.0, kNone, 0.0, v.total);
    return;
  }
  for (std::uint32_t k = 0; k < face.count; ++k) reach(face.first + k, start.at, 0.0, kNone);
  for (std::uint32_t k = 0; k < face.count; ++k) {
    const std::uint32_t e = face.first + k;
    open(e, start.at, mesh_->edges[e].at, mesh_->edges[mesh_->next(e)].at, 0.0, kNone);
  }
}

void GeodesicSearch::reach(std::uint32_t edge, const Flat& root, double g, std::uint32_t parent) {
  if (straight_ && has_goal_) return;
  const UnfoldedMesh::Edge& e = mesh_->edges[edge];
  const double d = g + length(e.at - root);
  double& known = distance_[e.vertex];
  if (reached_[e.vertex] == round_ && d >= known - 1e-12) return;
  reached_[e.vertex] = round_;
  known = d;
  if (!mesh_->vertices[e.vertex].turning && !every_vertex_) return;
  Node n;
  n.root = root;
  n.g = d;
  n.edge = edge;
  n.parent = parent;
  n.is_vertex = true;
  if (!straight_) {
    double left = has_goal_ ? distance(goal_.position, e.corner) : 0.0;
    if (lead_ != nullptr) left = max(left, lead_->from(edge, 0));
    push(d + left, n);
  } else if (!has_goal_) {
    nodes_.push_back(n);
  }
}

void GeodesicSearch::open(std::uint32_t edge, const Flat& root, const Flat& right, const Flat& left,
                          double g, std::uint32_t parent) {
  const UnfoldedMesh::Edge& here = mesh_->edges[edge];
  if (here.twin == kNone) return;
  const Flat extent = left - right;
  if (!(dot(extent, extent) > kNarrowest * kNarrowest)) return;
  const UnfoldedMesh::Edge& there = mesh_->edges[here.twin];
  if (straight_ && has_goal_) {
    open_straight(edge, root, right, left, parent);
    return;
  }
  // A path along the edge from one of its ends may be shorter for the whole window.
  const double dr = vertex_distance(here.vertex), dl = vertex_distance(there.vertex);
  if (dr < kInfinity && dr + length(left - here.at) + kRounding < g + length(left - root)) return;
  if (dl < kInfinity &&
      dl + length(right - mesh_->edges[mesh_->next(edge)].at) + kRounding < g + length(right - root)) {
    return;
  }
  const Node n = window_beyond(here, root, right, left, g, parent);
  if (!has_goal_) {
    // Nearest point of the window.
    const double t = clamp(dot(root - right, extent) / dot(extent, extent), 0.0, 1.0);
    push(g + length(right + extent * t - root), n);
    return;
  }
  const double inverse = 1.0 / length(extent);
  if (there.face == goal_.face) {
    const Flat to = goal_.at - n.right, e = n.left - n.right;
    const double f = g + length_through(n.root, n.right, n.left, dot(to, e) * inverse,
                                        std::abs(cross(e, to)) * inverse);
    if (f >= best_) return;
    nodes_.push_back(n);
    offer_goal(f, static_cast<std::uint32_t>(nodes_.size() - 1));
    return;
  }
  // Goal in 3D relative to the right end of the window: distance along the edge and from its line.
  const Vec3d &a = here.corner, &b = mesh_->edges[mesh_->next(edge)].corner;
  const Vec3d e = b - a, to = goal_.position - a;
  const double along = plain_dot(to, e) / std::sqrt(plain_dot(e, e));
  const double beyond = std::sqrt(max(plain_dot(to, to) - along * along, 0.0));
  const double begin = length(right - here.at);
  double f = length_through(root, right, left, along - begin, beyond);
  if (lead_ != nullptr && (g + f) * (1 + slack_) < best_) {
    const Flat side = mesh_->edges[mesh_->next(edge)].at - here.at, r = root - here.at;
    const double whole = length(side);
    f = max(f, lead_->through(edge, whole, dot(r, side) / whole, std::abs(cross(side, r)) / whole, begin,
                              begin + 1.0 / inverse));
  }
  push(g + f, n);
}

void GeodesicSearch::spread(std::uint32_t face, std::uint32_t first, std::uint32_t count,
                            const Flat& root, const Cone& cone, double g, std::uint32_t parent) {
  const UnfoldedMesh::Face& f = mesh_->faces[face];
  const auto edge = [&](std::uint32_t k) { return f.first + (k < f.count ? k : k - f.count); };
  const bool wide = dot(cone.right, cone.left) < 0;
  Flat p = mesh_->edges[edge(first)].at;
  double right_p = cross(cone.right, p - root), left_p = cross(cone.left, p - root);
  for (std::uint32_t k = first; k < first + count; ++k) {
    const std::uint32_t e = edge(k), after = mesh_->next(e);
    const Flat q = mesh_->edges[after].at;
    const double right_q = cross(cone.right, q - root), left_q = cross(cone.left, q - root);
    if (k + 1 < first + count && right_q >= -kRounding && left_q <= kRounding)
      reach(after, root, g, parent);
    if (left_p >= 0 && k != first) break;
    // If the root lies on the edge through which the cone enters, or at a corner in line with its
    // neighbours, the cone is half a turn wide. The end of the last edge then lies on its right side, or
    // beyond it by rounding.
    if (right_q > 0 || (wide && right_p > 0 && k + 1 == first + count)) {
      const Flat r = right_p >= 0 ? p : p + (q - p) * (right_p / (right_p - right_q));
      const Flat l = left_q <= 0 ? q : p + (q - p) * (left_p / (left_p - left_q));
      if (left_p < 0 || left_q < 0) open(e, root, r, l, g, parent);
    }
    p = q;
    right_p = right_q;
    left_p = left_q;
  }
}

void GeodesicSearch::spread_window(std::uint32_t node) {
  const Node n = nodes_[node];
  const std::uint32_t face = mesh_->edges[n.edge].face;
  const UnfoldedMesh::Face& f = mesh_->faces[face];
  // Seen from outside, the edge of the window runs from left to right, and the other edges from right to
  // left.
  spread(face, n.edge - f.first + 1, f.count - 1, n.root, {n.right - n.root, n.left - n.root}, n.g,
         node);
}

void GeodesicSearch::spread_vertex(std::uint32_t node) {
  const Node n = nodes_[node];
  const UnfoldedMesh::Edge& e = mesh_->edges[n.edge];
  if (n.g > distance_[e.vertex]) return;  // A shorter path was found.
  const UnfoldedMesh::Vertex& v = mesh_->vertices[e.vertex];
  const Flat along = mesh_->edges[mesh_->next(n.edge)].at - e.at, back = n.root - e.at;
  const double in = e.angle + std::atan2(cross(along, back), dot(along, back));
  // A path is straight or bends around the vertex: on both sides of it there is at least half a turn of
  // surface, or a wall.
  if (every_vertex_) {
    leave_vertex(e.vertex, n.g, node, 0, v.total);
  } else if (v.closed) {
    leave_vertex(e.vertex, n.g, node, in + kPi - kRounding, in + v.total - kPi + kRounding);
  } else {
    if (in - kPi > -kRounding) leave_vertex(e.vertex, n.g, node, 0.0, in - kPi + kRounding);
    if (in + kPi < v.total + kRounding) leave_vertex(e.vertex, n.g, node, in + kPi - kRounding, v.total);
  }
}

void GeodesicSearch::leave_vertex(std::uint32_t vertex, double g, std::uint32_t parent, double low,
                                  double high) {
  const UnfoldedMesh::Vertex& v = mesh_->vertices[vertex];
  // For a closed fan, the range may extend past its seam.
  for (const double seam : {-v.total, 0.0, v.total}) {
    if (seam != 0.0 && !v.closed) continue;
    for (std::uint32_t i = 0; i < v.count; ++i) {
      const std::uint32_t edge = mesh_->fans[v.first + i];
      const UnfoldedMesh::Edge& e = mesh_->edges[edge];
      const double from = e.angle + seam;
      const double to =
          seam + (i + 1 < v.count ? mesh_->edges[mesh_->fans[v.first + i + 1]].angle : v.total);
      if (!(low < to && high > from)) continue;
      const UnfoldedMesh::Face& f = mesh_->faces[e.face];
      const std::uint32_t after = mesh_->next(edge), before = mesh_->previous(edge);
      Cone cone{mesh_->edges[after].at - e.at, mesh_->edges[before].at - e.at};
      if (low <= from + kRounding) {
        reach(after, e.at, g, parent);
      } else {
        cone.right = turned(cone.right, low - from);
      }
      if (high >= to - kRounding) {
        reach(before, e.at, g, parent);
      } else {
        cone.left = turned(cone.left, high - to);
      }
      if (has_goal_ && e.face == goal_.face) {
        offer_goal(g + length(goal_.at - e.at), parent);
      }
      spread(e.face, edge - f.first + 1, f.count - 2, e.at, cone, g, parent);
    }
  }
}

}  // namespace gsnav::detail
