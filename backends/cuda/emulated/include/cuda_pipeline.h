// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>

// Asynchronous copies into shared memory. Here they happen when they are waited for, not before.

namespace gsnav::emulated {
void copy_later(void* to, const void* from, std::size_t bytes);
void finish_copies();
}  // namespace gsnav::emulated

inline void __pipeline_memcpy_async(void* to, const void* from, std::size_t bytes) {
  gsnav::emulated::copy_later(to, from, bytes);
}
inline void __pipeline_commit() {}
inline void __pipeline_wait_prior(unsigned) { gsnav::emulated::finish_copies(); }
