// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace gsnav {

/// Base of a workspace W, which lists its buffers, vectors and inner workspaces once: W::for_each(a, b,
/// f) calls f(a.member, b.member) for each of them.
template <class W>
struct ScratchMemory {
  /// Bytes that the members hold. Vectors are not counted.
  std::size_t capacity_bytes() const noexcept {
    std::size_t sum = 0;
    W::for_each(own(), own(), [&sum](const auto& member, const auto&) {
      if constexpr (requires { member.capacity_bytes(); }) sum += member.capacity_bytes();
    });
    return sum;
  }
  /// Grows the capacity to at least that of `o`, so that a frame that fits either workspace allocates
  /// nothing. The content is lost.
  void grow_to(const W& o) {
    W::for_each(static_cast<W&>(*this), o, [](auto& member, const auto& other) {
      if constexpr (requires { member.grow_to(other); }) {
        member.grow_to(other);
      } else {
        member.reserve(other.capacity());
      }
    });
  }

 private:
  const W& own() const noexcept { return static_cast<const W&>(*this); }
};

}  // namespace gsnav
