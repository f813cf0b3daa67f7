// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace gsnav_test {

/// True where heap_calls() sees every allocation of the process: glibc, without a sanitizer's own heap.
bool heap_is_watched() noexcept;

/// Calls so far, of all threads, that asked the heap for memory: malloc, calloc, realloc, aligned_alloc
/// and what is built on them (operator new, std::vector, OpenMP's run time).
std::size_t heap_calls() noexcept;

}  // namespace gsnav_test
