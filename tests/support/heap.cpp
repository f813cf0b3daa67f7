// SPDX-License-Identifier: Apache-2.0
// Stands in for the C library's heap and counts who asks. Sanitizers have a heap of their own: nothing
// is replaced.
#include "heap.hpp"

#include <atomic>
#include <cerrno>
#include <cstdlib>

#include "sanitized.hpp"

#if defined(__GLIBC__) && !defined(GSNAV_TEST_SANITIZED)
#define GSNAV_TEST_WATCHES_HEAP
#endif

namespace {
std::atomic<std::size_t> calls{0};
}

namespace gsnav_test {

std::size_t heap_calls() noexcept { return calls.load(); }

bool heap_is_watched() noexcept {
#if defined(GSNAV_TEST_WATCHES_HEAP)
  return true;
#else
  return false;
#endif
}

}  // namespace gsnav_test

#if defined(GSNAV_TEST_WATCHES_HEAP)
extern "C" {

// What glibc's own malloc and its kin are called beside their public names.
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* p, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) noexcept {
  ++calls;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  ++calls;
  return __libc_calloc(count, size);
}
void* realloc(void* p, std::size_t size) noexcept {
  ++calls;
  return __libc_realloc(p, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  ++calls;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++calls;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  ++calls;
  *out = __libc_memalign(alignment, size);
  return *out != nullptr ? 0 : ENOMEM;
}

}  // extern "C"
#endif
