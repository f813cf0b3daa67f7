// SPDX-License-Identifier: Apache-2.0
#include "field_cells.hpp"

#include <cmath>
#include <initializer_list>
#include <utility>
#include <vector>

namespace gsnav::detail {
namespace {

constexpr double kMargin = 1e-9;     // metres: a cell and a face reach so far beyond their sides
constexpr double kRounding = 1e-12;  // metres: what rounding may add to a length
constexpr double kAtBend = 1e-9;     // metres: the direction to a point so near is not known

/// What of a convex polygon lies left of the line through p along d; 0 is on the line.
void cut(std::vector<Flat>& polygon, std::vector<Flat>& scratch, const Flat& p, const Flat& d) {
  scratch.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Flat &a = polygon[i], &b = polygon[i + 1 < polygon.size() ? i + 1 : 0];
    const double at_a = cross(d, a - p), at_b = cross(d, b - p);
    if (at_a >= 0) scratch.push_back(a);
    if ((at_a >= 0) != (at_b >= 0)) scratch.push_back(a + (b - a) * (at_a / (at_a - at_b)));
  }
  polygon.swap(scratch);
}

}  // namespace

FieldGrid::FieldGrid(const UnfoldedMesh& mesh, std::uint32_t face, std::size_t sources) {
  const UnfoldedMesh::Face& f = mesh.faces[face];
  low = mesh.edges[f.first].at;
  Flat high = low;
  for (std::uint32_t k = 1; k < f.count; ++k) {
    const Flat& p = mesh.edges[f.first + k].at;
    low = {min(low.x, p.x), min(low.y, p.y)};
    high = {max(high.x, p.x), max(high.y, p.y)};
  }
  const Flat size = high - low;
  if (sources < 2 || !(size.x > 0 && size.y > 0)) return;
  const double side =
      max(std::sqrt(size.x * size.y / (kCellsASource * static_cast<double>(sources))), kLeastSide);
  columns = static_cast<std::uint32_t>(clamp(std::ceil(size.x / side), 1.0, kMostAcross));
  rows = static_cast<std::uint32_t>(clamp(std::ceil(size.y / side), 1.0, kMostAcross));
  columns_a_metre = columns / size.x;
  rows_a_metre = rows / size.y;
}

FieldCells::FieldCells(const UnfoldedMesh& mesh, std::uint32_t face, const FieldGrid& grid,
                       std::span<const FieldSource> sources, double relative_error) {
  struct Candidate {
    double at_middle = 0;
    std::uint32_t source = 0;
  };
  const UnfoldedMesh::Face& f = mesh.faces[face];
  const std::size_t cells = std::size_t{grid.columns} * grid.rows;
  std::vector<std::uint64_t> heads(cells, 0), numbers,
      windows;  // windows of a cell, to follow its points
  const auto put = [](std::vector<std::uint64_t>& to, std::initializer_list<double> values) {
    for (const double v : values) to.push_back(std::bit_cast<std::uint64_t>(v));
  };
  const auto put_window = [&](std::vector<std::uint64_t>& to, const FieldSource& s) {
    put(to, {s.root.x, s.root.y, s.right.x, s.right.y, s.left.x, s.left.y, s.g});
  };
  const auto head = [&](std::size_t begin, std::size_t points, std::size_t with_window) {
    return (std::uint64_t{cells} + begin) << 32 | std::uint64_t{points} << 16 |
           std::uint64_t{with_window};
  };
  std::vector<Candidate> candidates;
  std::vector<Flat> part, scratch;
  std::vector<double> tangents,
      lengths;  // at the part's corners; of those that are kept, one after the other
  std::size_t copies = 0;
  const double width = grid.columns_a_metre > 0 ? 1.0 / grid.columns_a_metre : 0.0;
  const double depth = grid.rows_a_metre > 0 ? 1.0 / grid.rows_a_metre : 0.0;
  const bool one = !(width > 0 && depth > 0);
  for (std::size_t cell = 0; cell < cells && !one && copies <= kMostCopies * sources.size(); ++cell) {
    const Flat a = grid.low + Flat{static_cast<double>(cell % grid.columns) * width - kMargin,
                                   static_cast<double>(cell / grid.columns) * depth - kMargin};
    const Flat b = a + Flat{width + 2 * kMargin, depth + 2 * kMargin};
    part = {a, {b.x, a.y}, b, {a.x, b.y}};
    for (std::uint32_t k = 0; k < f.count && !part.empty(); ++k) {
      const UnfoldedMesh::Edge& e = mesh.edges[f.first + k];
      const Flat d = mesh.edges[mesh.next(f.first + k)].at - e.at;
      const double l = length(d);
      if (l > 0) cut(part, scratch, e.at + Flat{d.y, -d.x} * (kMargin / l), d);
    }
    heads[cell] = head(numbers.size(), 0, 0);
    if (part.empty()) continue;
    Flat middle;
    for (const Flat& p : part) middle = middle + p * (1.0 / static_cast<double>(part.size()));
    double radius = 0, nearest = std::numeric_limits<double>::infinity();
    for (const Flat& p : part) radius = max(radius, length(p - middle));
    candidates.clear();
    for (std::uint32_t i = 0; i < sources.size(); ++i) {
      candidates.push_back({sources[i].length_to(middle), i});
      nearest = min(nearest, candidates.back().at_middle);
    }
    // No length changes faster than its end moves.
    std::erase_if(candidates,
                  [&](const Candidate& c) { return c.at_middle > nearest + 2 * radius + kRounding; });
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& x, const Candidate& y) {
      return std::pair(x.at_middle, x.source) < std::pair(y.at_middle, y.source);
    });
    lengths.clear();
    windows.clear();
    const std::size_t begin = numbers.size();
    for (const Candidate& c : candidates) {
      const FieldSource& s = sources[c.source];
      const Flat back = middle - s.last_bend(middle);
      const double away = length(back);
      tangents.clear();
      for (const Flat& p : part) {
        const double rise = away > kAtBend ? dot(back, p - middle) / away : -length(p - middle);
        tangents.push_back((c.at_middle + rise) * (1 + relative_error) + kRounding);
      }
      bool needed = true;
      for (std::size_t k = 0; k < lengths.size() && needed; k += part.size()) {
        bool above = true;
        for (std::size_t q = 0; q < part.size() && above; ++q) above = tangents[q] >= lengths[k + q];
        needed = !above;
      }
      if (!needed) continue;
      for (const Flat& p : part) lengths.push_back(s.length_to(p));
      ++copies;
      // Where the ways to the corners do not differ in where they bend, those to all of the part do not.
      const auto all = [&](const auto& test) { return std::all_of(part.begin(), part.end(), test); };
      const auto right = [&](const Flat& p) { return cross(s.right - s.root, p - s.root); };
      const auto left = [&](const Flat& p) { return cross(s.left - s.root, p - s.root); };
      if (all([&](const Flat& p) { return right(p) >= 0 && left(p) <= 0; })) {
        put(numbers, {s.root.x, s.root.y, s.g});
      } else if (all([&](const Flat& p) { return right(p) < 0; })) {
        put(numbers, {s.right.x, s.right.y, s.g + length(s.right - s.root)});
      } else if (all([&](const Flat& p) { return right(p) >= 0 && left(p) > 0; })) {
        put(numbers, {s.left.x, s.left.y, s.g + length(s.left - s.root)});
      } else {
        put_window(windows, s);
      }
    }
    const std::size_t points = (numbers.size() - begin) / 3;
    heads[cell] = head(begin, points, windows.size() / 7);
    numbers.insert(numbers.end(), windows.begin(), windows.end());
  }
  if (one || copies > kMostCopies * sources.size()) {
    numbers.clear();
    for (const FieldSource& s : sources) put_window(numbers, s);
    std::fill(heads.begin(), heads.end(), head(0, 0, sources.size()));
  }
  block_ = std::make_unique_for_overwrite<std::uint64_t[]>(cells + numbers.size());
  std::copy(heads.begin(), heads.end(), block_.get());
  std::copy(numbers.begin(), numbers.end(), block_.get() + cells);
}

}  // namespace gsnav::detail
