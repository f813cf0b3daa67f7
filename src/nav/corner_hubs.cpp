// SPDX-License-Identifier: Apache-2.0
#include "corner_hubs.hpp"

#include <algorithm>
#include <functional>
#include <numeric>
#include <queue>

#include "tolerances.hpp"

namespace gsnav::detail {

CornerHubs::CornerHubs(const UnfoldedMesh& mesh) {
  std::vector<std::vector<Link>> links;
  const bool seen = look(mesh, links);
  if (seen) rank(links);
  if (!seen || !label(links)) {
    corners_.clear();
    sights_.clear();
    sights_.shrink_to_fit();
    first_sight_.clear();
  } else {
    fill_table();
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
  // Adjacent windows of one root are merged into one sight.
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
  constexpr double kShort =
      1e-4;  // Metres. Sides that begin this near to their end are left to the exact test.
  sides_.assign(6 * sights_.size(), 0.0f);
  for (const Sight& s : sights_) roots_.push_back({s.root, s.corner});
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const Flat origin = mesh.edges[mesh.faces[f].first].at;
    double size = 0;
    for (std::uint32_t k = 0; k < mesh.faces[f].count; ++k) {
      size = max(size, length(mesh.edges[mesh.faces[f].first + k].at - origin));
    }
    face_origins_.push_back({origin, static_cast<float>(1e-3 + 1e-6 * size)});
    const std::size_t first = first_sight_[f], n = first_sight_[f + 1] - first;
    for (std::size_t i = 0; i < n; ++i) {
      const Sight& s = sights_[first + i];
      const auto draw = [&](const Flat& end, double inside, std::size_t row) {
        const Flat d = end - s.root;
        const double l = length(d);
        if (!(l > kShort)) return;
        const Flat normal = Flat{-d.y, d.x} * (inside / l);
        const double number[3] = {normal.x, normal.y, dot(normal, origin - s.root)};
        for (std::size_t k = 0; k < 3; ++k)
          sides_[6 * first + (row + k) * n + i] = static_cast<float>(number[k]);
      };
      draw(s.right, 1.0, 0);
      draw(s.left, -1.0, 3);
    }
  }
}

void CornerHubs::rank(const std::vector<std::vector<Link>>& links) {
  // Corners on many shortest paths are good hubs. Count them on the path trees of a sample of corners.
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

void CornerHubs::fill_table() {
  const std::size_t n = corners_.size();
  if (n > kMostTable) return;
  table_.assign(n * n, kInfinity);
  std::vector<double> to_hub(n, kInfinity);
  for (std::size_t a = 0; a < n; ++a) {
    for (std::uint32_t i = first_label_[a]; i < first_label_[a + 1]; ++i)
      to_hub[labels_[i].hub] = labels_[i].length;
    for (std::size_t b = 0; b <= a; ++b) {
      double d = kInfinity;
      for (std::uint32_t i = first_label_[b]; i < first_label_[b + 1]; ++i) {
        d = min(d, labels_[i].length + to_hub[labels_[i].hub]);
      }
      table_[a * n + b] = table_[b * n + a] = d;
    }
    for (std::uint32_t i = first_label_[a]; i < first_label_[a + 1]; ++i)
      to_hub[labels_[i].hub] = kInfinity;
  }
}

}  // namespace gsnav::detail
