// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/math/pack_columns.hpp"

// SIMD code is compiled once per instruction set and selected at run time. All its functions are in a
// namespace named after the set, so that a linker cannot mix them up. Header-only use has other names,
// so that it can be linked together with the compiled component.
#if defined(GSNAV_OPENMP_HEADER_ONLY)
#define GSNAV_LANES_NAMESPACE(set) header_only_##set
#else
#define GSNAV_LANES_NAMESPACE(set) set
#endif
#if defined(__AVX512F__)
#define GSNAV_LANES_TAG GSNAV_LANES_NAMESPACE(avx512)
#elif defined(__AVX2__)
#define GSNAV_LANES_TAG GSNAV_LANES_NAMESPACE(avx2)
#elif defined(__aarch64__)
#define GSNAV_LANES_TAG GSNAV_LANES_NAMESPACE(neon)
#else
#define GSNAV_LANES_TAG GSNAV_LANES_NAMESPACE(baseline)
#endif

/// Marks a stage of a SIMD kernel, which is called and not inlined. A compiler that sees several stages
/// as one function spills their registers. Functions that a stage calls are inlined (GSNAV_HD).
#define GSNAV_STAGE [[gnu::noinline]] inline

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

inline constexpr int kWidth = GSNAV_PACK_WIDTH;
using F = Pack<float, kWidth>;

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
