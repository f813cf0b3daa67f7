// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>  // says which library this is

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace gsnav::io::detail {

/// Gives free memory back to the system where it can be asked to take it: what was read and unpacked on the way to the
/// planes would otherwise stay beside the cloud that is made of them.
inline void release_free_memory() noexcept {
#if defined(__GLIBC__)
  static_cast<void>(::malloc_trim(0));
#endif
}

}  // namespace gsnav::io::detail
