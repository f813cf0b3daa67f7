// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/detail/math/angles.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Small deterministic random generator (SplitMix64, Steele et al. 2014). A seed gives the same integers
/// and uniform numbers on every platform.
class Rng {
 public:
  /// Starts the sequence of `seed`. Each object has a state of its own.
  explicit Rng(std::uint64_t seed = 0) noexcept : state_(seed) {}

  /// Next 64 random bits.
  std::uint64_t next() noexcept {
    state_ += 0x9e3779b97f4a7c15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  /// Uniform in [0, 1).
  double uniform() noexcept { return static_cast<double>(next() >> 11) * 0x1.0p-53; }
  /// Uniform in [low, high).
  double uniform(double low, double high) noexcept { return low + (high - low) * uniform(); }
  /// Uniform integer in [0, n); n > 0.
  std::uint64_t below(std::uint64_t n) noexcept {
    __extension__ using Wide = unsigned __int128;
    return static_cast<std::uint64_t>((static_cast<Wide>(next()) * n) >> 64);
  }
  /// Standard normal number (Box-Muller; each call uses two uniform numbers).
  double normal() noexcept {
    const double u = 1.0 - uniform(), v = uniform();
    return sqrt(-2.0 * ::log(u)) * cos(kTwoPi * v);
  }

 private:
  std::uint64_t state_;
};

}  // namespace gsnav
