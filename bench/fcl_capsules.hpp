// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "gsnav/math/capsule.hpp"

// The Flexible Collision Library (libfcl-dev) on pairs of capsules, as a peer to be measured against.
// Built where CMake finds it.

namespace gsnav_bench {

/// Pairs of capsules that keep radius and direction while they move, in double.
class FclPairs {
 public:
  FclPairs(const std::vector<gsnav::MovingCapsule<double>>& a,
           const std::vector<gsnav::MovingCapsule<double>>& b);
  ~FclPairs();
  FclPairs(const FclPairs&) = delete;
  FclPairs& operator=(const FclPairs&) = delete;

  /// Distance at the begin of pair i by fcl::distance, which treats two capsules as a case of its own; 0
  /// or less where they overlap.
  double distance(std::size_t i) const;
  /// When pair i comes into contact by fcl::continuousCollide with conservative advancement on
  /// translations, tolerance 1e-4; 2 without contact.
  double contact(std::size_t i) const;

 private:
  struct Pairs;
  std::unique_ptr<Pairs> pairs_;
};

}  // namespace gsnav_bench
