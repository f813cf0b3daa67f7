// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/detail/core/huge_pages.hpp"

namespace gsnav::io::detail {

/// Backs memory that was not written yet with pages. Several threads do this faster than the first
/// writer alone. If the system cannot, nothing changes.
inline void populate_pages([[maybe_unused]] void* p, [[maybe_unused]] std::size_t bytes) noexcept {
#if defined(__linux__) && defined(MADV_POPULATE_WRITE)
  gsnav::detail::advise_pages(p, bytes, kPage, MADV_POPULATE_WRITE);
#endif
}

}  // namespace gsnav::io::detail
