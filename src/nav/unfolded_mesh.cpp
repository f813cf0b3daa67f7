// SPDX-License-Identifier: Apache-2.0
#include "unfolded_mesh.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <utility>

#include "ground_plane.hpp"

namespace gsnav::detail {
namespace {

constexpr double kLevel = 1e-3;     // metres: a polygon this flat is one face
constexpr double kWeld = 1e-4;      // metres: points of an edge closer than this are one
constexpr double kBeside = 1e-2;    // metres: how far off its edge a polygon's height sample may lie
constexpr double kSliver = 1e-8;    // square metres
constexpr double kStraight = 1e-9;  // radians
constexpr double kPi = 3.14159265358979323846;
constexpr std::uint64_t kWall = ~std::uint64_t{0};
constexpr std::uint32_t kInside = UnfoldedMesh::kNone;

/// A face before its sides are split at its neighbours' corners.
struct Sheet {
  PolyId poly = 0;
  std::vector<Vec3d> corners;
  std::vector<std::uint32_t> sides;  ///< the polygon's edge that each edge lies on, or kInside
};

/// A part of a polygon's edge: the edge of a sheet on it, from t0 to t1 of its length.
struct Part {
  std::size_t sheet = 0, edge = 0;
  double t0 = 0, t1 = 1;
};

Vec3d normal_of(const std::vector<Vec3d>& c) {
  Vec3d n{};
  for (std::size_t k = 1; k + 1 < c.size(); ++k) n += gsnav::cross(c[k + 1] - c[0], c[k] - c[0]);
  const double l = norm(n);
  return l > 0 ? n * (1.0 / l) : Vec3d{0, 1, 0};
}

class Builder {
 public:
  explicit Builder(const PolyMesh& m) : m_(m), parts_(m.corners.size()) {}

  /// True where the polygon's sheets are its height triangles, in order.
  bool add(PolyId id, std::vector<Sheet>& sheets) {
    const PolyMesh::Poly& p = m_.polys[id];
    bool by_triangle = false;
    std::vector<Vec3d> corners(m_.corners.begin() + p.first, m_.corners.begin() + p.first + p.count);
    std::vector<Sheet> own;
    if (level(p, corners)) {
      own.push_back({id, std::move(corners), {}});
      for (std::uint32_t k = 0; k < p.count; ++k) own[0].sides.push_back(k);
    } else {
      by_triangle = from_heights(id, own);
      if (!by_triangle) own = clipped(id, corners);
    }
    for (Sheet& s : own) {
      for (std::size_t e = 0; e < s.sides.size(); ++e) {
        if (s.sides[e] == kInside) continue;
        const Vec3d &a = m_.corner(p, s.sides[e]), &b = m_.corner(p, s.sides[e] + 1);
        const double t0 = along_xz(a, b, s.corners[e]).first;
        const double t1 = along_xz(a, b, s.corners[(e + 1) % s.corners.size()]).first;
        parts_[p.first + s.sides[e]].push_back({sheets.size(), e, t0, t1});
      }
      sheets.push_back(std::move(s));
    }
    return by_triangle;
  }

  const std::vector<Part>& parts(std::uint32_t edge) const { return parts_[edge]; }

 private:
  bool level(const PolyMesh::Poly& p, const std::vector<Vec3d>& corners) const {
    const Vec3d n = normal_of(corners);
    const auto off = [&](const Vec3d& q) { return std::abs(gsnav::dot(n, q - corners[0])) > kLevel; };
    if (!(n.y > 0.1) || std::any_of(corners.begin(), corners.end(), off)) return false;
    for (std::uint32_t t = p.tri_first; t < p.tri_first + p.tri_count; ++t) {
      const std::array<Vec3d, 3> tri = m_.triangle(m_.tris[t]);
      if (std::any_of(tri.begin(), tri.end(), off)) return false;
    }
    return true;
  }

  /// The height triangles as sheets; false where they are no proper mesh of the polygon.
  bool from_heights(PolyId id, std::vector<Sheet>& own) const {
    const PolyMesh::Poly& p = m_.polys[id];
    std::vector<double> covered(p.count, 0.0);
    for (std::uint32_t t = p.tri_first; t < p.tri_first + p.tri_count; ++t) {
      std::array<Vec3d, 3> tri = m_.triangle(m_.tris[t]);
      if (area_xz(tri[0], tri[1], tri[2]) < 0) std::swap(tri[1], tri[2]);
      if (!(area_xz(tri[0], tri[1], tri[2]) > kSliver)) return false;
      own.push_back({id, {tri.begin(), tri.end()}, {kInside, kInside, kInside}});
    }
    const auto shared = [&](const Vec3d& a, const Vec3d& b) {
      return std::any_of(own.begin(), own.end(), [&](const Sheet& s) {
        return (s.corners[0] == b && s.corners[1] == a) || (s.corners[1] == b && s.corners[2] == a) ||
               (s.corners[2] == b && s.corners[0] == a);
      });
    };
    for (Sheet& s : own) {
      for (std::size_t e = 0; e < 3; ++e) {
        const Vec3d &a = s.corners[e], &b = s.corners[(e + 1) % 3];
        if (shared(a, b)) continue;
        double best = kBeside;
        for (std::uint32_t k = 0; k < p.count; ++k) {
          const auto [ta, da] = along_xz(m_.corner(p, k), m_.corner(p, k + 1), a);
          const auto [tb, db] = along_xz(m_.corner(p, k), m_.corner(p, k + 1), b);
          if (max(da, db) >= best || !(tb > ta)) continue;
          best = max(da, db);
          s.sides[e] = k;
        }
        if (s.sides[e] == kInside) return false;
        const Vec3d &u = m_.corner(p, s.sides[e]), &v = m_.corner(p, s.sides[e] + 1);
        covered[s.sides[e]] += along_xz(u, v, b).first - along_xz(u, v, a).first;
      }
    }
    return std::all_of(covered.begin(), covered.end(), [](double c) { return std::abs(c - 1) < 1e-3; });
  }

  /// The polygon cut into triangles, the fattest ear first.
  static std::vector<Sheet> clipped(PolyId id, const std::vector<Vec3d>& c) {
    std::vector<Sheet> own;
    std::vector<std::uint32_t> left;
    const auto n = static_cast<std::uint32_t>(c.size());
    for (std::uint32_t k = 0; k < n; ++k) left.push_back(k);
    while (left.size() >= 3) {
      std::size_t ear = 0;
      double best = -1;
      for (std::size_t k = 0; k < left.size(); ++k) {
        const Vec3d &a = c[left[(k + left.size() - 1) % left.size()]], &b = c[left[k]],
                    &d = c[left[(k + 1) % left.size()]];
        const double quality = area_xz(a, b, d) / gsnav::dot(d - a, d - a);
        if (quality > best) {
          best = quality;
          ear = k;
        }
      }
      const std::uint32_t i[3] = {left[(ear + left.size() - 1) % left.size()], left[ear],
                                  left[(ear + 1) % left.size()]};
      Sheet s{id, {c[i[0]], c[i[1]], c[i[2]]}, {}};
      for (std::size_t e = 0; e < 3; ++e) {
        s.sides.push_back(i[(e + 1) % 3] == (i[e] + 1) % n ? i[e] : kInside);
      }
      own.push_back(std::move(s));
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    return own;
  }

  const PolyMesh& m_;
  std::vector<std::vector<Part>> parts_;
};

/// The neighbour's edge that lies against edge k of a polygon, kNone at a wall.
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

}  // namespace

UnfoldedMesh::UnfoldedMesh(const PolyMesh& mesh) {
  add_faces(mesh);
  unfold();
  fan_out();
}

void UnfoldedMesh::add_faces(const PolyMesh& mesh) {
  Builder builder(mesh);
  std::vector<Sheet> sheets;
  for (PolyId id = 0; id < mesh.polys.size(); ++id) {
    const auto first = static_cast<std::uint32_t>(sheets.size());
    const bool by_triangle = builder.add(id, sheets);
    grid.add(mesh, id, by_triangle, first);
  }

  // Neighbours may have their corners at different places of a common edge: each side gets all of them,
  // and stretches between the same two are twins.
  std::vector<std::vector<std::pair<double, std::uint64_t>>> cuts(mesh.corners.size());
  std::uint64_t keys = 0;
  for (PolyId id = 0; id < mesh.polys.size(); ++id) {
    const PolyMesh::Poly& p = mesh.polys[id];
    for (std::uint32_t k = 0; k < p.count; ++k) {
      const std::uint32_t e = p.first + k, f = opposite(mesh, p, id, k);
      if (f != kNone && f < e) continue;
      std::vector<double> at;
      for (const Part& s : builder.parts(e)) at.insert(at.end(), {s.t0, s.t1});
      if (f != kNone) {
        for (const Part& s : builder.parts(f)) at.insert(at.end(), {1 - s.t0, 1 - s.t1});
      }
      std::sort(at.begin(), at.end());
      const double weld = kWeld / max(norm(mesh.corner(p, k + 1) - mesh.corner(p, k)), kWeld);
      at.erase(std::unique(at.begin(), at.end(), [&](double a, double b) { return b - a < weld; }),
               at.end());
      for (const double t : at) {
        cuts[e].push_back({t, f == kNone ? kWall : keys});
        if (f != kNone) cuts[f].push_back({1 - t, keys - 1});
        ++keys;
      }
      // Read from its far end, a stretch belongs to the cut before it.
      if (f != kNone) std::reverse(cuts[f].begin(), cuts[f].end());
    }
  }

  std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed;
  std::map<std::array<double, 7>, std::uint32_t> inner;
  std::size_t s = 0;
  for (PolyId id = 0; id < mesh.polys.size(); ++id) {
    first_face.push_back(static_cast<std::uint32_t>(faces.size()));
    inner.clear();
    for (; s < sheets.size() && sheets[s].poly == id; ++s) {
      const Sheet& sheet = sheets[s];
      Face face;
      face.first = static_cast<std::uint32_t>(edges.size());
      face.poly = id;
      const auto add = [&](const Vec3d& corner) {
        Edge e;
        e.corner = corner;
        e.face = static_cast<std::uint32_t>(faces.size());
        edges.push_back(e);
        return static_cast<std::uint32_t>(edges.size() - 1);
      };
      for (std::size_t k = 0; k < sheet.corners.size(); ++k) {
        const Vec3d &a = sheet.corners[k], &b = sheet.corners[(k + 1) % sheet.corners.size()];
        if (sheet.sides[k] == kInside) {
          const std::uint32_t e = add(a);
          const auto twin = inner.find({b.x, b.y, b.z, a.x, a.y, a.z, 0});
          if (twin != inner.end()) {
            edges[e].twin = twin->second;
            edges[twin->second].twin = e;
          } else {
            inner[{a.x, a.y, a.z, b.x, b.y, b.z, 0}] = e;
          }
          continue;
        }
        const auto& cut = cuts[mesh.polys[id].first + sheet.sides[k]];
        const Vec3d &p = mesh.corner(mesh.polys[id], sheet.sides[k]),
                    &q = mesh.corner(mesh.polys[id], sheet.sides[k] + 1);
        const double t0 = along_xz(p, q, a).first, t1 = along_xz(p, q, b).first;
        const auto nearest = [&](double t) {
          std::size_t best = 0;
          for (std::size_t i = 1; i < cut.size(); ++i) {
            if (std::abs(cut[i].first - t) < std::abs(cut[best].first - t)) best = i;
          }
          return best;
        };
        const std::size_t i0 = nearest(t0), i1 = max(nearest(t1), i0 + 1);
        for (std::size_t i = i0; i < i1 && i < cut.size(); ++i) {
          const std::uint32_t e = add(i == i0 ? a : lerp(a, b, (cut[i].first - t0) / (t1 - t0)));
          if (cut[i].second != kWall) keyed.push_back({cut[i].second, e});
        }
      }
      face.count = static_cast<std::uint32_t>(edges.size()) - face.first;
      const Vec3d n = normal_of(sheet.corners);
      const Vec3d axis = std::abs(n.x) < 0.99 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
      face.u = normalized(axis - n * gsnav::dot(n, axis));
      face.v = gsnav::cross(face.u, n);
      faces.push_back(face);
    }
  }
  first_face.push_back(static_cast<std::uint32_t>(faces.size()));
  std::sort(keyed.begin(), keyed.end());
  for (std::size_t i = 0; i + 1 < keyed.size(); ++i) {
    if (keyed[i].first != keyed[i + 1].first) continue;
    edges[keyed[i].second].twin = keyed[i + 1].second;
    edges[keyed[i + 1].second].twin = keyed[i].second;
  }
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
  // Polygons of a file may lie on one another, so that an edge is two others' twin: what is not both
  // ways is a wall.
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
