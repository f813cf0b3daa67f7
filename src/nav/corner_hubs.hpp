// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "geodesic_search.hpp"

namespace gsnav::detail {

/// Shortest paths through the corners at which they bend, without a search.
///
/// Each face stores the corners that its points can see. Each corner stores its distance to some hubs,
/// chosen so that any two corners have a hub on a shortest path between them (pruned landmark labels,
/// Akiba, Iwata and Yoshida 2013). The shortest path that bends is the minimum sum over the corners seen
/// by both ends and a common hub (Euclidean hub labels, Du, Shen and Cui 2023). This works on unfolded
/// faces as on level ones. For a mesh of at most kMostTable corners the sums are precomputed for all
/// pairs, in a table of at most 8 MiB.
class CornerHubs {
 public:
  /// Limits of the construction. A mesh with more corners or sights, or whose labels need more
  /// comparisons (0.1 s), gets no hubs, and empty() is true. An example is a hall with thousands of
  /// pillars that see many others.
  static constexpr std::size_t kMostCorners = std::size_t{1} << 12, kMostSights = std::size_t{1} << 19,
                               kMostWork = std::size_t{1} << 26, kMostTable = std::size_t{1} << 10;
  explicit CornerHubs(const UnfoldedMesh& mesh);

  bool empty() const noexcept { return first_sight_.empty(); }
  std::size_t corners() const noexcept { return corners_.size(); }

  /// A path that bends: straight from the start to corner `first`, by the shortest path to `last`, and
  /// straight to the goal.
  struct Way {
    double length = std::numeric_limits<double>::infinity();
    std::uint32_t first = 0, last = 0;
    double to_first = 0, from_last = 0;  ///< Lengths of the straight parts, metres.
    std::uint32_t near_goal =
        UnfoldedMesh::kNone;  ///< Corner nearest to the goal among those that it sees.
    double to_goal = 0;       ///< Its distance from the goal, metres.
  };
  /// Lower bounds of distances to a path's goal, by the triangle inequality with the corner near the
  /// goal. Valid until the thread creates the next one.
  class LeastToGoal final : public GoalBound {
   public:
    LeastToGoal(const CornerHubs& hubs, const Way& way);
    double from(std::uint32_t vertex) const noexcept override;

   private:
    const CornerHubs& hubs_;
    const Way& way_;
    const double* row_ = nullptr;  ///< Row of the table for the corner near the goal. Null if there is
                                   ///< no table.
  };
  /// Shortest path among those that bend. Infinite length if there is none.
  Way shortest(const Site& start, const Site& goal) const;
  /// Straight part of a path and its end.
  struct Leg {
    Site end;
    double length = 0;
  };
  /// All legs of a path in order.
  std::vector<Leg> legs(const Way& way, const Site& goal) const;

 private:
  /// A corner and the window of a face's edge through which it sees the face. No width for the face's
  /// own corners.
  struct Sight {
    Flat root, right, left;
    std::uint32_t corner = 0;
  };
  struct Label {
    double length = 0;
    std::uint32_t hub = 0;   ///< Rank of the hub. The labels of a corner are sorted by it.
    std::uint32_t next = 0;  ///< Next corner on the path to the hub.
  };
  struct Link {
    double length = 0;
    std::uint32_t corner = 0;
  };

  struct SeenCorner {
    double straight = 0;  ///< Straight distance to the corner, metres.
    std::uint32_t corner = 0;
  };
  /// Hub of the shortest path between two corners, by its rank, and the length of that path.
  struct Meeting {
    double length = std::numeric_limits<double>::infinity();
    std::uint32_t hub = 0;
  };

  /// Finds the corners, fills the faces' lists of sights, and links each corner to those that it sees.
  /// Returns false if a limit is exceeded.
  bool look(const UnfoldedMesh& mesh, std::vector<std::vector<Link>>& links);
  void rank(const std::vector<std::vector<Link>>& links);
  bool label(const std::vector<std::vector<Link>>& links);
  /// Stores both sides of each sight in float, for a fast test that excludes most sights.
  void draw_sides(const UnfoldedMesh& mesh);
  void fill_table();
  /// Corners that a site sees, the nearest first.
  void look_from(const Site& from, std::vector<SeenCorner>& out) const;
  Meeting meet(std::uint32_t a, std::uint32_t b) const noexcept;
  /// Replaces `best` by the path through these two corners if it is shorter.
  static void offer(double length, const SeenCorner& first, const SeenCorner& last, Way& best) noexcept {
    if (!(length < best.length)) return;
    best.length = length;
    best.first = first.corner;
    best.last = last.corner;
    best.to_first = first.straight;
    best.from_last = last.straight;
  }
  /// Finds the shortest path over all pairs of corners that both ends see, by the table or by the
  /// labels.
  void join_by_table(const Site& start, const Site& goal, std::vector<SeenCorner>& near_start,
                     std::vector<SeenCorner>& near_goal, Way& best) const;
  void join_by_labels(const Site& start, const Site& goal, const std::vector<SeenCorner>& near_start,
                      const std::vector<SeenCorner>& near_goal, Way& best) const;
  const double* row(std::uint32_t corner) const noexcept {
    return table_.data() + corner * corners_.size();
  }

  std::vector<Site> corners_;
  std::vector<std::uint32_t> corner_of_;    ///< Corner of each vertex. kNone if no path bends there.
  std::vector<std::uint32_t> first_sight_;  ///< Begin of each face's sights, and one past the last.
  std::vector<Sight> sights_;
  /// Data of a sight that most queries read, separate from the rest.
  struct Root {
    Flat at;
    std::uint32_t corner = 0;
  };
  std::vector<Root> roots_;  ///< One per sight.
  /// For each face, six rows with one value per sight: a, b, c of the right side and of the left side. a
  /// x + b y + c is the distance in metres by which the point (x, y), relative to the face's first
  /// corner, lies inside.
  std::vector<float> sides_;
  struct FaceOrigin {
    Flat origin;
    float margin = 0;  ///< Bound of the rounding error, metres.
  };
  std::vector<FaceOrigin> face_origins_;    ///< One per face.
  std::vector<std::uint32_t> first_label_;  ///< Begin of each corner's labels, and one past the last.
  std::vector<Label> labels_;
  std::vector<std::uint32_t> hub_corner_;  ///< Corner of each hub, by rank.
  std::vector<double> table_;  ///< Distance between each two corners, metres. Empty if there are too
                               ///< many corners.
};

}  // namespace gsnav::detail
