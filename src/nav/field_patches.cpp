// SPDX-License-Identifier: Apache-2.0
#include "field_patches.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>
#include <vector>

namespace gsnav::detail {
namespace {

constexpr double kMargin = 1e-9;  // Margin by which a patch and a face extend beyond their sides,
                                  // metres.
constexpr double kLengthRounding = 1e-12;  // Rounding error of a length, metres.
constexpr double kAtBend = 1e-9;           // Metres: closer points define no direction.

/// Clips a convex polygon to the left side of the line through p in direction d.
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

/// Builds FieldPatches::block_ of a face.
class CellsBuilder {
 public:
  CellsBuilder(const UnfoldedMesh& mesh, std::uint32_t face, const FieldGrid& grid,
               std::span<const FieldSource> sources, double relative_error)
      : mesh_(mesh),
        face_(mesh.faces[face]),
        grid_(grid),
        sources_(sources),
        relative_error_(relative_error),
        width_(grid.columns_a_metre > 0 ? 1.0 / grid.columns_a_metre : 0.0),
        depth_(grid.rows_a_metre > 0 ? 1.0 / grid.rows_a_metre : 0.0),
        heads_(std::size_t{grid.columns} * grid.rows, 0) {}

  void build() {
    const std::size_t most = FieldPatches::kMostCopies * sources_.size();
    const bool one = !(width_ > 0 && depth_ > 0);
    for (std::size_t patch = 0; patch < heads_.size() && !one && copies_ <= most; ++patch) add(patch);
    if (one || copies_ > most) share_all();
  }

  std::unique_ptr<std::uint64_t[]> block() const {
    auto out = std::make_unique_for_overwrite<std::uint64_t[]>(heads_.size() + numbers_.size());
    std::copy(heads_.begin(), heads_.end(), out.get());
    std::copy(numbers_.begin(), numbers_.end(), out.get() + heads_.size());
    return out;
  }

 private:
  struct Candidate {
    double at_middle = 0;
    std::uint32_t source = 0;
  };

  void add(std::size_t patch) {
    const std::size_t begin = numbers_.size();
    heads_[patch] = head(begin, 0, 0);
    cut_part(patch);
    if (part_.empty()) return;
    find_middle();
    find_candidates();
    lengths_.clear();
    windows_.clear();
    for (const Candidate& c : candidates_) {
      const FieldSource& s = sources_[c.source];
      if (!may_be_least(c)) continue;
      for (const Flat& p : part_) lengths_.push_back(s.length_to(p));
      ++copies_;
      put_source(s);
    }
    heads_[patch] = head(begin, (numbers_.size() - begin) / 3, windows_.size() / 7);
    numbers_.insert(numbers_.end(), windows_.begin(), windows_.end());
  }

  /// The part of a patch that lies in the face.
  void cut_part(std::size_t patch) {
    const Flat a = grid_.low + Flat{static_cast<double>(patch % grid_.columns) * width_ - kMargin,
                                    static_cast<double>(patch / grid_.columns) * depth_ - kMargin};
    const Flat b = a + Flat{width_ + 2 * kMargin, depth_ + 2 * kMargin};
    part_ = {a, {b.x, a.y}, b, {a.x, b.y}};
    for (std::uint32_t k = 0; k < face_.count && !part_.empty(); ++k) {
      const UnfoldedMesh::Edge& e = mesh_.edges[face_.first + k];
      const Flat d = mesh_.edges[mesh_.next(face_.first + k)].at - e.at;
      const double l = length(d);
      if (l > 0) cut(part_, scratch_, e.at + Flat{d.y, -d.x} * (kMargin / l), d);
    }
  }

  void find_middle() {
    middle_ = {};
    radius_ = 0;
    for (const Flat& p : part_) middle_ = middle_ + p * (1.0 / static_cast<double>(part_.size()));
    for (const Flat& p : part_) radius_ = max(radius_, length(p - middle_));
  }

  /// Sources that can be nearest somewhere in the part, sorted by their length at its middle. A length
  /// changes no faster than its end moves.
  void find_candidates() {
    candidates_.clear();
    double nearest = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < sources_.size(); ++i) {
      candidates_.push_back({sources_[i].length_to(middle_), i});
      nearest = min(nearest, candidates_.back().at_middle);
    }
    std::erase_if(candidates_, [&](const Candidate& c) {
      return c.at_middle > nearest + 2 * radius_ + kLengthRounding;
    });
    std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& x, const Candidate& y) {
      return std::pair(x.at_middle, x.source) < std::pair(y.at_middle, y.source);
    });
  }

  /// Returns false if one kept source is, at every corner of the part, at most as long as this source's
  /// lower bound, its tangent plane at the middle.
  bool may_be_least(const Candidate& c) {
    const Flat back = middle_ - sources_[c.source].last_bend(middle_);
    const double away = length(back);
    tangents_.clear();
    for (const Flat& p : part_) {
      const double rise = away > kAtBend ? dot(back, p - middle_) / away : -length(p - middle_);
      tangents_.push_back((c.at_middle + rise) * (1 + relative_error_) + kLengthRounding);
    }
    for (std::size_t k = 0; k < lengths_.size(); k += part_.size()) {
      const auto kept = lengths_.begin() + static_cast<std::ptrdiff_t>(k);
      if (std::equal(tangents_.begin(), tangents_.end(), kept, std::greater_equal<>())) return false;
    }
    return true;
  }

  /// If the paths to all corners of the part have the same last bend, so do the paths to all its points.
  /// Store only that bend.
  void put_source(const FieldSource& s) {
    const auto all = [&](const auto& test) { return std::all_of(part_.begin(), part_.end(), test); };
    const auto right = [&](const Flat& p) { return cross(s.right - s.root, p - s.root); };
    const auto left = [&](const Flat& p) { return cross(s.left - s.root, p - s.root); };
    if (all([&](const Flat& p) { return right(p) >= 0 && left(p) <= 0; })) {
      put(numbers_, {s.root.x, s.root.y, s.g});
    } else if (all([&](const Flat& p) { return right(p) < 0; })) {
      put(numbers_, {s.right.x, s.right.y, s.g + length(s.right - s.root)});
    } else if (all([&](const Flat& p) { return right(p) >= 0 && left(p) > 0; })) {
      put(numbers_, {s.left.x, s.left.y, s.g + length(s.left - s.root)});
    } else {
      put_window(windows_, s);
    }
  }

  /// Gives every patch all sources.
  void share_all() {
    numbers_.clear();
    for (const FieldSource& s : sources_) put_window(numbers_, s);
    std::fill(heads_.begin(), heads_.end(), head(0, 0, sources_.size()));
  }

  static void put(std::vector<std::uint64_t>& to, std::initializer_list<double> values) {
    for (const double v : values) to.push_back(std::bit_cast<std::uint64_t>(v));
  }
  static void put_window(std::vector<std::uint64_t>& to, const FieldSource& s) {
    put(to, {s.root.x, s.root.y, s.right.x, s.right.y, s.left.x, s.left.y, s.g});
  }
  std::uint64_t head(std::size_t begin, std::size_t points, std::size_t windows) const {
    return (std::uint64_t{heads_.size()} + begin) << 32 | std::uint64_t{points} << 16 |
           std::uint64_t{windows};
  }

  const UnfoldedMesh& mesh_;
  const UnfoldedMesh::Face& face_;
  const FieldGrid& grid_;
  std::span<const FieldSource> sources_;
  double relative_error_;
  double width_, depth_;  ///< Size of a patch, metres.
  std::vector<std::uint64_t> heads_, numbers_;
  std::size_t copies_ = 0;
  // State of the current patch:
  std::vector<Flat> part_, scratch_;
  Flat middle_;  ///< Mean of the part's corners.
  double radius_ = 0;
  std::vector<Candidate> candidates_;
  std::vector<double> tangents_, lengths_;  ///< At the corners of the part. `lengths_` has one block per
                                            ///< kept source.
  std::vector<std::uint64_t> windows_;      ///< Sources with both sides of their cone, seven
                                            ///< numbers each; written after the points.
};

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
      max(std::sqrt(size.x * size.y / (kPatchesASource * static_cast<double>(sources))), kLeastSide);
  columns = static_cast<std::uint32_t>(clamp(std::ceil(size.x / side), 1.0, kMostAcross));
  rows = static_cast<std::uint32_t>(clamp(std::ceil(size.y / side), 1.0, kMostAcross));
  columns_a_metre = columns / size.x;
  rows_a_metre = rows / size.y;
}

FieldPatches::FieldPatches(const UnfoldedMesh& mesh, std::uint32_t face, const FieldGrid& grid,
                           std::span<const FieldSource> sources, double relative_error) {
  CellsBuilder builder(mesh, face, grid, sources, relative_error);
  builder.build();
  block_ = builder.block();
}

}  // namespace gsnav::detail
