// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/version.hpp"

#if __cplusplus < 202002L
#error "gsnav needs C++20: compile with -std=c++20 or later"
// A header that does not exist: compilers stop here, before the errors that would follow from it.
/// Name of a header that does not exist; it stops compilers with a clear message.
#define GSNAV_STOP <gsnav needs -std=c++20 or later>
#include GSNAV_STOP
#endif

/// GSNAV_HD marks a function that runs on the host and, under nvcc, on the device.
/// On the host it is always inlined: objects compiled for different instruction sets may be linked
/// together, and an out-of-line copy of a shared inline function would be picked from any of them.
#if defined(__CUDACC__)
#define GSNAV_HD __host__ __device__ __forceinline__
#elif defined(__GNUC__)
#define GSNAV_HD inline __attribute__((always_inline))
#else
#define GSNAV_HD inline
#endif

/// GSNAV_INLINED stands behind the parameters of a lambda in such a function: `[&](int k) GSNAV_INLINED
/// { ... }`. Inlining the function does not inline its lambdas, and an out-of-line lambda has one name
/// for all instruction sets.
#if defined(__GNUC__) && !defined(__CUDACC__)
#define GSNAV_INLINED __attribute__((always_inline))
#else
#define GSNAV_INLINED
#endif

/// True while nvcc compiles device code. Lane packs (SIMD) exist on the host only.
#if defined(__CUDA_ARCH__)
#define GSNAV_DEVICE_CODE 1
#else
#define GSNAV_DEVICE_CODE 0
#endif
