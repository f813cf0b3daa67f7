// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace gsnav {

/// Bytes of a huge page: 2 MiB.
inline constexpr std::size_t kHugePage = std::size_t{2} << 20;
/// Bytes of the smallest page of any system.
inline constexpr std::size_t kPage = 4096;

#if defined(__linux__)
namespace detail {
/// Gives the system advice on the whole pages in a memory range.
inline void advise_pages(void* p, std::size_t bytes, std::size_t page, int advice) noexcept {
  const std::uintptr_t at = reinterpret_cast<std::uintptr_t>(p), begin = (at + page - 1) / page * page,
                       end = (at + bytes) / page * page;
  if (end > begin) static_cast<void>(::madvise(reinterpret_cast<void*>(begin), end - begin, advice));
}
}  // namespace detail
#endif

/// Requests huge pages for memory that has not been written yet. A frame reads tens of megabytes; with 4
/// KiB pages, address translation halves the bandwidth, and worse in virtual machines. Has no effect if
/// the system has no huge pages.
inline void advise_huge_pages([[maybe_unused]] void* p, [[maybe_unused]] std::size_t bytes) noexcept {
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  detail::advise_pages(p, bytes, kHugePage, MADV_HUGEPAGE);
#endif
}

/// Returns the whole pages of a memory range to the system. The content is lost; write before you read
/// again.
inline void discard_pages([[maybe_unused]] void* p, [[maybe_unused]] std::size_t bytes) noexcept {
#if defined(__linux__)
  detail::advise_pages(p, bytes, kPage, MADV_DONTNEED);
#endif
}

/// Vector of n values, in huge pages if it is large enough.
template <class T>
std::vector<T> huge_vector(std::size_t n) {
  std::vector<T> v;
  v.reserve(n);
  advise_huge_pages(v.data(), n * sizeof(T));
  v.resize(n);
  return v;
}

/// Empties a vector and frees its memory, which `v = {}` would keep.
template <class T>
void release(std::vector<T>& v) noexcept {
  std::vector<T>().swap(v);
}

/// Converts the first n values of `from` with f, into memory of exactly their size. `from` is returned
/// to the system piece by piece and ends up empty, so that both arrays are never in memory at once.
template <class To, class From, class F>
std::vector<To> moved_through(std::vector<From>& from, std::size_t n, const F& f) {
  constexpr std::size_t kPiece = std::size_t{1} << 22;
  std::vector<To> out;
  out.reserve(n);
  advise_huge_pages(out.data(), n * sizeof(To));
  for (std::size_t first = 0; first < n; first += kPiece) {
    const std::size_t last = n - first < kPiece ? n : first + kPiece;
    out.resize(last);
    for (std::size_t i = first; i < last; ++i) out[i] = f(from[i]);
    discard_pages(from.data() + first, (last - first) * sizeof(From));
  }
  release(from);
  return out;
}

}  // namespace gsnav
