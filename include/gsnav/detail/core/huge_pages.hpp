// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace gsnav {

/// Size of the pages that large arrays are best kept in.
inline constexpr std::size_t kHugePage = std::size_t{2} << 20;

/// Asks for huge pages in memory that has not been written yet. Rendering walks tens of megabytes a
/// frame: by pages of 4 KiB, and more so in a virtual machine, looking addresses up halves the bandwidth
/// and worse. Where the system has none to give, nothing changes.
inline void advise_huge_pages([[maybe_unused]] void* p, [[maybe_unused]] std::size_t bytes) noexcept {
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  const std::uintptr_t begin =
      (reinterpret_cast<std::uintptr_t>(p) + kHugePage - 1) / kHugePage * kHugePage;
  const std::uintptr_t end = (reinterpret_cast<std::uintptr_t>(p) + bytes) / kHugePage * kHugePage;
  if (end > begin)
    static_cast<void>(::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE));
#endif
}

/// Gives the system back the whole pages of memory that is not read again before it is written; what was
/// there is lost.
inline void discard_pages([[maybe_unused]] void* p, [[maybe_unused]] std::size_t bytes) noexcept {
#if defined(__linux__)
  constexpr std::uintptr_t kPage = 4096;
  const std::uintptr_t begin = (reinterpret_cast<std::uintptr_t>(p) + kPage - 1) / kPage * kPage;
  const std::uintptr_t end = (reinterpret_cast<std::uintptr_t>(p) + bytes) / kPage * kPage;
  if (end > begin)
    static_cast<void>(::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED));
#endif
}

/// n values in huge pages where there are enough of them.
template <class T>
std::vector<T> huge_vector(std::size_t n) {
  std::vector<T> v;
  v.reserve(n);
  advise_huge_pages(v.data(), n * sizeof(T));
  v.resize(n);
  return v;
}

/// Empties a vector and gives its memory back; `v = {}` would keep it.
template <class T>
void release(std::vector<T>& v) noexcept {
  std::vector<T>().swap(v);
}

/// The first n values of `from`, each through f, in memory of just their size. That of `from`, which is
/// empty then, goes back to the system on the way: what both take is never there at once.
template <class To, class From, class F>
std::vector<To> moved_through(std::vector<From>& from, std::size_t n, const F& f) {
  constexpr std::size_t kPiece = std::size_t{1} << 22;
  std::vector<To> out;
  out.reserve(n);
  advise_huge_pages(out.data(), n * sizeof(To));
  for (std::size_t first = 0; first < n; first += kPiece) {
    const std::size_t last = std::min(n, first + kPiece);
    out.resize(last);
    for (std::size_t i = first; i < last; ++i) out[i] = f(from[i]);
    discard_pages(from.data() + first, (last - first) * sizeof(From));
  }
  release(from);
  return out;
}

}  // namespace gsnav
