// SPDX-License-Identifier: Apache-2.0
#include "gsnav/sim/basic_simulator.hpp"

#include <string_view>

#include "gsnav/detail/math/angles.hpp"

namespace gsnav {
namespace {

/// FNV-1a hash. Unlike std::hash, it is the same on every platform.
std::uint64_t hash(std::string_view text, std::uint64_t h) noexcept {
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  return h;
}
constexpr std::uint64_t kBasis = 0xcbf29ce484222325ull;

}  // namespace

std::uint64_t noise_seed(std::uint64_t seed, const WorldState& state) noexcept {
  Rng rng(hash(state.episode.id, kBasis) ^ Rng(seed).next());
  return rng.next() + static_cast<std::uint64_t>(state.steps) * 0xd1342543de82ef95ull;
}

Quatd goal_rotation(const PointNavEpisode& episode) noexcept {
  return yaw_rotation(Rng(hash(episode.id, kBasis)).uniform(0.0, kTwoPi));
}

}  // namespace gsnav
