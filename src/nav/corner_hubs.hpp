// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "geodesic_search.hpp"

namespace gsnav::detail {

/// Shortest paths by the corners that they bend at, without a search.
///
/// Each face keeps which corners its points can see; each corner keeps its distance to some hubs, chosen
/// so that any two corners have a hub on a shortest path between them (pruned landmark labels, Akiba,
/// Iwata and Yoshida 2013). The least sum over both ends' corners and a common hub is the shortest path
/// that bends (Euclidean hub labels, Du, Shen and Cui 2023), on unfolded faces as well as on level ones.
/// Of a mesh of no more than kMostTable corners the labels are summed once, for all pairs: a table of at
/// most 8 MiB.
class CornerHubs {
 public:
  /// Makes nothing, so that empty() holds, for a mesh of more corners or sights than these, or whose
  /// labels take more comparisons (a tenth of a second): a hall of thousands of pillars, each of which
  /// sees many others.
  static constexpr std::size_t kMostCorners = std::size_t{1} << 12, kMostSights = std::size_t{1} << 19,
                               kMostWork = std::size_t{1} << 26, kMostTable = std::size_t{1} << 10;
  explicit CornerHubs(const UnfoldedMesh& mesh);

  bool empty() const noexcept { return first_sight_.empty(); }
  std::size_t corners() const noexcept { return corners_.size(); }

  /// A path that bends: from the start straight to corner `first`, the shortest way to `last`, and to
  /// the goal.
  struct Way {
    double length = std::numeric_limits<double>::infinity();
    std::uint32_t first = 0, last = 0;
    double to_first = 0, from_last = 0;  ///< straight, metres
    std::uint32_t near_goal =
        UnfoldedMesh::kNone;  ///< the corner nearest to the goal of those that it sees,
    double to_goal = 0;       ///< and its distance
  };
  /// Distances to a way's goal from below: by the triangle inequality, with the corner near the goal.
  /// Until the thread's next one.
  class LeastToGoal final : public GoalBound {
   public:
    LeastToGoal(const CornerHubs& hubs, const Way& way);
    double from(std::uint32_t vertex) const noexcept override;

   private:
    const CornerHubs& hubs_;
    const Way& way_;
    const double* row_ = nullptr;  ///< of the corner near the goal, where there is a table
  };
  /// The shortest path among those that bend; infinite length where there is none.
  Way shortest(const Site& start, const Site& goal) const;
  /// A straight stretch of a way and where it ends.
  struct Leg {
    Site end;
    double length = 0;
  };
  /// All legs of a way from its start to its goal, in order.
  std::vector<Leg> legs(const Way& way, const Site& goal) const;

 private:
  /// A corner and the window of the face's edge that it sees the face through; no width for the face's
  /// own corners.
  struct Sight {
    Flat root, right, left;
    std::uint32_t corner = 0;
  };
  struct Label {
    double length = 0;
    std::uint32_t hub = 0;   ///< its rank: labels of a corner are sorted by it
    std::uint32_t next = 0;  ///< corner on the way to the hub
  };
  struct Link {
    double length = 0;
    std::uint32_t corner = 0;
  };

  struct Seen {
    double straight = 0;  ///< to the corner
    std::uint32_t corner = 0;
  };
  /// The hub of the shortest way between two corners, by its rank, and that way's length.
  struct Meeting {
    double length = std::numeric_limits<double>::infinity();
    std::uint32_t hub = 0;
  };

  /// False where there is too much of it.
  bool look(const UnfoldedMesh& mesh, std::vector<std::vector<Link>>& links);
  void rank(const std::vector<std::vector<Link>>& links);
  bool label(const std::vector<std::vector<Link>>& links);
  /// Both sides of each sight in float, to leave out most of those that a site is not in.
  void draw_sides(const UnfoldedMesh& mesh);
  void fill_table();
  /// The corners that a site sees, the nearest first.
  void look_from(const Site& from, std::vector<Seen>& out) const;
  Meeting meet(std::uint32_t a, std::uint32_t b) const noexcept;
  /// Makes `best` the way by these two where its length is less.
  static void offer(double length, const Seen& first, const Seen& last, Way& best) noexcept {
    if (!(length < best.length)) return;
    best.length = length;
    best.first = first.corner;
    best.last = last.corner;
    best.to_first = first.straight;
    best.from_last = last.straight;
  }
  /// Of the corners that both ends see, by the table or by the labels.
  void join_by_table(const Site& start, const Site& goal, std::vector<Seen>& near_start,
                     std::vector<Seen>& near_goal, Way& best) const;
  void join_by_labels(const Site& start, const Site& goal, const std::vector<Seen>& near_start,
                      const std::vector<Seen>& near_goal, Way& best) const;
  const double* row(std::uint32_t corner) const noexcept {
    return table_.data() + corner * corners_.size();
  }

  std::vector<Site> corners_;
  std::vector<std::uint32_t> corner_of_;    ///< of each vertex; kNone where no path bends
  std::vector<std::uint32_t> first_sight_;  ///< of each face, and one past the last
  std::vector<Sight> sights_;
  /// What every query that is within a sight reads, apart from what few read.
  struct Root {
    Flat at;
    std::uint32_t corner = 0;
  };
  std::vector<Root> roots_;  ///< of each sight
  /// A face's sights have a row of each of six numbers: a, b, c of right and left side, where a x + b y
  /// + c is the distance, metres, to the inside of the point (x, y) from the face's first corner.
  std::vector<float> sides_;
  struct Frame {
    Flat origin;
    float margin = 0;  ///< metres: no more than that is lost by rounding
  };
  std::vector<Frame> frames_;               ///< of each face
  std::vector<std::uint32_t> first_label_;  ///< of each corner, and one past the last
  std::vector<Label> labels_;
  std::vector<std::uint32_t> hub_corner_;  ///< by rank
  std::vector<double> table_;  ///< metres between each two corners; empty where they are too many
};

}  // namespace gsnav::detail
