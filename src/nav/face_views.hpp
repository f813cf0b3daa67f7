// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unfolded_mesh.hpp"

namespace gsnav::detail {

/// Which faces can be seen from which along straight ways, through which edge and in which directions: a
/// search for such a way need not look elsewhere. From above: beams of all lines that cross two edges
/// are a little wider than what crosses those between as well.
class FaceViews {
 public:
  /// Nothing is known, so that empty() holds, of a mesh with more pairs of a face and an edge than this
  /// (two bytes each, 32 MiB: some 2000 faces).
  static constexpr std::size_t kMostPairs = std::size_t{1} << 24;
  /// Beams followed in all; from an edge with more than its part of them everything is taken to be seen.
  static constexpr std::size_t kMostBeams = std::size_t{1} << 24;

  /// Directions of lines out of a face across its edge, from the left to the right as steps 0 to kSteps
  /// of the angle's cosine over the sum of cosine and sine, against the edge from its first corner to
  /// the next. None where low > high.
  struct Range {
    std::uint8_t low = kSteps, high = 0;
  };
  static constexpr std::uint8_t kSteps = 255;

  FaceViews() = default;
  explicit FaceViews(const UnfoldedMesh& mesh);

  bool empty() const noexcept { return ranges_.empty(); }
  /// Of straight ways that leave a face across `edge` and end in the face `goal`.
  Range toward(std::uint32_t goal, std::uint32_t edge) const noexcept {
    return ranges_[std::size_t{goal} * edges_ + edge];
  }
  /// Takes what of the window [right, left] of the edge, both as shares of its length, lines from a root
  /// reach within the range; false where that is nothing. The root lies at `along` the edge and `inside`
  /// it, both in shares.
  static bool narrow(Range range, double along, double inside, double& right, double& left) noexcept;

 private:
  /// Marks what is seen from the face of `edge` through it; false after `most` beams.
  bool look_through(const UnfoldedMesh& mesh, std::uint32_t edge, std::size_t most);

  std::size_t edges_ = 0;
  std::vector<Range> ranges_;  ///< [goal][edge]
};

}  // namespace gsnav::detail
