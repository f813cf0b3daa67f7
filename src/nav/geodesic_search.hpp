// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "face_views.hpp"
#include "unfolded_mesh.hpp"

namespace gsnav::detail {

/// Point on the unfolded surface.
struct Site {
  std::uint32_t face = 0;
  Flat at;
  Vec3d position{};
};

class LandmarkLead;

/// Lower bounds of distances to the goal.
class GoalBound {
 public:
  /// Lower bound of the distance from a vertex to the goal. 0 if nothing is known.
  virtual double from(std::uint32_t vertex) const noexcept = 0;

 protected:
  ~GoalBound() = default;
};

/// Exact shortest paths on an UnfoldedMesh.
///
/// Windows (parts of edges, each with a root that sees all of it) spread from face to face, best first.
/// On a level mesh this is Polyanya (Cui, Harabor and Grastien 2017). Over slopes the root is unfolded
/// with the faces, and windows that cannot beat a known vertex distance are dropped, as in improved
/// Chen-Han (Xin and Wang 2009). Paths bend at vertices with more than half a turn of surface at a wall,
/// or more than a full turn in the interior.
///
/// Keeps its memory for the next search. Not thread-safe.
class GeodesicSearch {
 public:
  static constexpr std::uint32_t kNone = UnfoldedMesh::kNone;

  /// A window on `edge` of the face it opens into, or the event that the vertex of `edge` is reached.
  struct Node {
    Flat root;         ///< Point that sees the window, in the plane of the face.
    Flat right, left;  ///< Ends of the window.
    double g = 0;      ///< Distance of the root. For an event, distance of the vertex.
    std::uint32_t edge = 0;
    std::uint32_t parent = kNone;
    bool is_vertex = false;
  };

  static constexpr double kFar = std::numeric_limits<double>::infinity();

  /// Distance between two sites. Infinity if the goal cannot be reached in less than `bound`.
  double run(const UnfoldedMesh& mesh, const Site& start, const Site& goal, double bound = kFar);
  /// Distance between two sites, guided by landmarks. Paths that cannot be shorter than the best one by
  /// more than a factor of 1 + `slack` are skipped. Afterwards least() is a lower bound of the distance.
  double run_led(const UnfoldedMesh& mesh, const Site& start, const Site& goal, const LandmarkLead& lead,
                 double bound = kFar, double slack = 0);
  double least() const noexcept {
    return min(best_ / (1 + slack_), heap_.empty() ? kFar : heap_.front().first);
  }
  /// Distance along paths that do not bend.
  /// @param least Lower bounds of distances to the goal, or null.
  /// @param views Visibility of faces, or null.
  double run_straight(const UnfoldedMesh& mesh, const Site& start, const Site& goal, double bound = kFar,
                      const GoalBound* least = nullptr, const FaceViews* views = nullptr);
  /// Corners of the last path from start to goal. Points are added where the surface leaves the straight
  /// line by more than 1 cm.
  std::vector<Vec3d> path() const;
  /// Computes distances from `starts` to everything that can be reached.
  void flood(const UnfoldedMesh& mesh, const std::vector<Site>& starts);
  /// Spreads straight paths from a vertex over the mesh. nodes() then holds the windows and turning
  /// vertices that were reached. Nodes of directions in which a shortest path through this vertex can go
  /// on, that is, around a corner of the boundary, come first. Returns the number of these nodes; the
  /// other nodes can only be reached by paths that begin at the vertex.
  std::size_t look_around(const UnfoldedMesh& mesh, std::uint32_t vertex);

  const std::vector<Node>& nodes() const noexcept { return nodes_; }
  /// True if the last flood() reached everything. Bent surfaces, which no floor has, may remain
  /// unfinished.
  bool finished() const noexcept { return heap_.empty(); }
  /// Distance of a vertex found by the last search. Infinity if it was not reached.
  double vertex_distance(std::uint32_t vertex) const noexcept {
    return reached_[vertex] == round_ ? distance_[vertex] : std::numeric_limits<double>::infinity();
  }

 private:
  struct Cone {
    Flat right, left;  ///< Directions from the root along the right and the left side.
  };

  void begin(const UnfoldedMesh& mesh, double bound = kFar);
  void leave(const Site& start);
  void leave_vertex(std::uint32_t vertex, double g, std::uint32_t parent, double low, double high);
  void spread_window(std::uint32_t node);
  void spread_vertex(std::uint32_t node);
  /// Opens windows for the cone from `root` through `count` edges of the face, starting with edge
  /// `first`.
  void spread(std::uint32_t face, std::uint32_t first, std::uint32_t count, const Flat& root,
              const Cone& cone, double g, std::uint32_t parent);
  void open(std::uint32_t edge, const Flat& root, const Flat& right, const Flat& left, double g,
            std::uint32_t parent);
  /// Opens a window for paths without bends.
  void open_straight(std::uint32_t edge, const Flat& root, Flat right, Flat left, std::uint32_t parent);
  /// A window seen through edge `here`, in the plane of the face beyond it.
  static Node window_beyond(const UnfoldedMesh::Edge& here, const Flat& root, const Flat& right,
                            const Flat& left, double g, std::uint32_t parent) noexcept {
    const auto across = [&here](const Flat& p) { return UnfoldedMesh::across(here, p); };
    return {across(root), across(right), across(left), g, here.twin, parent, false};
  }
  void reach(std::uint32_t edge, const Flat& root, double g, std::uint32_t parent);
  void offer_goal(double length, std::uint32_t node);
  void push(double f, const Node& node);
  void settle();

  const UnfoldedMesh* mesh_ = nullptr;
  Site start_, goal_;
  bool has_goal_ = false;
  bool every_vertex_ = false;  ///< Bend at every vertex, used when rounding hid the path.
  bool straight_ = false;      ///< Do not bend.
  bool found_ = false;         ///< The goal was found.
  const GoalBound* least_ = nullptr;
  const FaceViews* views_ = nullptr;
  const LandmarkLead* lead_ = nullptr;
  double slack_ = 0;  ///< Paths that are not shorter than best_ / (1 + slack_) are skipped.
  double best_ = 0;
  std::uint32_t best_node_ = kNone;
  std::vector<Node> nodes_;
  std::vector<std::pair<double, std::uint32_t>> heap_;
  std::vector<double> distance_;
  std::vector<std::uint64_t> reached_;
  std::uint64_t round_ = 0;
};

/// Length of the shortest path from the window's root through it to a point. The point is at `along` the
/// edge from the right end of the window and `beyond` its line; a point on the root's side is mirrored.
/// A lower bound for any such point in 3D.
double length_through(const Flat& root, const Flat& right, const Flat& left, double along,
                      double beyond) noexcept;

/// Search object of this thread.
GeodesicSearch& thread_search();

}  // namespace gsnav::detail
