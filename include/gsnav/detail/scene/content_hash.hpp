// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// A 128-bit hash of contents: two chains of SplitMix64's finaliser over 8-byte words. It tells contents
/// apart; it does not protect against forgery.
class Hasher {
 public:
  /// Adds `size` bytes.
  void bytes(const void* data, std::size_t size) noexcept {
    const char* p = static_cast<const char*>(data);
    std::uint64_t w = 0;
    for (; size >= 8; size -= 8, p += 8) {
      std::memcpy(&w, p, 8);
      word(w);
    }
    if (size != 0) {
      w = 0;
      std::memcpy(&w, p, size);
      word(w ^ (static_cast<std::uint64_t>(size) << 56));
    }
  }
  template <class T>
  void value(const T& v) noexcept {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    bytes(&v, sizeof v);
  }
  template <class T>
  void array(const std::vector<T>& v) noexcept {
    value(v.size());
    bytes(v.data(), v.size() * sizeof(T));
  }
  /// Adds a text with its length.
  void text(const std::string& s) noexcept {
    value(s.size());
    bytes(s.data(), s.size());
  }
  /// The hash as 32 hexadecimal digits.
  std::string hex() const {
    char out[40];
    std::snprintf(out, sizeof out, "%016llx%016llx", static_cast<unsigned long long>(state_[0]),
                  static_cast<unsigned long long>(state_[1]));
    return out;
  }
  /// The lower 64 bits of the hash.
  std::uint64_t low() const noexcept { return state_[0]; }
  /// The 128 bits of the hash.
  const std::array<std::uint64_t, 2>& state() const noexcept { return state_; }

 private:
  void word(std::uint64_t w) noexcept {
    for (std::size_t k = 0; k < 2; ++k) {
      std::uint64_t z = (state_[k] ^ w) + 0x9e3779b97f4a7c15ull * (k + 1);
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
      z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
      state_[k] = z ^ (z >> 31);
    }
  }
  std::array<std::uint64_t, 2> state_{0x243f6a8885a308d3ull, 0x13198a2e03707344ull};
};

/// Adds everything in a cloud that an image depends on, except its colours.
inline void hash_shapes(Hasher& h, const GaussianCloud& cloud) {
  for (const auto& v : cloud.means) h.array(v);
  for (const auto& v : cloud.quats) h.array(v);
  for (const auto& v : cloud.scales) h.array(v);
  h.array(cloud.opacities);
  h.array(cloud.origin_ids);
  h.array(cloud.row_ids);
  for (const Vec3d& o : cloud.origins) {
    for (int k = 0; k < 3; ++k) h.value(o[k]);
  }
  h.value(cloud.filter);
  h.value(cloud.eps2d);
  h.value(cloud.sort_order);
}

/// Adds everything in a cloud that an image depends on.
inline void hash_cloud(Hasher& h, const GaussianCloud& cloud) {
  hash_shapes(h, cloud);
  h.array(cloud.sh0);
  h.array(cloud.shN);
  if (cloud.compact()) h.array(cloud.shN_half);
  h.value(cloud.sh_degree);
  // Add the colour space only where it is not the default, so that hashes from before it existed stay
  // valid.
  if (cloud.color_space != ColorSpace::display) h.value(cloud.color_space);
}

/// Hash of everything in a cloud that an image depends on: 32 hexadecimal digits.
inline std::string content_hash(const GaussianCloud& cloud) {
  Hasher h;
  hash_cloud(h, cloud);
  return h.hex();
}

}  // namespace gsnav
