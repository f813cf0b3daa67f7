// SPDX-License-Identifier: Apache-2.0
// The search over windows on surfaces made by hand, against paths over points on their edges, which know
// neither windows nor unfolded faces. Needs few files of the library, so that faults can be seeded in
// them.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <utility>
#include <vector>

#include "../../src/nav/landmarks.hpp"
#include "gsnav/core/rng.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using detail::GeodesicSearch;
using detail::PolyMesh;
using detail::Site;
using detail::UnfoldedMesh;

namespace {

constexpr double kUnreached = std::numeric_limits<double>::infinity();
using Triangle = std::array<std::uint32_t, 3>;

struct Surface {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;  ///< counter-clockwise in (x, z)
};

/// n by n squares of a metre, each cut in two, with corners moved about; squares that `hole` names are
/// left out.
Surface squares(int n, std::uint64_t seed, const std::function<double(double, double)>& height,
                const std::function<bool(int, int)>& hole) {
  Surface s;
  Rng rng(seed);
  for (int z = 0; z <= n; ++z) {
    for (int x = 0; x <= n; ++x) {
      const double px = x + rng.uniform(-0.2, 0.2), pz = z + rng.uniform(-0.2, 0.2);
      s.points.push_back({px, height(px, pz), pz});
    }
  }
  const auto at = [&](int x, int z) { return static_cast<std::uint32_t>(z * (n + 1) + x); };
  for (int z = 0; z < n; ++z) {
    for (int x = 0; x < n; ++x) {
      if (hole(x, z)) continue;
      s.triangles.push_back({at(x, z), at(x + 1, z), at(x + 1, z + 1)});
      s.triangles.push_back({at(x, z), at(x + 1, z + 1), at(x, z + 1)});
    }
  }
  return s;
}

/// A polygon for each triangle.
PolyMesh polygons(const Surface& s) {
  PolyMesh m;
  m.points = s.points;
  std::map<std::pair<std::uint32_t, std::uint32_t>, PolyId> whose;
  for (PolyId id = 0; id < s.triangles.size(); ++id) {
    const Triangle& t = s.triangles[id];
    PolyMesh::Poly p;
    p.first = static_cast<std::uint32_t>(m.corners.size());
    p.count = 3;
    p.tri_first = id;
    p.tri_count = 1;
    m.polys.push_back(p);
    m.tris.push_back(t);
    for (std::size_t k = 0; k < 3; ++k) {
      m.corners.push_back(s.points[t[k]]);
      whose[{t[k], t[(k + 1) % 3]}] = id;
    }
  }
  for (const Triangle& t : s.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto other = whose.find({t[(k + 1) % 3], t[k]});
      m.neighbours.push_back(other != whose.end() ? other->second : kNoPoly);
    }
  }
  return m;
}

/// Shortest paths over points on the edges, straight across each triangle: real paths, so never shorter
/// than the shortest.
class PathsOverEdges {
 public:
  PathsOverEdges(const Surface& s, int parts) : surface_(s) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::size_t>> on;
    for (const Vec3d& p : s.points) points_.push_back(p);
    for (const Triangle& t : s.triangles) {
      std::vector<std::size_t> own(t.begin(), t.end());
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
        std::vector<std::size_t>& edge = on[{a, b}];
        for (int i = 1; i < parts && edge.size() + 1 < static_cast<std::size_t>(parts); ++i) {
          edge.push_back(points_.size());
          points_.push_back(lerp(s.points[a], s.points[b], static_cast<double>(i) / parts));
        }
        own.insert(own.end(), edge.begin(), edge.end());
      }
      of_triangle_.push_back(own);
    }
    of_point_.resize(points_.size());
    for (std::size_t t = 0; t < of_triangle_.size(); ++t) {
      for (const std::size_t p : of_triangle_[t]) of_point_[p].push_back(t);
    }
  }

  /// From a point of a triangle to all points of the graph.
  std::vector<double> from(std::size_t triangle, const Vec3d& p) const {
    std::vector<double> d(points_.size(), kUnreached);
    std::priority_queue<std::pair<double, std::size_t>, std::vector<std::pair<double, std::size_t>>,
                        std::greater<>>
        heap;
    const auto reach = [&](std::size_t i, double length) {
      if (length >= d[i]) return;
      d[i] = length;
      heap.push({length, i});
    };
    for (const std::size_t i : of_triangle_[triangle]) reach(i, norm(points_[i] - p));
    while (!heap.empty()) {
      const auto [length, i] = heap.top();
      heap.pop();
      if (length > d[i]) continue;
      for (const std::size_t t : of_point_[i]) {
        for (const std::size_t j : of_triangle_[t]) reach(j, length + norm(points_[j] - points_[i]));
      }
    }
    return d;
  }
  /// To a point of another triangle.
  double to(const std::vector<double>& d, std::size_t triangle, const Vec3d& p) const {
    double best = kUnreached;
    for (const std::size_t i : of_triangle_[triangle])
      best = std::min(best, d[i] + norm(points_[i] - p));
    return best;
  }

 private:
  Surface surface_;
  std::vector<Vec3d> points_;
  std::vector<std::vector<std::size_t>> of_triangle_, of_point_;
};

struct Case {
  const char* name;
  Surface surface;
};

std::vector<Case> surfaces() {
  const auto level = [](double, double) { return 0.0; };
  const auto hills = [](double x, double z) { return 0.8 * std::sin(0.9 * x) * std::cos(0.7 * z); };
  const auto stairs = [](double x, double) { return 0.3 * std::floor(x / 1.5); };
  const auto none = [](int, int) { return false; };
  const auto rooms = [](int x, int z) { return x % 4 == 2 && z % 5 != 1; };
  return {{"level, with walls", squares(10, 1, level, rooms)},
          {"hills", squares(10, 2, hills, none)},
          {"hills with walls", squares(10, 3, hills, rooms)},
          {"stairs", squares(10, 4, stairs, none)}};
}

/// Face f of the unfolded mesh is triangle f where each polygon is a triangle.
Site site(const UnfoldedMesh& mesh, std::uint32_t face, const Vec3d& p) {
  return {face, mesh.flat(mesh.faces[face], p), p};
}

}  // namespace

TEST_CASE(
    "windows: never longer than over points on the edges, nor shorter than these can be, and as far as "
    "back") {
  constexpr int kParts = 32;
  for (const Case& c : surfaces()) {
    const PolyMesh polys = polygons(c.surface);
    const UnfoldedMesh mesh(polys);
    REQUIRE(mesh.faces.size() == c.surface.triangles.size());
    const PathsOverEdges paths(c.surface, kParts);
    GeodesicSearch search;
    Rng rng(5);
    double longer = -kUnreached, shorter = 0, turned = 0;
    const auto any_face = [&] {
      return min(static_cast<std::uint32_t>(rng.uniform(0, 1) * static_cast<double>(mesh.faces.size())),
                 static_cast<std::uint32_t>(mesh.faces.size() - 1));
    };
    const auto inside = [&](std::uint32_t f) {
      const Triangle& t = c.surface.triangles[f];
      double u = rng.uniform(0, 1), v = rng.uniform(0, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const std::vector<Vec3d>& p = c.surface.points;
      return p[t[0]] + (p[t[1]] - p[t[0]]) * u + (p[t[2]] - p[t[0]]) * v;
    };
    for (int g = 0; g < gsnav_test::cases(6); ++g) {
      const std::uint32_t end = any_face();
      const Vec3d goal = inside(end);
      const std::vector<double> known = paths.from(end, goal);
      const auto check = [&](std::uint32_t f, const Vec3d& p) {
        if (f == end) return;
        const double over_edges = paths.to(known, f, p);
        const double there = search.run(mesh, site(mesh, f, p), site(mesh, end, goal));
        const double back = search.run(mesh, site(mesh, end, goal), site(mesh, f, p));
        longer = max(longer, there - over_edges);
        shorter = max(shorter, (over_edges - there) / (there + 0.5));
        turned = max(turned, std::abs(there - back));
      };
      for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
        check(f, inside(f));
        // From an edge its face is seen in a cone of half a turn, and the neighbour too.
        for (std::size_t k = 0; k < 3; ++k) {
          const Triangle& t = c.surface.triangles[f];
          check(f,
                lerp(c.surface.points[t[k]], c.surface.points[t[(k + 1) % 3]], rng.uniform(0.05, 0.95)));
        }
      }
    }
    MESSAGE(std::string(c.name) << ": longer by at most " << longer << " m, shorter by " << 100 * shorter
                                << " %, there and back differ by " << turned << " m");
    CHECK(longer < 1e-9);
    CHECK(shorter < 0.05);  // points 3 cm apart, and half a metre more to divide by
    CHECK(turned < 1e-9);
  }
}

TEST_CASE("landmarks: bounds are none too high, searches by them exact, or within what was asked for") {
  for (const Case& c : surfaces()) {
    const PolyMesh polys = polygons(c.surface);
    const UnfoldedMesh mesh(polys);
    const detail::Landmarks marks(mesh, 24);
    REQUIRE(marks.size() == 24);
    GeodesicSearch search;
    Rng rng(9);
    double high = -kUnreached, low = 0, exact = 0, above = 0, beyond = -kUnreached,
           short_of = -kUnreached;
    int found = 0, at_once = 0, all = 0;
    const auto any = [&] {
      const auto n = static_cast<std::uint32_t>(mesh.faces.size());
      const std::uint32_t f = min(static_cast<std::uint32_t>(rng.uniform(0, 1) * n), n - 1);
      const Triangle& t = c.surface.triangles[f];
      double u = rng.uniform(0, 1), v = rng.uniform(0, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const std::vector<Vec3d>& p = c.surface.points;
      return site(mesh, f, p[t[0]] + (p[t[1]] - p[t[0]]) * u + (p[t[2]] - p[t[0]]) * v);
    };
    for (int i = 0; i < gsnav_test::cases(600); ++i) {
      const Site start = any(), goal = any();
      if (start.face == goal.face) continue;
      const double truth = search.run(mesh, start, goal);
      REQUIRE(truth < kUnreached);
      ++all;
      const detail::LandmarkLead lead(marks, mesh, start, goal);
      high = max(high, lead.least() - truth);
      low += lead.least() / truth;
      // Of each edge of the start's face, too: no way from there is shorter than what leads through it.
      const UnfoldedMesh::Face& face = mesh.faces[start.face];
      double through = kUnreached;
      for (std::uint32_t e = face.first; e < face.first + face.count; ++e) {
        if (mesh.edges[e].twin == UnfoldedMesh::kNone) continue;
        const detail::Flat a = mesh.edges[e].at, side = mesh.edges[mesh.next(e)].at - a;
        const double whole = length(side);
        through = min(through, lead.through(e, whole, dot(start.at - a, side) / whole,
                                            std::abs(cross(side, start.at - a)) / whole, 0, whole));
      }
      high = max(high, through - truth);
      exact = max(exact, std::abs(search.run_led(mesh, start, goal, lead) - truth));
      const double way = detail::corridor_length(mesh, lead, start, goal);
      found += way < kUnreached ? 1 : 0;
      short_of = max(short_of, truth - way);
      for (const double slack : {2e-4, 2e-3, 0.2}) {
        const double most = search.run_led(mesh, start, goal, lead, way, slack);
        const double least = max(search.least(), lead.least());
        at_once += slack < 1e-3 && way <= (1 + slack) * lead.least() ? 1 : 0;
        beyond = max(beyond, max(least - truth, truth - most));
        above = max(above, most / least / (1 + slack));
      }
    }
    MESSAGE(std::string(c.name) << ": bounds " << low / all << " of the length, at most " << high
                                << " m above it; led off by " << exact << " m; ways along faces "
                                << found << " of " << all << ", " << at_once
                                << " proofs of 2e-4 at once");
    CHECK(high < 1e-9);
    CHECK(low / all > 0.9);
    CHECK(exact < 1e-9);
    CHECK(found > all / 2);
    CHECK(short_of < 1e-9);
    CHECK(beyond < 1e-9);
    CHECK(above < 1 + 1e-12);
  }
}
