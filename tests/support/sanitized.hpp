// SPDX-License-Identifier: Apache-2.0
#pragma once

// GSNAV_TEST_SANITIZED is defined where a sanitizer has replaced the heap; g++ and clang say so
// differently.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(memory_sanitizer) || \
    __has_feature(thread_sanitizer)
#define GSNAV_TEST_SANITIZED
#endif
#endif
#if !defined(GSNAV_TEST_SANITIZED) && (defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__))
#define GSNAV_TEST_SANITIZED
#endif

namespace gsnav_test {

#if defined(GSNAV_TEST_SANITIZED)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace gsnav_test
