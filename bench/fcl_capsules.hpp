// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "gsnav/math/capsule.hpp"

// The Flexible Collision Library (libfcl-dev) on pairs of capsules, for comparison. Compiled if CMake
// finds it.

namespace gsnav_bench {

/// Pairs of capsules that keep radius and direction while they move, in double.
class FclPairs {
 public:
  FclPairs(const std::vector<gsnav::MovingCapsule<double>>& a,
           const std::vector<gsnav::MovingCapsule<double>>& b);
  ~FclPairs();
  FclPairs(const FclPairs&) = delete;
  FclPairs& operator=(const FclPairs&) = delete;

  /// Distance at the start of the motion of pair i by fcl::distance, which has a special case for two
  /// capsules; 0 or less if they overlap.
  double distance(std::size_t i) const;
  /// Time at which pair i comes into contact, as a part of its motion, by fcl::continuousCollide with
  /// conservative advancement on translations, tolerance 1e-4; 2 without contact.
  double contact(std::size_t i) const;

 private:
  struct Pairs;
  std::unique_ptr<Pairs> pairs_;
};

}  // namespace gsnav_bench
