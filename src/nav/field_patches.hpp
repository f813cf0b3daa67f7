// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "unfolded_mesh.hpp"

namespace gsnav::detail {

/// Point in the plane of a face with its distance to the goal, and the window of an edge through which
/// it sees the face. The window has no width if the point lies in the face.
struct FieldSource {
  Flat root, right, left;
  double g = 0;

  /// Last bend of the shortest path from the root through the window to p: the root or an end of the
  /// window.
  Flat last_bend(const Flat& p) const noexcept {
    const Flat d = p - root;
    const double r = cross(right - root, d), l = cross(left - root, d);
    return r >= 0 && l <= 0 ? root : r < 0 ? right : left;
  }
  /// Length of that path plus the distance of the root.
  double length_to(const Flat& p) const noexcept {
    const Flat end = last_bend(p);
    const bool bent = end.x != root.x || end.y != root.y;
    return g + (bent ? length(end - root) : 0.0) + length(p - end);
  }
  /// min(best, length_to(p)).
  double least(const Flat& p, double best) const noexcept {
    const Flat d = p - root;
    const double straight = g + length(d);
    if (straight >= best) return best;
    const double r = cross(right - root, d), l = cross(left - root, d);
    if (r >= 0 && l <= 0) return straight;
    const Flat end = r < 0 ? right : left;
    return std::min(best, g + length(end - root) + length(p - end));
  }
};

/// Grid that divides a face into patches.
struct FieldGrid {
  /// Sizes of patches: about kPatchesASource patches per source, each at least kLeastSide metres wide,
  /// and at most kMostAcross along a side.
  static constexpr double kPatchesASource = 2.0, kLeastSide = 0.2, kMostAcross = 64;

  Flat low;
  double columns_a_metre = 0, rows_a_metre = 0;
  std::uint32_t columns = 1, rows = 1;

  FieldGrid() = default;
  FieldGrid(const UnfoldedMesh& mesh, std::uint32_t face, std::size_t sources);

  std::size_t patch(const Flat& p) const noexcept {
    const double x = std::clamp((p.x - low.x) * columns_a_metre, 0.0, static_cast<double>(columns - 1));
    const double y = std::clamp((p.y - low.y) * rows_a_metre, 0.0, static_cast<double>(rows - 1));
    return std::size_t{static_cast<std::uint32_t>(y)} * columns + static_cast<std::uint32_t>(x);
  }
};

/// Patches of a face, each with the sources that can be nearest in it, in one block of memory.
///
/// Consider the part of a patch that lies in the face. The length of a source's path is convex in its
/// end point, so it is nowhere below its tangent at a point of that part. A source is dropped if this
/// tangent is at least the length of another source at all corners of the part: their difference is
/// convex, so the same holds in the whole part. With a relative error eps the tangent is multiplied by 1
/// + eps, and the result is at most that much above the minimum. A source is stored as a point if it
/// sees the whole part, or if all paths to the part bend at the same end of its window.
class FieldPatches {
 public:
  /// Largest average number of patches per source. Beyond it, all patches share all sources.
  static constexpr std::size_t kMostCopies = 16;
  static constexpr std::size_t kMostSources = 0xffff;  ///< Largest number of sources of a face.

  FieldPatches(const UnfoldedMesh& mesh, std::uint32_t face, const FieldGrid& grid,
               std::span<const FieldSource> sources, double relative_error);

  /// Smallest length to a point of a patch. Infinity if there are no sources.
  double least(std::size_t patch, const Flat& p) const noexcept {
    const std::uint64_t head = block_[patch];
    const std::uint64_t* at = block_.get() + (head >> 32);
    double best = std::numeric_limits<double>::infinity();
    for (std::uint64_t n = head >> 16 & 0xffffu; n != 0; --n, at += 3) {
      best = std::min(best, number(at[2]) + length(p - Flat{number(at[0]), number(at[1])}));
    }
    for (std::uint64_t n = head & 0xffffu; n != 0; --n, at += 7) {
      const FieldSource s{{number(at[0]), number(at[1])},
                          {number(at[2]), number(at[3])},
                          {number(at[4]), number(at[5])},
                          number(at[6])};
      best = s.least(p, best);
    }
    return best;
  }

 private:
  static double number(std::uint64_t bits) noexcept { return std::bit_cast<double>(bits); }

  /// First a head per patch: index of its numbers (32 bits), number of points and number of windows (16
  /// bits each). Then the numbers of points (at, g) and windows (root, right, left, g).
  std::unique_ptr<std::uint64_t[]> block_;
};

}  // namespace gsnav::detail
