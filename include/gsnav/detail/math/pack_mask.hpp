// SPDX-License-Identifier: Apache-2.0
#pragma once

#if defined(__CUDACC__)
#error "detail/math/pack_mask.hpp is host code: nvcc has no vector types in device functions"
#endif

#include <cstdint>

#if defined(__AVX512F__)
#include <immintrin.h>
#endif

#include "gsnav/math/functions.hpp"

// Vector types of SIMD lanes, and the mask that a comparison of two of them returns.

namespace gsnav {

namespace detail {

// g++ 12 rejects a vector_size that depends on a template parameter, so each width is written out.
template <int N>
struct PackTypes;
template <>
struct PackTypes<4> {
  typedef float f __attribute__((vector_size(16)));
  typedef std::int32_t i __attribute__((vector_size(16)));
  typedef std::uint32_t u __attribute__((vector_size(16)));
};
template <>
struct PackTypes<8> {
  typedef float f __attribute__((vector_size(32)));
  typedef std::int32_t i __attribute__((vector_size(32)));
  typedef std::uint32_t u __attribute__((vector_size(32)));
};
template <>
struct PackTypes<16> {
  typedef float f __attribute__((vector_size(64)));
  typedef std::int32_t i __attribute__((vector_size(64)));
  typedef std::uint32_t u __attribute__((vector_size(64)));
};

}  // namespace detail

/// Result of comparing packs: a lane has all bits set, or none.
template <int N>
struct Mask {
  using vector = typename detail::PackTypes<N>::i;
  vector v{};

  GSNAV_HD Mask() noexcept = default;
  GSNAV_HD explicit Mask(bool b) noexcept : v(vector{} - static_cast<std::int32_t>(b)) {}
  GSNAV_HD explicit Mask(vector x) noexcept : v(x) {}

  GSNAV_HD friend Mask operator&&(Mask a, Mask b) noexcept { return Mask(a.v & b.v); }
  GSNAV_HD friend Mask operator||(Mask a, Mask b) noexcept { return Mask(a.v | b.v); }
  GSNAV_HD friend Mask operator!(Mask a) noexcept { return Mask(~a.v); }
};

#if defined(__AVX512F__)
/// AVX-512 masks are registers with one bit per lane. g++ does not optimise the vector form to them.
template <>
struct Mask<16> {
  __mmask16 v = 0;

  GSNAV_HD Mask() noexcept = default;
  GSNAV_HD explicit Mask(bool b) noexcept : v(static_cast<__mmask16>(b ? 0xffff : 0)) {}
  GSNAV_HD static Mask of(__mmask16 m) noexcept {
    Mask r;
    r.v = m;
    return r;
  }
  // Use the mask intrinsics: with plain operators, g++ moves masks to general registers and back.
  GSNAV_HD friend Mask operator&&(Mask a, Mask b) noexcept { return of(_kand_mask16(a.v, b.v)); }
  GSNAV_HD friend Mask operator||(Mask a, Mask b) noexcept { return of(_kor_mask16(a.v, b.v)); }
  GSNAV_HD friend Mask operator!(Mask a) noexcept { return of(_knot_mask16(a.v)); }
};
#endif

namespace detail {
enum class Compare { less, less_equal };
template <int N, Compare C>
GSNAV_HD Mask<N> compare(typename PackTypes<N>::f a, typename PackTypes<N>::f b) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return Mask<16>::of(_mm512_cmp_ps_mask(reinterpret_cast<__m512>(a), reinterpret_cast<__m512>(b),
                                           C == Compare::less ? _CMP_LT_OQ : _CMP_LE_OQ));
  } else
#endif
  {
    return C == Compare::less ? Mask<N>(a < b) : Mask<N>(a <= b);
  }
}
}  // namespace detail

}  // namespace gsnav
