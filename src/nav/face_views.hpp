// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unfolded_mesh.hpp"

namespace gsnav::detail {

/// Which faces can be seen from which along straight ways, and through which edge: a search for such a
/// way need not look elsewhere. From above: beams of all lines that cross two edges are a little wider
/// than what crosses those between as well.
class FaceViews {
 public:
  /// Nothing is known, so that empty() holds, of a mesh of more faces than this.
  static constexpr std::size_t kMostFaces = std::size_t{1} << 11;
  /// Beams followed in all; from an edge with more than its part of them everything is taken to be seen.
  static constexpr std::size_t kMostBeams = std::size_t{1} << 21;

  FaceViews() = default;
  explicit FaceViews(const UnfoldedMesh& mesh);

  bool empty() const noexcept { return through_.empty(); }
  /// False where no straight way leaves `face` through its edge number k and ends in `goal`.
  bool may_lead(std::uint32_t face, std::uint32_t k, std::uint32_t goal) const noexcept {
    return (through_[std::size_t{goal} * faces_ + face] & bit(k)) != 0;
  }

 private:
  static std::uint8_t bit(std::uint32_t k) noexcept {
    return static_cast<std::uint8_t>(1u << (k < 7 ? k : 7));
  }
  /// Marks what is seen from the face of `edge` through it; false after `most` beams.
  bool look_through(const UnfoldedMesh& mesh, std::uint32_t edge, std::size_t most);

  std::size_t faces_ = 0;
  std::vector<std::uint8_t>
      through_;  ///< [goal][face]: edges that may lead there, those from the eighth on as one
};

}  // namespace gsnav::detail
