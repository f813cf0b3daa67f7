// SPDX-License-Identifier: Apache-2.0
#include "unfolded_mesh.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <utility>

#include "ground_plane.hpp"
#include "poly_sheets.hpp"
#include "tolerances.hpp"

namespace gsnav::detail {
namespace {

constexpr double kWeld = 1e-4;      // Metres. Closer points of an edge coincide.
constexpr double kStraight = 1e-9;  // Tolerance for a straight angle, radians.
constexpr std::uint64_t kWall = ~std::uint64_t{0};

/// Edge of the neighbour that lies against edge k of a polygon. kNone at a wall.
std::uint32_t opposite(const PolyMesh& m, const PolyMesh::Poly& p, PolyId id, std::uint32_t k) {
  const PolyId other = m.neighbours[p.first + k];
  if (other == kNoPoly) return UnfoldedMesh::kNone;
  const PolyMesh::Poly& q = m.polys[other];
  std::uint32_t found = UnfoldedMesh::kNone;
  double best = std::numeric_limits<double>::max();
  for (std::uint32_t j = 0; j < q.count; ++j) {
    if (m.neighbours[q.first + j] != id) continue;
    const double apart =
        norm(m.corner(q, j + 1) - m.corner(p, k)) + norm(m.corner(q, j) - m.corner(p, k + 1));
    if (apart < best) {
      best = apart;
      found = q.first + j;
    }
  }
  return found;
}

/// Point at which an edge of a polygon is cut.
struct EdgeCut {
  double t = 0;           ///< Fraction of the edge's length.
  std::uint64_t key = 0;  ///< Key of the part up to the next cut, equal on both sides. kWall at a wall.
};
using Cuts = std::vector<std::vector<EdgeCut>>;  ///< Indexed by the edge of a polygon.

/// Positions at which edge e is cut, as sorted fractions of its length. They are the ends of the parts
/// of e, and of the parts of f, the edge of the neighbour along e.
std::vector<double> cut_places(const PolySheets& sheets, std::uint32_t e, std::uint32_t f,
                               double length) {
  std::vector<double> at;
  for (const EdgePart& s : sheets.parts(e)) at.insert(at.end(), {s.t0, s.t1});
  if (f != UnfoldedMesh::kNone) {
    for (const EdgePart& s : sheets.parts(f)) at.insert(at.end(), {1 - s.t0, 1 - s.t1});
  }
  std::sort(at.begin(), at.end());
  const double weld = kWeld / max(length, kWeld);
  at.erase(std::unique(at.begin(), at.end(), [&](double a, double b) { return b - a < weld; }),
           at.end());
  return at;
}

/// Cuts both sides of a common edge at the corners of both neighbours, which may be at different
/// positions. The parts in between then become twins.
Cuts cut_edges(const PolyMesh& mesh, const PolySheets& sheets) {
  constexpr std::uint32_t none = UnfoldedMesh::kNone;
  Cuts cuts(mesh.corners.size());
  std::uint64_t keys = 0;
  for (PolyId id = 0; id < mesh.polys.size(); ++id) {
    const PolyMesh::Poly& p = mesh.polys[id];
    for (std::uint32_t k = 0; k < p.count; ++k) {
      const std::uint32_t e = p.first + k, f = opposite(mesh, p, id, k);
      if (f != none && f < e) continue;
      const double length = norm(mesh.corner(p, k + 1) - mesh.corner(p, k));
      for (const double t : cut_places(sheets, e, f, length)) {
        cuts[e].push_back({t, f == none ? kWall : keys});
        if (f != none) cuts[f].push_back({1 - t, keys - 1});
        ++keys;
      }
      // Seen from its other end, a part begins at the next cut.
      if (f != none) std::reverse(cuts[f].begin(), cuts[f].end());
    }
  }
  return cuts;
}

/// Makes a face from each sheet, with one edge per part between cuts.
class FaceMaker {
 public:
  FaceMaker(const PolyMesh& mesh, const Cuts& cuts, UnfoldedMesh& out)
      : mesh_(mesh), cuts_(cuts), out_(out) {}

  void begin_polygon() {
    out_.first_face.push_back(static_cast<std::uint32_t>(out_.faces.size()));
    inner_.clear();
  }

  void add(const Sheet& sheet) {
    UnfoldedMesh::Face face;
    face.first = static_cast<std::uint32_t>(out_.edges.size());
    face.poly = sheet.poly;
    for (std::size_t k = 0; k < sheet.corners.size(); ++k) {
      const Vec3d &a = sheet.corners[k], &b = sheet.corners[(k + 1) % sheet.corners.size()];
      if (sheet.sides[k] == Sheet::kInside) {
        add_inner_edge(a, b);
      } else {
        add_stretches(mesh_.polys[sheet.poly], sheet.sides[k], a, b);
      }
    }
    face.count = static_cast<std::uint32_t>(out_.edges.size()) - face.first;
    const Vec3d n = normal_of(sheet.corners);
    const Vec3d axis = std::abs(n.x) < 0.99 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    face.u = normalized(axis - n * gsnav::dot(n, axis));
    face.v = gsnav::cross(face.u, n);
    out_.faces.push_back(face);
  }

  /// Joins the polygons. Call after the last one.
  void join_polygons() {
    begin_polygon();
    std::sort(keyed_.begin(), keyed_.end());
    for (std::size_t i = 0; i + 1 < keyed_.size(); ++i) {
      if (keyed_[i].first == keyed_[i + 1].first) join(keyed_[i].second, keyed_[i + 1].second);
    }
  }

 private:
  std::uint32_t add_edge(const Vec3d& corner) {
    UnfoldedMesh::Edge e;
    e.corner = corner;
    e.face = static_cast<std::uint32_t>(out_.faces.size());
    out_.edges.push_back(e);
    return static_cast<std::uint32_t>(out_.edges.size() - 1);
  }

  void join(std::uint32_t e, std::uint32_t f) {
    out_.edges[e].twin = f;
    out_.edges[f].twin = e;
  }

  /// Adds an edge between two sheets of one polygon.
  void add_inner_edge(const Vec3d& a, const Vec3d& b) {
    const std::uint32_t e = add_edge(a);
    const auto twin = inner_.find({b.x, b.y, b.z, a.x, a.y, a.z});
    if (twin != inner_.end()) {
      join(e, twin->second);
    } else {
      inner_[{a.x, a.y, a.z, b.x, b.y, b.z}] = e;
    }
  }

  /// Adds the edges of a sheet from a to b, on edge `side` of the polygon.
  void add_stretches(const PolyMesh::Poly& poly, std::uint32_t side, const Vec3d& a, const Vec3d& b) {
    const std::vector<EdgeCut>& cut = cuts_[poly.first + side];
    const Vec3d &p = mesh_.corner(poly, side), &q = mesh_.corner(poly, side + 1);
    const double t0 = fraction_xz(p, q, a), t1 = fraction_xz(p, q, b);
    const auto nearest = [&](double t) {
      std::size_t best = 0;
      for (std::size_t i = 1; i < cut.size(); ++i) {
        if (std::abs(cut[i].t - t) < std::abs(cut[best].t - t)) best = i;
      }
      return best;
    };
    const std::size_t first = nearest(t0), end = max(nearest(t1), first + 1);
    for (std::size_t i = first; i < end && i < cut.size(); ++i) {
      const std::uint32_t e = add_edge(i == first ? a : lerp(a, b, (cut[i].t - t0) / (t1 - t0)));
      if (cut[i].key != kWall) keyed_.push_back({cut[i].key, e});
    }
  }

  const PolyMesh& mesh_;
  const Cuts& cuts_;
  UnfoldedMesh& out_;
  std::map<std::array<double, 6>, std::uint32_t> inner_;  ///< Edges of the current polygon by their
                                                          ///< ends.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed_;  ///< Pairs (key of the part, edge).
};

}  // namespace

UnfoldedMesh::UnfoldedMesh(const PolyMesh& mesh) {
  add_faces(mesh);
  unfold();
  fan_out();
}

void UnfoldedMesh::add_faces(const PolyMesh& mesh) {
  PolySheets sheets(mesh);
  for (PolyId id = 0; id < mesh.polys.size(); ++id) {
    const auto first = static_cast<std::uint32_t>(sheets.all().size());
    const bool by_triangle = sheets.add(id);
    grid.add(mesh, id, by_triangle, first);
  }
  const Cuts cuts = cut_edges(mesh, sheets);
  FaceMaker maker(mesh, cuts, *this);
  std::size_t s = 0;
  for (PolyId id = 0; id < mesh.polys.size(); ++id) {
    maker.begin_polygon();
    for (; s < sheets.all().size() && sheets.all()[s].poly == id; ++s) maker.add(sheets.all()[s]);
  }
  maker.join_polygons();
}

void UnfoldedMesh::unfold() {
  for (Edge& e : edges) e.at = flat(faces[e.face], e.corner);
  for (std::uint32_t i = 0; i < edges.size(); ++i) {
    Edge& e = edges[i];
    if (e.twin == kNone) continue;
    const Flat a = e.at, b = edges[next(i)].at, c = edges[next(e.twin)].at, d = edges[e.twin].at;
    e.same_plane = length(c - a) < 1e-11 && length(d - b) < 1e-11;
    if (e.same_plane) continue;
    const Flat from = b - a, to = d - c;
    const double scale = 1.0 / max(length(from) * length(to), 1e-300);
    const double co = dot(from, to) * scale, si = cross(from, to) * scale, l = std::hypot(co, si);
    e.cosine = l > 0 ? co / l : 1.0;
    e.sine = l > 0 ? si / l : 0.0;
    const Flat mid = (a + b) * 0.5, goal = (c + d) * 0.5;
    e.dx = goal.x - (e.cosine * mid.x - e.sine * mid.y);
    e.dy = goal.y - (e.sine * mid.x + e.cosine * mid.y);
  }
}

void UnfoldedMesh::fan_out() {
  // Polygons of a file may overlap, so that an edge is the twin of two others. Edges that are not mutual
  // twins become walls.
  std::vector<std::uint32_t> twins(edges.size());
  for (std::uint32_t e = 0; e < edges.size(); ++e) twins[e] = edges[e].twin;
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    if (twins[e] != kNone && twins[twins[e]] != e) edges[e].twin = kNone;
  }
  for (Edge& e : edges) e.vertex = kNone;
  for (std::uint32_t i = 0; i < edges.size(); ++i) {
    if (edges[i].vertex != kNone) continue;
    Vertex v;
    v.first = static_cast<std::uint32_t>(fans.size());
    std::uint32_t start = i;
    while (edges[start].twin != kNone) {
      start = next(edges[start].twin);
      if (start == i) {
        v.closed = true;
        break;
      }
    }
    for (std::uint32_t e = start;;) {
      edges[e].vertex = static_cast<std::uint32_t>(vertices.size());
      edges[e].angle = v.total;
      fans.push_back(e);
      const std::uint32_t last = previous(e);
      const Flat a = edges[next(e)].at - edges[e].at, b = edges[last].at - edges[e].at;
      v.total += std::abs(std::atan2(cross(a, b), dot(a, b)));
      e = edges[last].twin;
      if (e == kNone || e == start) break;
    }
    v.count = static_cast<std::uint32_t>(fans.size()) - v.first;
    v.turning = v.total > (v.closed ? 2 * kPi : kPi) + kStraight;
    vertices.push_back(v);
  }
}

}  // namespace gsnav::detail
