// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/version.hpp"

#if __cplusplus < 202002L
#error "gsnav needs C++20: compile with -std=c++20 or later"
// This header does not exist, so that the compiler stops here instead of listing follow-up errors.
/// Name of a header that does not exist; it stops compilers with a clear message.
#define GSNAV_STOP <gsnav needs -std=c++20 or later>
#include GSNAV_STOP
#endif

/// Marks a function that runs on the host and, under nvcc, on the device. On the host the function is
/// always inlined. Objects compiled for different instruction sets may be linked together, and the
/// linker would keep any one of their out-of-line copies.
#if defined(__CUDACC__)
#define GSNAV_HD __host__ __device__ __forceinline__
#elif defined(__GNUC__)
#define GSNAV_HD inline __attribute__((always_inline))
#else
#define GSNAV_HD inline
#endif

/// Forces a lambda inside a GSNAV_HD function to be inlined. It stands behind the lambda's parameters:
/// `[&](int k) GSNAV_INLINED { ... }`. Inlining a function does not inline its lambdas, and an
/// out-of-line lambda has the same name in the objects of all instruction sets.
#if defined(__GNUC__) && !defined(__CUDACC__)
#define GSNAV_INLINED __attribute__((always_inline))
#else
#define GSNAV_INLINED
#endif

/// 1 while nvcc compiles device code, else 0. SIMD packs exist on the host only.
#if defined(__CUDA_ARCH__)
#define GSNAV_DEVICE_CODE 1
#else
#define GSNAV_DEVICE_CODE 0
#endif
