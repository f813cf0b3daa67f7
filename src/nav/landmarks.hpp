// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geodesic_search.hpp"

namespace gsnav::detail {

/// The least of |x - root| + constant + slope x for x in [low, high] of a line that the root is `beside`
/// the point `at` of.
inline double least_sum(double at, double beside, double low, double high, double constant,
                        double slope) noexcept {
  double x = slope > 0 ? low : high;
  const double rest = 1.0 - slope * slope;
  if (rest > 1e-12) x = clamp(at - slope * beside / std::sqrt(rest), low, high);
  return std::sqrt((x - at) * (x - at) + beside * beside) + constant + slope * x;
}

/// Distances from points of the mesh (landmarks) to all of its edges, to lead a search by the triangle
/// inequality: d(x, goal) >= |d(L, x) - d(L, goal)|. On an edge a distance is kept at kParts + 1 points,
/// and how far it can be below and above the straight lines between them.
///
/// Below: on a window the distance is a branch of a hyperbola, which is farthest below a line where its
/// slope is the line's; along the edge from one of its ends it is nowhere below the line. Above: the
/// difference to the line is convex between the ends of windows, so that it is greatest at one of them.
class Landmarks {
 public:
  static constexpr std::uint32_t kParts = 4;
  /// No more landmarks, and no more memory, than that.
  static const std::size_t kMost, kMostBytes;

  Landmarks() = default;
  explicit Landmarks(const UnfoldedMesh& mesh, std::size_t most = kMost);

  bool empty() const noexcept { return count_ == 0; }
  std::size_t size() const noexcept { return count_; }

  /// What is kept of an edge and a landmark, metres.
  struct Line {
    std::array<float, kParts + 1> at;  ///< from the edge's first corner on
    float below = 0, above = 0;        ///< how far the distance may be below and above the lines
  };

 private:
  friend class LandmarkLead;
  struct Range {
    double low = 0, high = 0;
  };
  /// Of the distance between a landmark and a site in a face that it is not in.
  Range distance(const UnfoldedMesh& mesh, std::size_t landmark, const Site& to) const noexcept;
  bool add(const UnfoldedMesh& mesh, const Site& at, GeodesicSearch& search);

  std::size_t count_ = 0, edges_ = 0;
  std::vector<std::uint32_t> line_of_;  ///< of each edge, twice; odd where it is read from its far end
  std::vector<Line> lines_;             ///< of each landmark, all edges
  std::vector<float> corners_;          ///< of each vertex, all landmarks: about
  std::vector<std::uint32_t> faces_;    ///< of each landmark
};

/// A question's landmarks: what no way from a point of an edge to the goal is shorter than.
class LandmarkLead {
 public:
  LandmarkLead(const Landmarks& marks, const UnfoldedMesh& mesh, const Site& start, const Site& goal);
  /// No way between start and goal is shorter.
  double least() const noexcept { return least_; }
  /// From point k of kParts + 1 of an edge to the goal.
  double from(std::uint32_t edge, std::uint32_t k) const noexcept;
  /// The same without the errors of what is kept: what to go by, not a bound.
  double toward(std::uint32_t edge, std::uint32_t k) const noexcept;
  /// From a root, `beside` the point `at` of the edge, through [low, high] of it to the goal.
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

/// The length of a way between two sites over faces that `lead` points along, straightened within them;
/// infinity where none is found.
double corridor_length(const UnfoldedMesh& mesh, const LandmarkLead& lead, const Site& start,
                       const Site& goal);

}  // namespace gsnav::detail
