// SPDX-License-Identifier: Apache-2.0
#include "face_views.hpp"

#include <array>
#include <cmath>

#include "gsnav/math/functions.hpp"

namespace gsnav::detail {
namespace {

constexpr double kTouching = 1e-8;       // m²: a point that only touches a beam is in it.
constexpr double kShort = 1e-6;          // Metres: closer points define no direction.
constexpr double kPoint = 1e-9;          // Metres: shorter edges are points.
constexpr double kSameDirection = 1e-7;  // Radians: directions closer than this are equal.
constexpr double kRangeSlack = 1e-6;     // Margin on each side of a range, as a fraction of the edge.

/// A beam: all straight lines that cross a first edge and every edge since, as they enter a face, in its
/// plane. No line is to the right of the line from the left end of the first edge to `right`, or to the
/// left of the line from its right end to `left`.
struct Beam {
  std::uint32_t edge = 0;
  Flat first_right, first_left, right, left;
  Flat rightmost, leftmost;  ///< Directions that bound those of the lines. They are at most half a turn
                             ///< apart.
};

Beam enter(const UnfoldedMesh::Edge& e, const Beam& b) noexcept {
  const auto turned = [&](const Flat& d) {
    return e.same_plane ? d : Flat{e.cosine * d.x - e.sine * d.y, e.sine * d.x + e.cosine * d.y};
  };
  return {e.twin,
          UnfoldedMesh::across(e, b.first_right),
          UnfoldedMesh::across(e, b.first_left),
          UnfoldedMesh::across(e, b.right),
          UnfoldedMesh::across(e, b.left),
          turned(b.rightmost),
          turned(b.leftmost)};
}

/// Limits the directions of a beam to those between `right` and `left`. A limit is applied only if it is
/// within half a turn and tighter. Returns false if none remains.
bool bound(Beam& b, const Flat& right, const Flat& left) noexcept {
  if (cross(b.rightmost, right) > 0) b.rightmost = right;
  if (cross(left, b.leftmost) > 0) b.leftmost = left;
  const double c = cross(b.rightmost, b.leftmost);
  return !(c < 0 && c * c > kSameDirection * kSameDirection * dot(b.rightmost, b.rightmost) *
                                dot(b.leftmost, b.leftmost));
}

/// Limits the directions of a beam to those that leave the face across edge `e`. Returns false if none
/// remains.
bool cross_edge(Beam& b, const Flat& e) noexcept {
  const Flat back = e * -1.0;
  if (cross(b.rightmost, back) > 0) return bound(b, back, b.leftmost);
  if (cross(b.rightmost, back) < 0) return bound(b, b.rightmost, e);
  return dot(b.rightmost, back) > 0;
}

/// Limits the directions of a beam by the ends of the first edge and of the last window. Returns false
/// if none remains.
bool look_ahead(Beam& b) noexcept {
  // Lines cross the first edge outwards, so only points on that side limit them.
  const Flat first = b.first_left - b.first_right, right = b.right - b.first_left,
             left = b.left - b.first_right;
  const auto bounds = [&](const Flat& d) { return cross(first, d) < 0 && dot(d, d) > kShort * kShort; };
  return bound(b, bounds(right) ? right : b.rightmost, bounds(left) ? left : b.leftmost);
}

/// Position of a direction on the scale of FaceViews::Range, not rounded.
double step_of(const Flat& direction, const Flat& edge) noexcept {
  const double x = dot(direction, edge), y = max(-cross(edge, direction), 0.0), sum = std::abs(x) + y;
  return (x / sum + 1.0) * (0.5 * FaceViews::kSteps);
}

constexpr std::array<double, FaceViews::kSteps + 1> kCotangents = [] {
  std::array<double, FaceViews::kSteps + 1> c{};
  for (std::size_t k = 1; k < FaceViews::kSteps; ++k) {
    const double x = 2.0 * static_cast<double>(k) / FaceViews::kSteps - 1.0;
    c[k] = x / (1.0 - (x < 0 ? -x : x));
  }
  return c;
}();

}  // namespace

FaceViews::FaceViews(const UnfoldedMesh& mesh) {
  const std::size_t faces = mesh.faces.size();
  if (faces == 0 || mesh.edges.size() > kMostPairs / faces) return;
  edges_ = mesh.edges.size();
  ranges_.resize(faces * edges_);
  const std::size_t most = kMostBeams / edges_ + 1;
  for (std::uint32_t e = 0; e < edges_; ++e) {
    if (look_through(mesh, e, most)) continue;
    for (std::size_t goal = 0; goal < faces; ++goal) ranges_[goal * edges_ + e] = {0, kSteps};
  }
  // Visibility is mutual: if b does not see a, a does not see b.
  const auto sees = [&](std::size_t from, std::size_t goal) {
    const UnfoldedMesh::Face& f = mesh.faces[from];
    for (std::size_t e = f.first; e < f.first + f.count; ++e) {
      if (ranges_[goal * edges_ + e].low <= ranges_[goal * edges_ + e].high) return true;
    }
    return false;
  };
  const auto forget = [&](std::size_t from, std::size_t goal) {
    const UnfoldedMesh::Face& f = mesh.faces[from];
    for (std::size_t e = f.first; e < f.first + f.count; ++e) ranges_[goal * edges_ + e] = {};
  };
  for (std::size_t a = 0; a < faces; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const bool there = sees(a, b), back = sees(b, a);
      if (there && !back) forget(a, b);
      if (back && !there) forget(b, a);
    }
  }
}

bool FaceViews::narrow(Range range, double along, double inside, double& right, double& left) noexcept {
  if (range.low > range.high) return false;
  if (range.low > 0) right = max(right, along + inside * kCotangents[range.low] - kRangeSlack);
  if (range.high < kSteps) left = min(left, along + inside * kCotangents[range.high] + kRangeSlack);
  return right < left;
}

bool FaceViews::look_through(const UnfoldedMesh& mesh, std::uint32_t edge, std::size_t most) {
  const UnfoldedMesh::Edge& from = mesh.edges[edge];
  if (from.twin == UnfoldedMesh::kNone) return true;
  const Flat right = from.at, left = mesh.edges[mesh.next(edge)].at;
  if (!(length(left - right) > kPoint))
    return false;  // Occurs only in files: such an edge has no
                   // direction.
  std::vector<Beam> open{enter(from, {edge, right, left, right, left, right - left, left - right})};
  for (std::size_t n = 0; !open.empty(); ++n) {
    if (n == most) return false;
    const Beam b = open.back();
    open.pop_back();
    const UnfoldedMesh::Face& face = mesh.faces[mesh.edges[b.edge].face];
    const Flat first = b.first_left - b.first_right;
    Range& range = ranges_[std::size_t{mesh.edges[b.edge].face} * edges_ + edge];
    range.low = min(range.low, static_cast<std::uint8_t>(std::floor(step_of(b.rightmost, first))));
    range.high = max(range.high, static_cast<std::uint8_t>(std::ceil(step_of(b.leftmost, first))));
    // The outermost lines cross between the ends.
    const Flat to_right = b.right - b.first_left, to_left = b.left - b.first_right;
    std::uint32_t e = mesh.next(b.edge);
    for (std::uint32_t k = 1; k < face.count; ++k, e = mesh.next(e)) {
      if (mesh.edges[e].twin == UnfoldedMesh::kNone) continue;
      const Flat p = mesh.edges[e].at, q = mesh.edges[mesh.next(e)].at;
      const double right_p = cross(to_right, p - b.first_left),
                   right_q = cross(to_right, q - b.first_left);
      const double left_p = cross(to_left, p - b.first_right),
                   left_q = cross(to_left, q - b.first_right);
      if (max(right_p, right_q) < -kTouching || min(left_p, left_q) > kTouching) continue;
      const auto cut = [&](double at_p, double at_q) {
        return p + (q - p) * clamp(at_p / (at_p - at_q), 0.0, 1.0);
      };
      const Flat r = right_p < 0 && right_q > right_p ? cut(right_p, right_q) : p;
      const Flat l = left_q > 0 && left_q > left_p ? cut(left_p, left_q) : q;
      // If an end of the first edge lies beyond this edge, it sees it from behind and sets no limit.
      const bool by_right = cross(r - b.first_left, l - b.first_left) > 0;
      const bool by_left = cross(l - b.first_right, r - b.first_right) < 0;
      Beam next{e,           b.first_right, b.first_left, by_right ? r : b.right, by_left ? l : b.left,
                b.rightmost, b.leftmost};
      if (cross_edge(next, q - p) && look_ahead(next)) open.push_back(enter(mesh.edges[e], next));
    }
  }
  return true;
}

}  // namespace gsnav::detail
