// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "corner_hubs.hpp"
#include "tolerances.hpp"

// Queries of the hubs.

namespace gsnav::detail {
namespace {

/// Tests whether the point (x, y) is inside both sides of each sight: 0 no, 1 perhaps, 2 yes.
void inside_sides(const float* __restrict sides, std::size_t n, float x, float y, float margin,
                  std::uint8_t* __restrict out) noexcept {
  for (std::size_t i = 0; i < n; ++i) {
    const float r = sides[i] * x + sides[n + i] * y + sides[2 * n + i];
    const float l = sides[3 * n + i] * x + sides[4 * n + i] * y + sides[5 * n + i];
    const float least = min(r, l);
    out[i] = static_cast<std::uint8_t>((least >= -margin ? 1 : 0) + (least > margin ? 1 : 0));
  }
}

}  // namespace

void CornerHubs::look_from(const Site& from, std::vector<SeenCorner>& out) const {
  out.clear();
  std::size_t nearest = 0;
  thread_local std::vector<std::uint8_t> within;
  const std::size_t begin = first_sight_[from.face], n = first_sight_[from.face + 1] - begin;
  const FaceOrigin& face = face_origins_[from.face];
  const float x = static_cast<float>(from.at.x - face.origin.x),
              y = static_cast<float>(from.at.y - face.origin.y);
  if (within.size() < n) within.resize(n);
  inside_sides(sides_.data() + std::size_t{6} * begin, n, x, y, face.margin, within.data());
  for (std::size_t i = 0; i < n; ++i) {
    if (within[i] == 0) continue;
    const Root& root = roots_[begin + i];
    const Flat d = from.at - root.at;
    if (within[i] == 1) {
      const Sight& s = sights_[begin + i];
      if (cross(s.right - s.root, d) < -kRounding || cross(s.left - s.root, d) > kRounding) continue;
    }
    out.push_back({length(d), root.corner});
    if (out.back().straight < out[nearest].straight) nearest = out.size() - 1;
  }
  if (!out.empty()) std::swap(out[0], out[nearest]);
}

CornerHubs::Meeting CornerHubs::meet(std::uint32_t a, std::uint32_t b) const noexcept {
  Meeting best;
  std::uint32_t i = first_label_[a], j = first_label_[b];
  while (i < first_label_[a + 1] && j < first_label_[b + 1]) {
    const Label &x = labels_[i], &y = labels_[j];
    if (x.hub == y.hub && x.length + y.length < best.length) best = {x.length + y.length, x.hub};
    i += x.hub <= y.hub ? 1 : 0;
    j += y.hub <= x.hub ? 1 : 0;
  }
  return best;
}

CornerHubs::Way CornerHubs::shortest(const Site& start, const Site& goal) const {
  thread_local std::vector<SeenCorner> near_start, near_goal;
  Way best;
  look_from(start, near_start);
  look_from(goal, near_goal);
  if (near_goal.empty()) return best;
  best.near_goal = near_goal[0].corner;
  best.to_goal = near_goal[0].straight;
  if (near_start.empty()) return best;
  if (table_.empty()) {
    join_by_labels(start, goal, near_start, near_goal, best);
  } else {
    join_by_table(start, goal, near_start, near_goal, best);
  }
  return best;
}

void CornerHubs::join_by_table(const Site& start, const Site& goal, std::vector<SeenCorner>& near_start,
                               std::vector<SeenCorner>& near_goal, Way& best) const {
  // Good paths first: to the corner nearest to one end from all corners that the other end sees. By the
  // triangle inequality, their lengths also bound paths through the same corners: a path through a
  // corner is at least its length to the nearest corner minus that corner's distance from the end.
  const auto by_nearest = [&](const std::vector<SeenCorner>& from, const SeenCorner& nearest,
                              bool forward) {
    const double* to = row(nearest.corner);
    for (const SeenCorner& seen : from) {
      const double l = seen.straight + to[seen.corner] + nearest.straight;
      offer(l, forward ? seen : nearest, forward ? nearest : seen, best);
    }
  };
  by_nearest(near_start, near_goal[0], true);
  by_nearest(near_goal, near_start[0], false);
  const auto keep = [&](std::vector<SeenCorner>& from, const SeenCorner& nearest, const Site& end) {
    const double* to = row(nearest.corner);
    std::size_t kept = 0;
    for (const SeenCorner& seen : from) {
      if (seen.straight + to[seen.corner] - nearest.straight >= best.length ||
          seen.straight + distance(corners_[seen.corner].position, end.position) >= best.length) {
        continue;
      }
      from[kept++] = seen;
    }
    from.resize(kept);
  };
  const SeenCorner a0 = near_start[0], b0 = near_goal[0];
  keep(near_start, b0, goal);
  keep(near_goal, a0, start);
  for (const SeenCorner& a : near_start) {
    const double* to = row(a.corner);
    for (const SeenCorner& b : near_goal) {
      offer(a.straight + to[b.corner] + b.straight, a, b, best);
    }
  }
}

void CornerHubs::join_by_labels(const Site& start, const Site& goal,
                                const std::vector<SeenCorner>& near_start,
                                const std::vector<SeenCorner>& near_goal, Way& best) const {
  struct Entry {
    double length = kInfinity;
    SeenCorner first;
    std::uint64_t round = 0;
  };
  thread_local std::vector<Entry> from_start;
  thread_local std::uint64_t round = 0;
  // Lower bound of a path through the corner to the other end.
  const auto least = [&](const SeenCorner& seen, const Site& end) {
    return seen.straight + distance(corners_[seen.corner].position, end.position);
  };
  // Start with a good path, through the corners that lead most directly to the other end. Most other
  // corners are then too far.
  const auto first = [&](const std::vector<SeenCorner>& from, const Site& end) {
    return *std::min_element(from.begin(), from.end(), [&](const SeenCorner& a, const SeenCorner& b) {
      return least(a, end) < least(b, end);
    });
  };
  const SeenCorner a0 = first(near_start, goal), b0 = first(near_goal, start);
  offer(a0.straight + meet(a0.corner, b0.corner).length + b0.straight, a0, b0, best);
  if (from_start.size() < corners_.size()) from_start.resize(corners_.size());
  ++round;
  for (const SeenCorner& seen : near_start) {
    if (least(seen, goal) >= best.length) continue;
    for (std::uint32_t i = first_label_[seen.corner]; i < first_label_[seen.corner + 1]; ++i) {
      Entry& e = from_start[labels_[i].hub];
      const double length = seen.straight + labels_[i].length;
      if (length >= best.length || (e.round == round && e.length <= length)) continue;
      e = {length, seen, round};
    }
  }
  for (const SeenCorner& seen : near_goal) {
    if (least(seen, start) >= best.length) continue;
    for (std::uint32_t i = first_label_[seen.corner]; i < first_label_[seen.corner + 1]; ++i) {
      const Entry& e = from_start[labels_[i].hub];
      if (e.round == round) offer(seen.straight + labels_[i].length + e.length, e.first, seen, best);
    }
  }
}

namespace {

/// Labels of the corner near a goal, and results computed from them.
struct NearGoal {
  std::vector<double> to_hub;       ///< Distance to each hub, metres. Infinity for hubs without a label.
  std::vector<std::uint32_t> set;   ///< Hubs with a finite value.
  std::vector<double> from_corner;  ///< Valid where `round_of` equals `round`.
  std::vector<std::uint64_t> round_of;
  std::uint64_t round = 0;
};
NearGoal& near_goal_of_thread() {
  thread_local NearGoal n;
  return n;
}

}  // namespace

CornerHubs::LeastToGoal::LeastToGoal(const CornerHubs& hubs, const Way& way) : hubs_(hubs), way_(way) {
  if (!hubs.table_.empty()) {
    if (way.near_goal != UnfoldedMesh::kNone) row_ = hubs.row(way.near_goal);
    return;
  }
  NearGoal& near = near_goal_of_thread();
  for (const std::uint32_t hub : near.set) near.to_hub[hub] = kInfinity;
  near.set.clear();
  ++near.round;
  const std::size_t n = hubs.corners_.size();
  if (near.to_hub.size() < n) {
    near.to_hub.resize(n, kInfinity);
    near.from_corner.resize(n);
    near.round_of.resize(n, 0);
  }
  if (way.near_goal == UnfoldedMesh::kNone) return;
  for (std::uint32_t i = hubs.first_label_[way.near_goal]; i < hubs.first_label_[way.near_goal + 1];
       ++i) {
    near.to_hub[hubs.labels_[i].hub] = hubs.labels_[i].length;
    near.set.push_back(hubs.labels_[i].hub);
  }
}

double CornerHubs::LeastToGoal::from(std::uint32_t vertex) const noexcept {
  const std::uint32_t c = hubs_.corner_of_[vertex];
  if (c == UnfoldedMesh::kNone || way_.near_goal == UnfoldedMesh::kNone) return 0;
  // Subtract the rounding error.
  const auto less = [&](double d) {
    return d < kInfinity ? max(d - way_.to_goal - kRounding, 0.0) : 0.0;
  };
  if (row_ != nullptr) return less(row_[c]);
  NearGoal& near = near_goal_of_thread();
  if (near.round_of[c] == near.round) return near.from_corner[c];
  double d = kInfinity;
  for (std::uint32_t i = hubs_.first_label_[c]; i < hubs_.first_label_[c + 1]; ++i) {
    d = min(d, hubs_.labels_[i].length + near.to_hub[hubs_.labels_[i].hub]);
  }
  near.round_of[c] = near.round;
  return near.from_corner[c] = less(d);
}

std::vector<CornerHubs::Leg> CornerHubs::legs(const Way& way, const Site& goal) const {
  const std::uint32_t hub = meet(way.first, way.last).hub;
  using Place = std::pair<std::uint32_t, double>;  // A corner and its distance to the hub.
  const auto to_hub = [&](std::uint32_t corner) {
    std::vector<Place> out;
    for (;;) {
      const auto first = labels_.begin() + first_label_[corner],
                 last = labels_.begin() + first_label_[corner + 1];
      const Label& l = *std::find_if(first, last, [&](const Label& label) { return label.hub == hub; });
      out.emplace_back(corner, l.length);
      if (corner == hub_corner_[hub]) return out;
      corner = l.next;
    }
  };
  std::vector<Place> order = to_hub(way.first), back = to_hub(way.last);
  order.insert(order.end(), back.rbegin() + 1, back.rend());
  std::vector<Leg> out{{corners_[way.first], way.to_first}};
  for (std::size_t i = 1; i < order.size(); ++i) {
    out.push_back({corners_[order[i].first], std::abs(order[i].second - order[i - 1].second)});
  }
  out.push_back({goal, way.from_last});
  return out;
}

}  // namespace gsnav::detail
