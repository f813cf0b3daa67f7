// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/navmesh_levels.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace gsnav {
namespace {

constexpr double kLevel = 0.984807753012208;  // Cosine of 10 degrees.
constexpr double kLeastArea = 1e-6;           // m². Smaller areas are rounding errors.
constexpr double kLeastGap = 1e-6;            // Metres. Rounding error of a mean height.

struct LevelPiece {
  double height = 0, area = 0;
};

}  // namespace

std::vector<NavLevel> find_levels(const NavMesh& mesh, const LevelOptions& options) {
  std::vector<LevelPiece> pieces;
  for (const std::array<Vec3d, 3>& t : mesh.triangles()) {
    const Vec3d n = cross(t[1] - t[0], t[2] - t[0]);
    const double twice = norm(n);
    if (twice > 0 && std::abs(n.y) >= kLevel * twice) {
      pieces.push_back({(t[0].y + t[1].y + t[2].y) / 3.0, 0.5 * twice});
    }
  }
  std::sort(pieces.begin(), pieces.end(),
            [](const LevelPiece& a, const LevelPiece& b) { return a.height < b.height; });
  std::vector<NavLevel> levels;
  for (;;) {
    // Window of twice `band` with the largest area.
    NavLevel best;
    double area = 0, moment = 0;
    for (std::size_t low = 0, high = 0; low < pieces.size(); ++low) {
      for (; high < pieces.size() && pieces[high].height <= pieces[low].height + 2 * options.band;
           ++high) {
        area += pieces[high].area;
        moment += pieces[high].area * pieces[high].height;
      }
      if (area > best.area) best = {moment / area, area};
      area -= pieces[low].area;
      moment -= pieces[low].area * pieces[low].height;
    }
    if (!(best.area >= max(options.min_area, kLeastArea))) break;
    levels.push_back(best);
    std::erase_if(pieces, [&](const LevelPiece& p) {
      const double off = std::abs(p.height - best.height);
      return off < max(options.min_gap, kLeastGap) || off <= options.band;
    });
  }
  std::sort(levels.begin(), levels.end(),
            [](const NavLevel& a, const NavLevel& b) { return a.height < b.height; });
  return levels;
}

}  // namespace gsnav
