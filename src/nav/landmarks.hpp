// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geodesic_search.hpp"

namespace gsnav::detail {

/// Minimum of |x - root| + constant + slope x over x in [low, high] on a line. The root is at distance
/// `beside` from the point `at` of the line.
inline double least_sum(double at, double beside, double low, double high, double constant,
                        double slope) noexcept {
  double x = slope > 0 ? low : high;
  const double rest = 1.0 - slope * slope;
  if (rest > 1e-12) x = clamp(at - slope * beside / std::sqrt(rest), low, high);
  return std::sqrt((x - at) * (x - at) + beside * beside) + constant + slope * x;
}

/// Distances from some points of the mesh (landmarks) to all its edges. They guide searches by the
/// triangle inequality: d(x, goal) >= |d(L, x) - d(L, goal)|.
///
/// For an edge, a distance is stored at kParts + 1 points, together with how far it can be below and
/// above the straight lines between them.
///
/// Below: within a window the distance is a branch of a hyperbola, which is farthest below a line where
/// its slope equals that of the line. Along the edge from one of its ends, the distance is nowhere below
/// the line. Above: the difference to the line is convex between the ends of windows, so its maximum is
/// at one of them.
class Landmarks {
 public:
  static constexpr std::uint32_t kParts = 4;
  /// Largest number of landmarks, and largest memory in bytes.
  static const std::size_t kMost, kMostBytes;

  Landmarks() = default;
  explicit Landmarks(const UnfoldedMesh& mesh, std::size_t most = kMost);

  bool empty() const noexcept { return count_ == 0; }
  std::size_t size() const noexcept { return count_; }

  /// Distances from one landmark along one edge, metres.
  struct Line {
    std::array<float, kParts + 1> at;  ///< At evenly spaced points, from the edge's first corner on.
    float below = 0, above = 0;        ///< How far the distance may be below and above the lines.
  };

 private:
  friend class LandmarkLead;
  struct Range {
    double low = 0, high = 0;
  };
  /// Bounds of the distance between a landmark and a site, which must not lie in the same face.
  Range distance(const UnfoldedMesh& mesh, std::size_t landmark, const Site& to) const noexcept;
  bool add(const UnfoldedMesh& mesh, const Site& at, GeodesicSearch& search);

  std::size_t count_ = 0, edges_ = 0;
  std::vector<std::uint32_t> line_of_;  ///< Twice the index of each edge's line, plus 1 if it is read
                                        ///< from its far end.
  std::vector<Line> lines_;             ///< For each landmark, all edges.
  std::vector<float> corners_;          ///< For each vertex, the approximate distances of all landmarks.
  std::vector<std::uint32_t> faces_;    ///< Face of each landmark.
};

/// Landmarks selected for one query. They bound the length of paths from a point of an edge to the goal.
class LandmarkLead {
 public:
  LandmarkLead(const Landmarks& marks, const UnfoldedMesh& mesh, const Site& start, const Site& goal);
  /// Lower bound of the distance between start and goal.
  double least() const noexcept { return least_; }
  /// Lower bound of the distance from point k of an edge (0 to kParts) to the goal.
  double from(std::uint32_t edge, std::uint32_t k) const noexcept;
  /// Estimate of the distance from point k of an edge to the goal. It ignores the stored error and may
  /// be too large.
  double toward(std::uint32_t edge, std::uint32_t k) const noexcept;
  /// Lower bound of a path from a root through [low, high] of the edge to the goal. The root is at
  /// distance `beside` from the point `at` of the edge.
  double through(std::uint32_t edge, double length, double at, double beside, double low,
                 double high) const noexcept;

 private:
  static constexpr std::size_t kLeads = 3, kTried = 8;
  struct One {
    const Landmarks::Line* lines = nullptr;
    double sign = 1, constant = 0;
  };
  std::array<One, kLeads> leads_;
  std::size_t count_ = 0;
  const std::uint32_t* line_of_ = nullptr;
  double least_ = 0;
};

/// Length of a path between two sites over faces that `lead` suggests, straightened within them.
/// Infinity if none is found.
double corridor_length(const UnfoldedMesh& mesh, const LandmarkLead& lead, const Site& start,
                       const Site& goal);

}  // namespace gsnav::detail
