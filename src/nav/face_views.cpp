// SPDX-License-Identifier: Apache-2.0
#include "face_views.hpp"

#include "gsnav/math/functions.hpp"

namespace gsnav::detail {
namespace {

constexpr double kRounding = 1e-8;  // square metres: what only touches a beam is in it

/// The lines across a first edge and all that they crossed since, as they enter a face; in its plane.
/// None is right of the line from the first edge's left end to `right`, or left of that from its right
/// end to `left`.
struct Beam {
  std::uint32_t edge = 0;
  Flat first_right, first_left, right, left;
};

Beam enter(const UnfoldedMesh::Edge& e, const Beam& b) noexcept {
  return {e.twin, UnfoldedMesh::across(e, b.first_right), UnfoldedMesh::across(e, b.first_left),
          UnfoldedMesh::across(e, b.right), UnfoldedMesh::across(e, b.left)};
}

}  // namespace

FaceViews::FaceViews(const UnfoldedMesh& mesh) {
  if (mesh.faces.empty() || mesh.faces.size() > kMostFaces) return;
  faces_ = mesh.faces.size();
  through_.assign(faces_ * faces_, 0);
  const std::size_t most = kMostBeams / mesh.edges.size() + 1;
  for (std::uint32_t f = 0; f < faces_; ++f) {
    for (std::uint32_t k = 0; k < mesh.faces[f].count; ++k) {
      if (look_through(mesh, mesh.faces[f].first + k, most)) continue;
      for (std::size_t goal = 0; goal < faces_; ++goal) through_[goal * faces_ + f] |= bit(k);
    }
  }
  // Who is not seen does not see.
  for (std::size_t a = 0; a < faces_; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      std::uint8_t &there = through_[a * faces_ + b], &back = through_[b * faces_ + a];
      if (there == 0 || back == 0) there = back = 0;
    }
  }
}

bool FaceViews::look_through(const UnfoldedMesh& mesh, std::uint32_t edge, std::size_t most) {
  const UnfoldedMesh::Edge& from = mesh.edges[edge];
  if (from.twin == UnfoldedMesh::kNone) return true;
  const std::uint8_t mark = bit(edge - mesh.faces[from.face].first);
  const Flat right = from.at, left = mesh.edges[mesh.next(edge)].at;
  std::vector<Beam> open{enter(from, {edge, right, left, right, left})};
  for (std::size_t n = 0; !open.empty(); ++n) {
    if (n == most) return false;
    const Beam b = open.back();
    open.pop_back();
    const UnfoldedMesh::Face& face = mesh.faces[mesh.edges[b.edge].face];
    through_[std::size_t{mesh.edges[b.edge].face} * faces_ + from.face] |= mark;
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
      if (max(right_p, right_q) < -kRounding || min(left_p, left_q) > kRounding) continue;
      const auto cut = [&](double at_p, double at_q) {
        return p + (q - p) * clamp(at_p / (at_p - at_q), 0.0, 1.0);
      };
      const Flat r = right_p < 0 && right_q > right_p ? cut(right_p, right_q) : p;
      const Flat l = left_q > 0 && left_q > left_p ? cut(left_p, left_q) : q;
      // An end of the first edge that is beyond this one sees it from behind, which limits nothing.
      const bool by_right = cross(r - b.first_left, l - b.first_left) > 0;
      const bool by_left = cross(l - b.first_right, r - b.first_right) < 0;
      open.push_back(enter(mesh.edges[e], {e, b.first_right, b.first_left, by_right ? r : b.right,
                                           by_left ? l : b.left}));
    }
  }
  return true;
}

}  // namespace gsnav::detail
