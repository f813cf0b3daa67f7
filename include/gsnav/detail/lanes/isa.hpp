// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/math/pack_layout.hpp"

// Code over lanes is compiled once per instruction set and chosen at run time, so every function of it
// lives in a namespace named after the set: no linker can mix two of them up. Header-only use has names
// of its own, so that it can be linked with the compiled component.
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

/// A stage of a kernel over lanes. It is called, not inlined: a compiler that sees several stages as one
/// function spills the registers of each. What a stage calls is inlined (GSNAV_HD).
#define GSNAV_STAGE [[gnu::noinline]] inline

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

inline constexpr int kWidth = GSNAV_PACK_WIDTH;
using F = Pack<float, kWidth>;

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
