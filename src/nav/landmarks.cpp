// SPDX-License-Identifier: Apache-2.0
#include "landmarks.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "tolerances.hpp"

namespace gsnav::detail {
namespace {

constexpr std::uint32_t kParts = Landmarks::kParts;

float rounded_up(double x) noexcept {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) >= x ? f : std::nextafter(f, std::numeric_limits<float>::infinity());
}

/// Adds `one` to the `count` elements whose `key` is largest, from the largest down, if it is among the
/// first N. Of equal ones, the earlier stays.
template <class T, std::size_t N, class Key>
void keep_largest(std::array<T, N>& kept, std::size_t& count, const T& one, const Key& key) noexcept {
  if (count == N && key(one) <= key(kept[N - 1])) return;
  std::size_t at = count < N ? count++ : N - 1;
  for (; at > 0 && key(one) > key(kept[at - 1]); --at) kept[at] = kept[at - 1];
  kept[at] = one;
}

/// Part of an edge that is reached in a straight line from a root, in metres along the edge.
struct EdgeReach {
  double low = 0, high = 0;
  double at = 0, beside = 0, g = 0;  ///< Position of the root along the edge and its distance from the
                                     ///< line, and the root's own distance.
  double length_to(double x) const noexcept {
    return g + std::sqrt((x - at) * (x - at) + beside * beside);
  }
};

/// Distances from a landmark along one edge.
struct AlongEdge {
  const EdgeReach* first = nullptr;
  const EdgeReach* last = nullptr;
  double length = 0;
  double from_low = kInfinity, from_high = kInfinity;  ///< Distances from the landmark to its ends.

  double distance(double x) const noexcept {
    double d = min(from_low + x, from_high + length - x);
    for (const EdgeReach* r = first; r != last; ++r) {
      if (x >= r->low - kRounding && x <= r->high + kRounding) d = min(d, r->length_to(x));
    }
    return d;
  }
};

/// Largest amount by which the distance is below the line from (low, a) to (high, b).
double most_below(const AlongEdge& e, double low, double high, double a, double b) noexcept {
  const double slope = (b - a) / (high - low), rest = 1.0 - slope * slope;
  double most = 0;
  for (const EdgeReach* r = e.first; r != e.last; ++r) {
    const double from = max(r->low - kRounding, low), to = min(r->high + kRounding, high);
    if (from > to) continue;
    double x = slope > 0 ? to : from;
    if (rest > 1e-12) x = clamp(r->at + slope * r->beside / std::sqrt(rest), from, to);
    most = max(most, a + slope * (x - low) - r->length_to(x));
  }
  return most;
}

/// Largest amount by which the distance is above the line. `ends` is scratch.
double most_above(const AlongEdge& e, double low, double high, double a, double b,
                  std::vector<double>& ends) {
  constexpr std::size_t kTaken = 6;
  ends.assign({low, high});
  for (const EdgeReach* r = e.first; r != e.last; ++r) {
    for (const double x : {r->low, r->high}) {
      if (x > low + kRounding && x < high - kRounding) ends.push_back(x);
    }
  }
  std::sort(ends.begin(), ends.end());
  const double slope = (b - a) / (high - low);
  double most = 0;
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    const double x = ends[i], y = ends[i + 1];
    // Values above the line at both ends of [x, y]. A convex function is below its chord. Keep the
    // lowest few.
    std::array<std::pair<double, double>, kTaken> over;
    std::size_t m = 0;
    const double line_x = a + slope * (x - low), line_y = a + slope * (y - low);
    const auto take = [&](double at_x, double at_y) {
      keep_largest(over, m, {at_x - line_x, at_y - line_y},
                   [](const auto& p) { return -(p.first + p.second); });
    };
    take(e.from_low + x, e.from_low + y);
    take(e.from_high + e.length - x, e.from_high + e.length - y);
    for (const EdgeReach* r = e.first; r != e.last; ++r) {
      if (r->low <= x + kRounding && r->high >= y - kRounding) take(r->length_to(x), r->length_to(y));
    }
    // The minimum of all chords is largest where two of them cross or at an end.
    double least = kInfinity;
    for (std::size_t j = 0; j < m; ++j) {
      for (std::size_t k = 0; k <= j; ++k) {
        const auto& [px, py] = over[j];
        const auto& [qx, qy] = over[k];
        double peak = max(min(px, qx), min(py, qy));
        if ((px < qx) != (py < qy)) {
          const double t = (qx - px) / ((qx - px) + (py - qy));
          if (t >= 0 && t <= 1) peak = max(peak, px + t * (py - px));
        }
        least = min(least, peak);
      }
    }
    most = max(most, least);
  }
  return most;
}

/// Positions spread evenly over the mesh: three quarters along walls, the others in the middle of faces.
std::vector<Site> spread_evenly(const UnfoldedMesh& mesh, std::size_t count) {
  std::vector<Site> out;
  std::vector<std::pair<double, std::uint32_t>> walls, inside;  // Cumulative length and area.
  double length_so_far = 0, area = 0;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const UnfoldedMesh::Face& face = mesh.faces[f];
    for (std::uint32_t k = 0; k < face.count; ++k) {
      const std::uint32_t e = face.first + k;
      const Flat &a = mesh.edges[e].at, &b = mesh.edges[mesh.next(e)].at;
      area += 0.5 * max(cross(a - mesh.edges[face.first].at, b - mesh.edges[face.first].at), 0.0);
      if (mesh.edges[e].twin != UnfoldedMesh::kNone) continue;
      walls.emplace_back(length_so_far += length(b - a), e);
    }
    inside.emplace_back(area, f);
  }
  const std::size_t on_walls = walls.empty() ? 0 : count - count / 4;
  const auto pick = [](const auto& sums, std::size_t i, std::size_t n) {
    const double at = sums.back().first * (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    const auto it = std::lower_bound(sums.begin(), sums.end(), std::pair(at, 0u));
    return it == sums.end() ? sums.back().second : it->second;
  };
  for (std::size_t i = 0; i < count; ++i) {
    Site s;
    if (i < on_walls) {
      const std::uint32_t e = pick(walls, i, on_walls), after = mesh.next(e);
      s.face = mesh.edges[e].face;
      s.at = (mesh.edges[e].at + mesh.edges[after].at) * 0.5;
    } else {
      s.face = pick(inside, i - on_walls, count - on_walls);
      const UnfoldedMesh::Face& face = mesh.faces[s.face];
      for (std::uint32_t k = 0; k < face.count; ++k)
        s.at = s.at + mesh.edges[face.first + k].at * (1.0 / face.count);
    }
    out.push_back(s);
  }
  return out;
}

}  // namespace

const std::size_t Landmarks::kMost = 96, Landmarks::kMostBytes = std::size_t{64} << 20;

Landmarks::Landmarks(const UnfoldedMesh& mesh, std::size_t most) {
  line_of_.resize(mesh.edges.size());
  for (std::uint32_t e = 0; e < mesh.edges.size(); ++e) {
    const std::uint32_t twin = mesh.edges[e].twin;
    line_of_[e] = twin < e ? line_of_[twin] | 1u : static_cast<std::uint32_t>(2 * edges_++);
  }
  most = min(most, kMostBytes / max(edges_ * sizeof(Line), std::size_t{1}));
  GeodesicSearch search;
  for (const Site& at : spread_evenly(mesh, most)) {
    if (add(mesh, at, search)) ++count_;
  }
  // Order by vertex, because values of one vertex are read together.
  const std::size_t n = mesh.vertices.size();
  std::vector<float> by_vertex(count_ * n);
  for (std::size_t k = 0; k < count_; ++k) {
    for (std::size_t v = 0; v < n; ++v) by_vertex[v * count_ + k] = corners_[k * n + v];
  }
  corners_ = std::move(by_vertex);
}

bool Landmarks::add(const UnfoldedMesh& mesh, const Site& at, GeodesicSearch& search) {
  search.flood(mesh, {at});
  if (!search.finished()) return false;
  std::vector<std::uint32_t> first(edges_ + 1, 0);
  for (const GeodesicSearch::Node& n : search.nodes()) {
    if (!n.is_vertex) ++first[line_of_[n.edge] / 2 + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<double> scratch;
  std::vector<EdgeReach> reaches(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (const GeodesicSearch::Node& n : search.nodes()) {
    if (n.is_vertex) continue;
    const Flat origin = mesh.edges[n.edge].at, side = mesh.edges[mesh.next(n.edge)].at - origin;
    const double whole = length(side), inverse = 1.0 / whole;
    const auto along = [&](const Flat& p) {
      const double x = dot(p - origin, side) * inverse;
      return (line_of_[n.edge] & 1u) != 0 ? whole - x : x;
    };
    const double right = along(n.right), left = along(n.left);
    reaches[next[line_of_[n.edge] / 2]++] = {min(right, left), max(right, left), along(n.root),
                                             std::abs(cross(side, n.root - origin)) * inverse, n.g};
  }
  const auto known = [&](std::uint32_t vertex) { return search.vertex_distance(vertex); };
  for (std::uint32_t e = 0; e < mesh.edges.size(); ++e) {
    if ((line_of_[e] & 1u) != 0) continue;
    const std::uint32_t line = line_of_[e] / 2;
    AlongEdge own{.first = reaches.data() + first[line],
                  .last = reaches.data() + first[line + 1],
                  .length = length(mesh.edges[mesh.next(e)].at - mesh.edges[e].at),
                  .from_low = known(mesh.edges[e].vertex),
                  .from_high = known(mesh.edges[mesh.next(e)].vertex)};
    Line out{};
    if (own.from_low < kInfinity && own.from_high < kInfinity) {
      double below = 0, above = 0;
      std::array<double, kParts + 1> kept;
      for (std::uint32_t k = 0; k <= kParts; ++k) {
        const double d = own.distance(own.length * k / kParts);
        out.at[k] = static_cast<float>(d);
        kept[k] = static_cast<double>(out.at[k]);
        below = max(below, kept[k] - d);
        above = max(above, d - kept[k]);
      }
      for (std::uint32_t k = 0; k < kParts && own.length > kRounding; ++k) {
        const double low = own.length * k / kParts, high = own.length * (k + 1) / kParts;
        below = max(below, most_below(own, low, high, kept[k], kept[k + 1]));
        above = max(above, most_above(own, low, high, kept[k], kept[k + 1], scratch));
      }
      out.below = rounded_up(below + kRounding);
      out.above = rounded_up(above + kRounding);
    }
    lines_.push_back(out);
  }
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    corners_.push_back(known(v) < kInfinity ? static_cast<float>(known(v)) : 0.0f);
  }
  faces_.push_back(at.face);
  return true;
}

Landmarks::Range Landmarks::distance(const UnfoldedMesh& mesh, std::size_t landmark,
                                     const Site& to) const noexcept {
  const UnfoldedMesh::Face& face = mesh.faces[to.face];
  Range out{kInfinity, kInfinity};
  for (std::uint32_t e = face.first; e < face.first + face.count; ++e) {
    if (mesh.edges[e].twin == UnfoldedMesh::kNone) continue;
    const Line& line = lines_[landmark * edges_ + line_of_[e] / 2];
    const Flat origin = mesh.edges[e].at, side = mesh.edges[mesh.next(e)].at - origin;
    const double whole = length(side);
    if (!(whole > 0)) continue;
    const bool back = (line_of_[e] & 1u) != 0;
    const double at = dot(to.at - origin, side) / whole,
                 beside = std::abs(cross(side, to.at - origin)) / whole;
    double least = kInfinity;
    for (std::uint32_t k = 0; k < kParts; ++k) {
      const double low = whole * k / kParts, high = whole * (k + 1) / kParts;
      const double a = static_cast<double>(line.at[back ? kParts - k : k]);
      const double b = static_cast<double>(line.at[back ? kParts - k - 1 : k + 1]);
      if (min(a, b) + beside >= least) continue;
      const double slope = (b - a) / (high - low);
      least = min(least, least_sum(at, beside, low, high, a - slope * low, slope));
    }
    out.low = min(out.low, least - static_cast<double>(line.below));
    out.high = min(out.high, least + static_cast<double>(line.above));
  }
  return out;
}

LandmarkLead::LandmarkLead(const Landmarks& marks, const UnfoldedMesh& mesh, const Site& start,
                           const Site& goal)
    : line_of_(marks.line_of_.data()), least_(detail::distance(start.position, goal.position)) {
  const auto nearest = [&](const Site& s) {
    const UnfoldedMesh::Face& face = mesh.faces[s.face];
    std::uint32_t best = face.first;
    for (std::uint32_t e = face.first; e < face.first + face.count; ++e) {
      if (length(mesh.edges[e].at - s.at) < length(mesh.edges[best].at - s.at)) best = e;
    }
    return marks.corners_.data() + mesh.edges[best].vertex * marks.count_;
  };
  const float *a = nearest(start), *b = nearest(goal);
  const auto gain_of = [](const auto& candidate) { return candidate.first; };
  std::array<std::pair<float, std::uint32_t>, kTried> tried;
  std::size_t n = 0;
  for (std::uint32_t k = 0; k < marks.count_; ++k) {
    keep_largest(tried, n, {std::abs(a[k] - b[k]), k}, gain_of);
  }
  std::array<std::pair<double, One>, kLeads> best;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t k = tried[i].second;
    if (marks.faces_[k] == start.face || marks.faces_[k] == goal.face) continue;
    const Landmarks::Range from = marks.distance(mesh, k, start), to = marks.distance(mesh, k, goal);
    const bool behind = from.low - to.high >= to.low - from.high;
    const double gain = behind ? from.low - to.high : to.low - from.high;
    const One one{marks.lines_.data() + k * marks.edges_, behind ? 1.0 : -1.0,
                  behind ? -to.high : to.low};
    keep_largest(best, count_, {gain, one}, gain_of);
  }
  for (std::size_t i = 0; i < count_; ++i) leads_[i] = best[i].second;
  if (count_ > 0) least_ = max(least_, best[0].first);
}

double LandmarkLead::from(std::uint32_t edge, std::uint32_t k) const noexcept {
  double most = 0;
  const std::uint32_t line = line_of_[edge] / 2, at = (line_of_[edge] & 1u) != 0 ? kParts - k : k;
  for (std::size_t i = 0; i < count_; ++i) {
    const One& one = leads_[i];
    const Landmarks::Line& l = one.lines[line];
    most = max(most, one.constant + one.sign * static_cast<double>(l.at[at]) -
                         static_cast<double>(one.sign > 0 ? l.below : l.above));
  }
  return most;
}

double LandmarkLead::toward(std::uint32_t edge, std::uint32_t k) const noexcept {
  double most = 0;
  const std::uint32_t line = line_of_[edge] / 2, at = (line_of_[edge] & 1u) != 0 ? kParts - k : k;
  for (std::size_t i = 0; i < count_; ++i) {
    const One& one = leads_[i];
    most = max(most, one.constant + one.sign * static_cast<double>(one.lines[line].at[at]));
  }
  return most;
}

double LandmarkLead::through(std::uint32_t edge, double length, double at, double beside, double low,
                             double high) const noexcept {
  const double part = length / kParts;
  const auto number = [&](double x) {
    return static_cast<std::uint32_t>(clamp(x / part, 0.0, static_cast<double>(kParts - 1)));
  };
  const std::uint32_t first = number(low), last = number(high), line = line_of_[edge] / 2;
  const bool back = (line_of_[edge] & 1u) != 0;
  double most = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const One& one = leads_[i];
    const Landmarks::Line& l = one.lines[line];
    double least = kInfinity;
    for (std::uint32_t k = first; k <= last; ++k) {
      const double a = static_cast<double>(l.at[back ? kParts - k : k]);
      const double b = static_cast<double>(l.at[back ? kParts - k - 1 : k + 1]);
      const double slope = one.sign * (b - a) / part;
      const double from = k == first ? low : part * k, to = k == last ? high : part * (k + 1);
      least = min(least, least_sum(at, beside, from, to, one.sign * a - slope * part * k, slope));
    }
    most = max(most, least + one.constant - static_cast<double>(one.sign > 0 ? l.below : l.above));
  }
  return most;
}

}  // namespace gsnav::detail
