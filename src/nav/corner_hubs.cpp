// SPDX-License-Identifier: Apache-2.0
#include "corner_hubs.hpp"

#include <algorithm>
#include <functional>
#include <numeric>
#include <queue>

namespace gsnav::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-9;  // metres, or square metres: sights that only touch count

}  // namespace

CornerHubs::CornerHubs(const UnfoldedMesh& mesh) {
  std::vector<std::vector<Link>> links;
  const bool seen = look(mesh, links);
  if (seen) rank(links);
  if (!seen || !label(links)) {
    corners_.clear();
    sights_.clear();
    sights_.shrink_to_fit();
    first_sight_.clear();
  }
}

bool CornerHubs::look(const UnfoldedMesh& mesh, std::vector<std::vector<Link>>& links) {
  corner_of_.assign(mesh.vertices.size(), UnfoldedMesh::kNone);
  std::vector<std::uint32_t> vertex_of;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!mesh.vertices[v].turning) continue;
    const UnfoldedMesh::Edge& e = mesh.edges[mesh.fans[mesh.vertices[v].first]];
    corner_of_[v] = static_cast<std::uint32_t>(corners_.size());
    vertex_of.push_back(v);
    corners_.push_back({e.face, e.at, e.corner});
    if (corners_.size() > kMostCorners) return false;
  }
  struct Placed {
    std::uint32_t face;
    Sight sight;
  };
  std::vector<Placed> seen;
  links.resize(corners_.size());
  // Windows side by side, of one root, are one sight.
  std::vector<std::size_t> last_of(mesh.faces.size(), 0);
  const auto same = [](const Flat& a, const Flat& b) { return length(a - b) < kRounding; };
  const auto add = [&](const Placed& p) {
    const std::size_t last = last_of[p.face];
    last_of[p.face] = seen.size();
    if (last < seen.size() && seen[last].face == p.face && seen[last].sight.corner == p.sight.corner &&
        same(seen[last].sight.root, p.sight.root)) {
      Sight& s = seen[last].sight;
      last_of[p.face] = last;
      if (same(s.left, p.sight.right)) {
        s.left = p.sight.left;
        return;
      }
      if (same(s.right, p.sight.left)) {
        s.right = p.sight.right;
        return;
      }
      last_of[p.face] = seen.size();
    }
    seen.push_back(p);
  };
  GeodesicSearch& search = thread_search();
  for (std::uint32_t c = 0; c < corners_.size(); ++c) {
    const UnfoldedMesh::Vertex& v = mesh.vertices[vertex_of[c]];
    for (std::uint32_t i = 0; i < v.count; ++i) {
      const UnfoldedMesh::Edge& e = mesh.edges[mesh.fans[v.first + i]];
      seen.push_back({e.face, {e.at, e.at, e.at, c}});
    }
    const std::size_t bending = search.look_around(mesh, vertex_of[c]);
    for (std::size_t i = 0; i < search.nodes().size(); ++i) {
      const GeodesicSearch::Node& n = search.nodes()[i];
      const UnfoldedMesh::Edge& e = mesh.edges[n.edge];
      if (n.is_vertex) {
        links[c].push_back({n.g, corner_of_[e.vertex]});
        links[corner_of_[e.vertex]].push_back({n.g, c});
      } else if (i < bending) {
        add({e.face, {n.root, n.right, n.left, c}});
      }
    }
    if (seen.size() > kMostSights) return false;
  }
  first_sight_.assign(mesh.faces.size() + 1, 0);
  for (const Placed& s : seen) ++first_sight_[s.face + 1];
  std::partial_sum(first_sight_.begin(), first_sight_.end(), first_sight_.begin());
  sights_.resize(seen.size());
  std::vector<std::uint32_t> at(first_sight_.begin(), first_sight_.end() - 1);
  for (const Placed& s : seen) sights_[at[s.face]++] = s.sight;
  draw_sides(mesh);
  return true;
}

void CornerHubs::draw_sides(const UnfoldedMesh& mesh) {
  constexpr double kShort = 1e-4;  // metres: sides that begin so near their end are left to the exact test
  sides_.assign(6 * sights_.size(), 0.0f);
  for (const Sight& s : sights_) roots_.push_back({s.root, s.corner});
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const Flat origin = mesh.edges[mesh.faces[f].first].at;
    double size = 0;
    for (std::uint32_t k = 0; k < mesh.faces[f].count; ++k) {
      size = max(size, length(mesh.edges[mesh.faces[f].first + k].at - origin));
    }
    frames_.push_back({origin, static_cast<float>(1e-3 + 1e-6 * size)});
    const std::size_t first = first_sight_[f], n = first_sight_[f + 1] - first;
    for (std::size_t i = 0; i < n; ++i) {
      const Sight& s = sights_[first + i];
      const auto draw = [&](const Flat& end, double inside, std::size_t row) {
        const Flat d = end - s.root;
        const double l = length(d);
        if (!(l > kShort)) return;
        const Flat normal = Flat{-d.y, d.x} * (inside / l);
        const double number[3] = {normal.x, normal.y, dot(normal, origin - s.root)};
        for (std::size_t k = 0; k < 3; ++k) sides_[6 * first + (row + k) * n + i] = static_cast<float>(number[k]);
      };
      draw(s.right, 1.0, 0);
      draw(s.left, -1.0, 3);
    }
  }
}

void CornerHubs::rank(const std::vector<std::vector<Link>>& links) {
  // Corners on many shortest paths make good hubs: counted on the trees of paths from a sample of corners.
  constexpr std::size_t kTrees = 64;
  const std::size_t n = corners_.size(), stride = max(n / kTrees, std::size_t{1});
  std::vector<double> score(n, 0.0), below(n), best(n);
  std::vector<std::uint32_t> parent(n), order;
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (std::uint32_t root = 0; root < n; root += static_cast<std::uint32_t>(stride)) {
    std::fill(best.begin(), best.end(), kInfinity);
    order.clear();
    best[root] = 0;
    parent[root] = root;
    queue.emplace(0.0, root);
    while (!queue.empty()) {
      const auto [length, c] = queue.top();
      queue.pop();
      if (length > best[c]) continue;
      order.push_back(c);
      for (const Link& link : links[c]) {
        if (!(length + link.length < best[link.corner])) continue;
        best[link.corner] = length + link.length;
        parent[link.corner] = c;
        queue.emplace(best[link.corner], link.corner);
      }
    }
    for (const std::uint32_t c : order) below[c] = 1;
    for (std::size_t i = order.size(); i-- > 1;) below[parent[order[i]]] += below[order[i]];
    for (const std::uint32_t c : order) score[c] += below[c];
  }
  hub_corner_.resize(n);
  std::iota(hub_corner_.begin(), hub_corner_.end(), 0u);
  std::stable_sort(hub_corner_.begin(), hub_corner_.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return score[a] > score[b]; });
}

bool CornerHubs::label(const std::vector<std::vector<Link>>& links) {
  std::vector<std::vector<Label>> labels(corners_.size());
  std::vector<double> to_hub(corners_.size(), kInfinity), best(corners_.size(), kInfinity);
  std::vector<std::uint32_t> next(corners_.size(), 0), touched;
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  std::size_t work = 0;
  for (std::uint32_t rank = 0; rank < hub_corner_.size(); ++rank) {
    const std::uint32_t hub = hub_corner_[rank];
    for (const Label& l : labels[hub]) to_hub[l.hub] = l.length;
    best[hub] = 0;
    next[hub] = hub;
    touched.assign(1, hub);
    queue.emplace(0.0, hub);
    while (!queue.empty()) {
      const double length = queue.top().first;
      const std::uint32_t c = queue.top().second;
      queue.pop();
      if (length > best[c]) continue;
      work += labels[c].size() + links[c].size();
      if (work > kMostWork) return false;
      const bool known = std::any_of(labels[c].begin(), labels[c].end(),
                                     [&](const Label& l) { return l.length + to_hub[l.hub] <= length; });
      if (known) continue;
      labels[c].push_back({length, rank, next[c]});
      for (const Link& link : links[c]) {
        const double there = length + link.length;
        if (!(there < best[link.corner])) continue;
        if (!(best[link.corner] < kInfinity)) touched.push_back(link.corner);
        best[link.corner] = there;
        next[link.corner] = c;
        queue.emplace(there, link.corner);
      }
    }
    for (const std::uint32_t c : touched) best[c] = kInfinity;
    for (const Label& l : labels[hub]) to_hub[l.hub] = kInfinity;
  }
  for (const auto& of_corner : labels) {
    first_label_.push_back(static_cast<std::uint32_t>(labels_.size()));
    labels_.insert(labels_.end(), of_corner.begin(), of_corner.end());
  }
  first_label_.push_back(static_cast<std::uint32_t>(labels_.size()));
  return true;
}

namespace {

/// Where the point (x, y) is within both sides of a sight: 0 no, 1 perhaps, 2 yes.
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

void CornerHubs::look_from(const Site& from, const Site& to, std::vector<Seen>& out) const {
  out.clear();
  std::size_t first = 0;
  thread_local std::vector<std::uint8_t> within;
  const std::size_t begin = first_sight_[from.face], n = first_sight_[from.face + 1] - begin;
  const Frame& frame = frames_[from.face];
  const float x = static_cast<float>(from.at.x - frame.origin.x), y = static_cast<float>(from.at.y - frame.origin.y);
  if (within.size() < n) within.resize(n);
  inside_sides(sides_.data() + std::size_t{6} * begin, n, x, y, frame.margin, within.data());
  for (std::size_t i = 0; i < n; ++i) {
    if (within[i] == 0) continue;
    const Root& root = roots_[begin + i];
    const Flat d = from.at - root.at;
    if (within[i] == 1) {
      const Sight& s = sights_[begin + i];
      if (cross(s.right - s.root, d) < -kRounding || cross(s.left - s.root, d) > kRounding) continue;
    }
    const double straight = length(d);
    out.push_back({straight, straight + distance(corners_[root.corner].position, to.position), root.corner});
    if (out.back().least < out[first].least) first = out.size() - 1;
  }
  if (!out.empty()) std::swap(out[0], out[first]);
}

void CornerHubs::meet(const Seen& a, const Seen& b, Way& best) const noexcept {
  std::uint32_t i = first_label_[a.corner], j = first_label_[b.corner];
  while (i < first_label_[a.corner + 1] && j < first_label_[b.corner + 1]) {
    const Label &x = labels_[i], &y = labels_[j];
    if (x.hub == y.hub) {
      const double length = a.straight + x.length + y.length + b.straight;
      if (length < best.length) best.set(length, a.corner, x.hub, b.corner);
    }
    i += x.hub <= y.hub ? 1 : 0;
    j += y.hub <= x.hub ? 1 : 0;
  }
}

CornerHubs::Way CornerHubs::shortest(const Site& start, const Site& goal) const {
  struct Entry {
    double length = kInfinity;
    std::uint32_t corner = 0;
    std::uint64_t round = 0;
  };
  thread_local std::vector<Entry> from_start;
  thread_local std::vector<Seen> near_start, near_goal;
  thread_local std::uint64_t round = 0;
  Way best;
  look_from(start, goal, near_start);
  look_from(goal, start, near_goal);
  for (const Seen& seen : near_goal) {
    if (best.near_goal != UnfoldedMesh::kNone && seen.straight >= best.to_goal) continue;
    best.near_goal = seen.corner;
    best.to_goal = seen.straight;
  }
  if (near_start.empty() || near_goal.empty()) return best;
  // A good way first, by the corners that lead most nearly to the other end: most others are then too far.
  meet(near_start[0], near_goal[0], best);
  if (from_start.size() < corners_.size()) from_start.resize(corners_.size());
  ++round;
  for (const Seen& seen : near_start) {
    if (seen.least >= best.length) continue;
    for (std::uint32_t i = first_label_[seen.corner]; i < first_label_[seen.corner + 1]; ++i) {
      Entry& e = from_start[labels_[i].hub];
      const double length = seen.straight + labels_[i].length;
      if (length >= best.length || (e.round == round && e.length <= length)) continue;
      e = {length, seen.corner, round};
    }
  }
  for (const Seen& seen : near_goal) {
    if (seen.least >= best.length) continue;
    for (std::uint32_t i = first_label_[seen.corner]; i < first_label_[seen.corner + 1]; ++i) {
      const Entry& e = from_start[labels_[i].hub];
      const double length = seen.straight + labels_[i].length + e.length;
      if (e.round == round && length < best.length) best.set(length, e.corner, labels_[i].hub, seen.corner);
    }
  }
  return best;
}

namespace {

/// Of the corner near a goal, and what came of it.
struct NearGoal {
  std::vector<double> to_hub;            ///< infinity where it has no label
  std::vector<std::uint32_t> set;        ///< the finite ones
  std::vector<double> from_corner;       ///< where `round_of` is the round
  std::vector<std::uint64_t> round_of;
  std::uint64_t round = 0;
};
NearGoal& near_goal_of_thread() {
  thread_local NearGoal n;
  return n;
}

}  // namespace

CornerHubs::LeastToGoal::LeastToGoal(const CornerHubs& hubs, const Way& way) : hubs_(hubs), way_(way) {
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
  for (std::uint32_t i = hubs.first_label_[way.near_goal]; i < hubs.first_label_[way.near_goal + 1]; ++i) {
    near.to_hub[hubs.labels_[i].hub] = hubs.labels_[i].length;
    near.set.push_back(hubs.labels_[i].hub);
  }
}

double CornerHubs::LeastToGoal::from(std::uint32_t vertex) const noexcept {
  const std::uint32_t c = hubs_.corner_of_[vertex];
  if (c == UnfoldedMesh::kNone || way_.near_goal == UnfoldedMesh::kNone) return 0;
  NearGoal& near = near_goal_of_thread();
  if (near.round_of[c] == near.round) return near.from_corner[c];
  double d = kInfinity;
  for (std::uint32_t i = hubs_.first_label_[c]; i < hubs_.first_label_[c + 1]; ++i) {
    d = min(d, hubs_.labels_[i].length + near.to_hub[hubs_.labels_[i].hub]);
  }
  near.round_of[c] = near.round;
  // Less what rounding may have left out.
  return near.from_corner[c] = d < kInfinity ? max(d - way_.to_goal - kRounding, 0.0) : 0.0;
}

std::vector<Site> CornerHubs::bends(const Way& way) const {
  const auto to_hub = [&](std::uint32_t corner) {
    std::vector<std::uint32_t> out{corner};
    while (corner != hub_corner_[way.hub]) {
      const auto first = labels_.begin() + first_label_[corner], last = labels_.begin() + first_label_[corner + 1];
      corner = std::find_if(first, last, [&](const Label& l) { return l.hub == way.hub; })->next;
      out.push_back(corner);
    }
    return out;
  };
  std::vector<std::uint32_t> order = to_hub(way.first), back = to_hub(way.last);
  order.insert(order.end(), back.rbegin() + 1, back.rend());
  std::vector<Site> out;
  for (const std::uint32_t c : order) out.push_back(corners_[c]);
  return out;
}

}  // namespace gsnav::detail
