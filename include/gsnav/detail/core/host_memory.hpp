// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdlib>
#include <cstring>

#include "gsnav/core/backend.hpp"
#include "gsnav/detail/core/huge_pages.hpp"

namespace gsnav {

/// Memory functions of a backend that works in host memory. Large arrays lie in huge pages.
struct HostMemory {
  using memory_space = HostSpace;

  void* allocate(std::size_t bytes, std::size_t align) noexcept {
    const std::size_t fit = bytes >= 2 * kHugePage && align < kHugePage ? kHugePage : align;
    void* p = std::aligned_alloc(fit, (bytes + fit - 1) / fit * fit);
    if (p != nullptr && fit == kHugePage) advise_huge_pages(p, bytes);
    return p;
  }
  void deallocate(void* p, std::size_t) noexcept { std::free(p); }
  void copy(void* dst, const void* src, std::size_t bytes, CopyKind) noexcept {
    std::memcpy(dst, src, bytes);
  }
  void fill(void* p, unsigned char byte, std::size_t bytes) noexcept { std::memset(p, byte, bytes); }
};

}  // namespace gsnav
