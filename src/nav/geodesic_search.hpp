// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "face_views.hpp"
#include "unfolded_mesh.hpp"

namespace gsnav::detail {

/// A point on the unfolded surface.
struct Site {
  std::uint32_t face = 0;
  Flat at;
  Vec3d position{};
};

class LandmarkLead;

/// What is known of distances to the goal.
class GoalBound {
 public:
  /// No way from the vertex to the goal is shorter; 0 where nothing is known.
  virtual double from(std::uint32_t vertex) const noexcept = 0;

 protected:
  ~GoalBound() = default;
};

/// Exact shortest paths on an UnfoldedMesh: windows (stretches of edges with the point that sees all of
/// them) spread from face to face, best first. On a level mesh this is Polyanya (Cui, Harabor and
/// Grastien 2017); over slopes the point is unfolded with the faces and windows that a known vertex
/// distance beats are dropped, as in improved Chen-Han (Xin and Wang 2009). Paths bend at vertices with
/// more than a half plane of surface at a wall, or more than a full turn inside.
///
/// Holds the memory of its last search and is used again; not for two threads at a time.
class GeodesicSearch {
 public:
  static constexpr std::uint32_t kNone = UnfoldedMesh::kNone;

  /// A window on `edge` (of the face it opens into), or the event that vertex of `edge` is reached.
  struct Node {
    Flat root;         ///< what sees the window, in the face's plane
    Flat right, left;  ///< ends of the window
    double g = 0;      ///< distance of the root; of the vertex itself in an event
    std::uint32_t edge = 0;
    std::uint32_t parent = kNone;
    bool is_vertex = false;
  };

  static constexpr double kFar = std::numeric_limits<double>::infinity();

  /// Distance between two sites, infinity where the search cannot reach the goal within less than
  /// `bound`.
  double run(const UnfoldedMesh& mesh, const Site& start, const Site& goal, double bound = kFar);
  /// The same led by landmarks. What is not proven shorter than (1 + `slack`) times as long as the best
  /// is searched; the rest leaves `least()`, which no way is shorter than.
  double run_led(const UnfoldedMesh& mesh, const Site& start, const Site& goal, const LandmarkLead& lead,
                 double bound = kFar, double slack = 0);
  double least() const noexcept {
    return min(best_ / (1 + slack_), heap_.empty() ? kFar : heap_.front().first);
  }
  /// The same over paths that do not bend; what `views` rules out is not looked at.
  double run_straight(const UnfoldedMesh& mesh, const Site& start, const Site& goal, double bound = kFar,
                      const GoalBound* least = nullptr, const FaceViews* views = nullptr);
  /// Corners of the last run's path from start to goal; between them points where the surface leaves the
  /// straight line by more than a centimetre.
  std::vector<Vec3d> path() const;
  /// Spreads over everything that can be reached from `starts`.
  void flood(const UnfoldedMesh& mesh, const std::vector<Site>& starts);
  /// Spreads straight ways from a vertex: nodes() are the windows, and turning vertices as they were
  /// reached. Returns how many of them come first in whose directions a path that bends there may leave.
  std::size_t look_around(const UnfoldedMesh& mesh, std::uint32_t vertex);

  const std::vector<Node>& nodes() const noexcept { return nodes_; }
  /// Whether the last flood spread everywhere: surfaces that no floor has are left unfinished.
  bool finished() const noexcept { return heap_.empty(); }
  /// Distance of a vertex as far as the last search knows it; infinity where it was not seen.
  double vertex_distance(std::uint32_t vertex) const noexcept {
    return seen_[vertex] == round_ ? distance_[vertex] : std::numeric_limits<double>::infinity();
  }

 private:
  struct Cone {
    Flat right, left;  ///< directions of its sides
  };

  void begin(const UnfoldedMesh& mesh, double bound = kFar);
  void leave(const Site& start);
  void leave_vertex(std::uint32_t vertex, double g, std::uint32_t parent, double low, double high);
  void spread_window(std::uint32_t node);
  void spread_vertex(std::uint32_t node);
  /// Windows that the cone from `root` opens through edges first, first + 1, ... of the face.
  void spread(std::uint32_t face, std::uint32_t first, std::uint32_t count, const Flat& root,
              const Cone& cone, double g, std::uint32_t parent);
  void open(std::uint32_t edge, const Flat& root, const Flat& right, const Flat& left, double g,
            std::uint32_t parent);
  /// The same for the straight way to a goal.
  void open_straight(std::uint32_t edge, const Flat& root, Flat right, Flat left, std::uint32_t parent);
  void reach(std::uint32_t edge, const Flat& root, double g, std::uint32_t parent);
  void offer_goal(double length, std::uint32_t node);
  void push(double f, const Node& node);
  void settle();

  const UnfoldedMesh* mesh_ = nullptr;
  Site start_, goal_;
  bool has_goal_ = false;
  bool every_vertex_ = false;  ///< bend at every vertex: where rounding hid the way
  bool straight_ = false;      ///< bend nowhere
  bool found_ = false;         ///< the goal
  const GoalBound* least_ = nullptr;
  const FaceViews* views_ = nullptr;
  const LandmarkLead* lead_ = nullptr;
  double slack_ = 0;  ///< ways that are not shorter than best_ / (1 + slack_) are left out
  double best_ = 0;
  std::uint32_t best_node_ = kNone;
  std::vector<Node> nodes_;
  std::vector<std::pair<double, std::uint32_t>> heap_;
  std::vector<double> distance_;
  std::vector<std::uint64_t> seen_;
  std::uint64_t round_ = 0;
};

/// Shortest way from the window's root through it to a point at `along` the edge from its right end and
/// `beyond` it (its mirror image where it lies on this side): a lower bound wherever that point is.
double length_through(const Flat& root, const Flat& right, const Flat& left, double along,
                      double beyond) noexcept;

/// A search to use until the thread's next one.
GeodesicSearch& thread_search();

}  // namespace gsnav::detail
