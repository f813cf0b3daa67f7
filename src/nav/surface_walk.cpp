// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <limits>

#include "ground_plane.hpp"
#include "poly_mesh.hpp"

// A straight walk crosses convex polygons one after the other. Only at a corner or a wall, where it
// makes no progress, all polygons around the point are examined. The polygon that the direction enters,
// or the wall along which it slides farthest, is then chosen independently of the polygon that it came
// from.

namespace gsnav::detail {
namespace {

constexpr double kTouch = 1e-9;       // Metres. Closer points coincide.
constexpr double kParallel = 1e-12;   // Sine below which directions are parallel.
constexpr std::size_t kMaxFan = 64;   // Polygons around one point.
constexpr double kOffSurface = 0.01;  // Metres. A leg that leaves the surface by more is split.

struct Exit {
  double t = std::numeric_limits<double>::max();  // In units of the given direction.
  std::uint32_t edge = 0;
  bool found = false;
};

struct Direction {
  double x = 0, z = 0;
  double length() const noexcept { return std::sqrt(x * x + z * z); }
};

Exit exit_of(const PolyMesh& m, PolyId id, const Vec3d& p, const Direction& d) noexcept {
  const PolyMesh::Poly& poly = m.polys[id];
  const double least = kParallel * kParallel * (d.x * d.x + d.z * d.z);
  Exit best;
  for (std::uint32_t k = 0; k < poly.count; ++k) {
    const Vec3d &a = m.corner(poly, k), &b = m.corner(poly, k + 1);
    const double nx = b.z - a.z, nz = a.x - b.x;  // Outward normal. Corners are counter-clockwise.
    const double rate = d.x * nx + d.z * nz;
    if (!(rate > 0 && rate * rate > least * (nx * nx + nz * nz))) continue;
    const double t = max(((a.x - p.x) * nx + (a.z - p.z) * nz) / rate, 0.0);
    if (t < best.t) best = {t, k, true};
  }
  return best;
}

bool touches(const Vec3d& a, const Vec3d& b, const Vec3d& p) noexcept {
  return distance2_xz(nearest_xz(a, b, p), p) <= kTouch * kTouch;
}

struct Fan {
  PolyId polys[kMaxFan];
  std::size_t count = 0;
};

/// All polygons that meet at p, found across edges that touch it.
Fan fan_at(const PolyMesh& m, PolyId start, const Vec3d& p) noexcept {
  Fan fan;
  fan.polys[fan.count++] = start;
  for (std::size_t i = 0; i < fan.count; ++i) {
    const PolyMesh::Poly& poly = m.polys[fan.polys[i]];
    for (std::uint32_t k = 0; k < poly.count; ++k) {
      const PolyId n = m.neighbours[poly.first + k];
      if (n == kNoPoly || fan.count == kMaxFan) continue;
      if (std::find(fan.polys, fan.polys + fan.count, n) != fan.polys + fan.count) continue;
      if (touches(m.corner(poly, k), m.corner(poly, k + 1), p)) fan.polys[fan.count++] = n;
    }
  }
  return fan;
}

/// Continuation from p: the polygon that is entered, the direction, and where that leaves the polygon.
struct PolyCrossing {
  PolyId poly = kNoPoly;
  Direction d{};
  Exit exit{};
};

bool progresses(const Exit& e, const Direction& d) noexcept {
  return !e.found || e.t * d.length() > kTouch;
}

PolyCrossing enter(const PolyMesh& m, const Fan& fan, const Vec3d& p, const Direction& d) noexcept {
  PolyCrossing best;
  for (std::size_t i = 0; i < fan.count; ++i) {
    const Exit e = exit_of(m, fan.polys[i], p, d);
    if (progresses(e, d) && (best.poly == kNoPoly || e.t > best.exit.t)) best = {fan.polys[i], d, e};
  }
  return best;
}

/// Fastest motion along a wall that stops direction d at p. Sets `normal` to the wall's normal.
PolyCrossing slide_along_wall(const PolyMesh& m, const Fan& fan, const Vec3d& p, const Direction& d,
                              bool slide, Vec3d& normal) noexcept {
  PolyCrossing best;
  double best_speed = -1;
  for (std::size_t i = 0; i < fan.count; ++i) {
    const PolyMesh::Poly& poly = m.polys[fan.polys[i]];
    for (std::uint32_t k = 0; k < poly.count; ++k) {
      if (m.neighbours[poly.first + k] != kNoPoly) continue;
      const Vec3d &a = m.corner(poly, k), &b = m.corner(poly, k + 1);
      const double ex = b.x - a.x, ez = b.z - a.z, el = std::sqrt(ex * ex + ez * ez);
      if (!(el > 0) || !touches(a, b, p) || !(d.x * ez - d.z * ex > 0)) continue;
      const double along = (d.x * ex + d.z * ez) / el;
      const Vec3d n{-ez / el, 0, ex / el};
      if (best_speed < 0) {
        best_speed = 0;
        normal = n;
      }
      if (!slide || !(std::abs(along) > max(best_speed, kParallel * d.length()))) continue;
      const PolyCrossing w = enter(m, fan, p, {along * ex / el, along * ez / el});
      if (w.poly == kNoPoly) continue;
      best = w;
      best_speed = std::abs(along);
      normal = n;
    }
  }
  return best;
}

/// Points where a straight leg inside a polygon crosses sides of its height triangles. Between them the
/// height of the surface is linear.
struct Bends {
  struct Bend {
    double share = 0;  ///< Fraction of the leg.
    Vec3d at{};        ///< Point on the surface.
  };
  SmallVector<Bend, 16> list;

  Bends(const PolyMesh& m, PolyId id, const Vec3d& a, const Vec3d& b) {
    // By rounding, a leg along the boundary may run outside of all triangles, or past a sample next to
    // its side. Near misses therefore count; they cost one lookup of the height.
    constexpr double kNearly = -0.1;
    const PolyMesh::Poly& poly = m.polys[id];
    for (std::uint32_t i = poly.tri_first; i < poly.tri_first + poly.tri_count; ++i) {
      const PolyMesh::Share &s = m.share_1[i], &t = m.share_2[i];
      const Vec3d& o = m.points[m.tris[i][0]];
      const auto shares = [&](const Vec3d& p) {
        const double x = p.x - o.x, z = p.z - o.z, u = s.x * x + s.z * z, v = t.x * x + t.z * z;
        return std::array<double, 3>{1.0 - u - v, u, v};
      };
      const std::array<double, 3> from = shares(a), to = shares(b);
      if (min(min(from[0], from[1]), from[2]) >= 0 && min(min(to[0], to[1]), to[2]) >= 0) {
        list.clear();  // The whole leg lies in one triangle.
        return;
      }
      for (std::size_t k = 0; k < 3; ++k) {
        if ((from[k] < 0) == (to[k] < 0)) continue;
        const double share = from[k] / (from[k] - to[k]);
        const auto other = [&](std::size_t n) { return from[n] + share * (to[n] - from[n]); };
        const double p = other((k + 1) % 3), q = other((k + 2) % 3);
        if (min(p, q) < kNearly || !(share > 0 && share < 1)) continue;
        Vec3d at = lerp(a, b, share);
        const auto y = [&](std::size_t n) { return m.points[m.tris[i][n % 3]].y; };
        at.y = min(p, q) >= 0 ? p * y(k + 1) + q * y(k + 2) : m.height(id, at);
        list.push_back({share, at});
      }
    }
    std::sort(list.begin(), list.end(), [](const Bend& p, const Bend& q) { return p.share < q.share; });
  }

  /// Calls f(bend), in order, for the bends in [first, end) without which the path from a to b would
  /// leave the surface.
  template <class F>
  void each(const Bend& a, const Bend& b, std::size_t first, std::size_t end, const F& f) const {
    std::size_t worst = end;
    double most = kOffSurface;
    for (std::size_t i = first; i < end; ++i) {
      const double share = (list[i].share - a.share) / (b.share - a.share);
      const double off = std::abs(a.at.y + share * (b.at.y - a.at.y) - list[i].at.y);
      if (!(off > most)) continue;
      most = off;
      worst = i;
    }
    if (worst == end) return;
    each(a, list[worst], first, worst, f);
    f(list[worst]);
    each(list[worst], b, worst + 1, end, f);
  }
};

}  // namespace

void PolyMesh::walk(PolyId start_poly, const Vec3d& start, double dx, double dz, bool slide,
                    SurfaceWalk& out) const {
  out = {};
  Vec3d p = clamped(start_poly, start);
  PolyId poly = start_poly;
  p.y = height(poly, p);
  out.points.push_back({p, poly, 0.0});
  const double shorter = shortened(dx, dz);
  const Direction wanted{dx * shorter, dz * shorter};
  const double wanted_length = wanted.length();
  if (!(wanted_length > 0)) return;

  const auto arrive = [&](const Vec3d& to, PolyId on, double from_fraction, double to_fraction) {
    if (!(norm(to - p) > 0)) return;
    const auto go = [&](const Vec3d& q, double fraction) {
      out.length += norm(q - out.points.back().position);
      out.points.push_back({q, on, fraction});
    };
    if (!polys[on].planar) {
      const Bends bends(*this, on, p, to);
      bends.each({0.0, p}, {1.0, to}, 0, bends.list.size(), [&](const Bends::Bend& bend) {
        go(bend.at, from_fraction + bend.share * (to_fraction - from_fraction));
      });
    }
    go(to, to_fraction);
    p = to;
  };

  double left = 1.0;
  const std::size_t cap = 64 + 16 * polys.size();
  for (std::size_t hops = 0; left > 0; ++hops) {
    if (hops == cap) break;
    PolyCrossing way{poly, wanted, exit_of(*this, poly, p, wanted)};
    if (!progresses(way.exit, wanted)) {
      const Fan fan = fan_at(*this, poly, p);
      way = enter(*this, fan, p, wanted);
      if (way.poly == kNoPoly) {
        out.hit_wall = true;
        way = slide_along_wall(*this, fan, p, wanted, slide, out.wall_normal);
        if (way.poly == kNoPoly) break;
      }
    }
    poly = way.poly;
    const bool ends_here = way.exit.t >= left;
    const double t = ends_here ? left : way.exit.t;
    Vec3d to{p.x + t * way.d.x, p.y, p.z + t * way.d.z};
    to.y = height(poly, to);
    arrive(to, poly, 1.0 - left, ends_here ? 1.0 : 1.0 - (left - t));
    if (ends_here) break;
    left -= t;
    // The point gets the polygon of the leg that leads to it, because the agent stands on that polygon
    // if the leg is cut short.
    const PolyId next = neighbours[polys[poly].first + way.exit.edge];
    if (next != kNoPoly) poly = next;
  }
}

}  // namespace gsnav::detail
