// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Small deterministic generator (SplitMix64, Steele et al. 2014): the same seed gives the same
/// numbers on every platform, and every instance is independent of all others.
class Rng {
 public:
  /// Starts the sequence of a seed.
  explicit Rng(std::uint64_t seed = 0) noexcept : state_(seed) {}

  /// The next 64 random bits.
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
  /// Standard normal (Box-Muller, one value a call).
  double normal() noexcept {
    const double u = 1.0 - uniform(), v = uniform();
    return sqrt(-2.0 * ::log(u)) * cos(6.283185307179586 * v);
  }

 private:
  std::uint64_t state_;
};

}  // namespace gsnav
