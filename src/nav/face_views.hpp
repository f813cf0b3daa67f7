// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unfolded_mesh.hpp"

namespace gsnav::detail {

/// Visibility between the faces of a mesh along straight lines. For each face and goal face it has the
/// edges through which such lines leave, and their range of directions, so that a search for straight
/// paths can skip all others. It is conservative: a beam contains all lines that
/// cross two edges, and slightly more than those that cross the edges between them too.
class FaceViews {
 public:
  /// Largest number of (face, edge) pairs. A larger mesh gets no table, and empty() is true. Two bytes
  /// per pair: 32 MiB, or about 2000 faces.
  static constexpr std::size_t kMostPairs = std::size_t{1} << 24;
  /// Largest total number of beams. An edge that uses up its share of them is treated as seeing
  /// everything.
  static constexpr std::size_t kMostBeams = std::size_t{1} << 24;

  /// Directions of lines that leave a face across its edge. They are counted from left to right in steps
  /// 0 to kSteps of cos / (|cos| + sin) of the angle to the edge, which runs from its first corner to
  /// the next. Empty if low > high.
  struct Range {
    std::uint8_t low = kSteps, high = 0;
  };
  static constexpr std::uint8_t kSteps = 255;

  FaceViews() = default;
  explicit FaceViews(const UnfoldedMesh& mesh);

  bool empty() const noexcept { return ranges_.empty(); }
  /// Directions of straight paths that leave a face across `edge` and end in the face `goal`.
  Range toward(std::uint32_t goal, std::uint32_t edge) const noexcept {
    return ranges_[std::size_t{goal} * edges_ + edge];
  }
  /// Narrows the window [right, left] of an edge to the part that lines from a root reach within
  /// `range`. Returns false if nothing remains. All lengths are fractions of the edge: the window, and
  /// the root's position `along` the edge and its distance `inside` the face.
  static bool narrow(Range range, double along, double inside, double& right, double& left) noexcept;

 private:
  /// Marks what the face of `edge` sees through it. Returns false if more than `most` beams are needed.
  bool look_through(const UnfoldedMesh& mesh, std::uint32_t edge, std::size_t most);

  std::size_t edges_ = 0;
  std::vector<Range> ranges_;  ///< Shape [goal][edge].
};

}  // namespace gsnav::detail
