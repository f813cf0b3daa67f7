// SPDX-License-Identifier: Apache-2.0
#pragma once

#if defined(__CUDACC__)
#error "detail/math/pack_fma.hpp is host code: nvcc has no vector types in device functions"
#endif

#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "gsnav/config.hpp"

namespace gsnav {

namespace detail {

/// Correctly rounded float fma, computed in double. The product is exact in double, and the sum is
/// rounded to odd. Rounding that sum to float gives the correctly rounded result (Boldo and Melquiond
/// 2008).
GSNAV_HD float fma_by_double(float a, float b, float c) noexcept {
  const double p = static_cast<double>(a) * static_cast<double>(b), d = static_cast<double>(c);
  double s = p + d;
  const double t = s - p;
  const double error = (p - (s - t)) + (d - t);
  std::uint64_t u;
  std::memcpy(&u, &s, sizeof u);
  if ((error > 0 || error < 0) && (u & 1) == 0) {
    u = (error > 0) == (s > 0) ? u + 1 : u - 1;
    std::memcpy(&s, &u, sizeof s);
  }
  return static_cast<float>(s);
}

#if defined(__SSE2__) && !defined(__FMA__)
/// Sum p + d in double, rounded to odd.
GSNAV_HD __m128d sum_to_odd(__m128d p, __m128d d) noexcept {
  const __m128d s = _mm_add_pd(p, d), t = _mm_sub_pd(s, p);
  const __m128d error = _mm_add_pd(_mm_sub_pd(p, _mm_sub_pd(s, t)), _mm_sub_pd(d, t));
  const __m128d zero = _mm_setzero_pd();
  const __m128i u = _mm_castpd_si128(s), one = _mm_set1_epi64x(1);
  const __m128d inexact = _mm_or_pd(_mm_cmplt_pd(error, zero), _mm_cmpgt_pd(error, zero));
  // All bits set where the last bit of the sum is 0, else 0.
  const __m128i even = _mm_sub_epi64(_mm_and_si128(u, one), one);
  const __m128d same_sign = _mm_cmpge_pd(
      _mm_mul_pd(_mm_or_pd(_mm_and_pd(error, _mm_set1_pd(-0.0)), _mm_set1_pd(1.0)), s), zero);
  // +1 where error and sum have the same sign, else -1.
  const __m128i move =
      _mm_or_si128(_mm_andnot_si128(_mm_castpd_si128(same_sign), _mm_set1_epi64x(-1)), one);
  const __m128i apply = _mm_and_si128(_mm_castpd_si128(inexact), even);
  return _mm_castsi128_pd(_mm_add_epi64(u, _mm_and_si128(move, apply)));
}

/// True if rounding some of these doubles to float may differ from rounding the exact value once. That
/// happens halfway between two floats (the last 29 bits are 1 0...0). It also happens below the normal
/// floats except at 0, where the halfway points are elsewhere.
GSNAV_HD bool may_round_twice(__m128d low, __m128d high) noexcept {
  const __m128 a = _mm_castpd_ps(low), b = _mm_castpd_ps(high);
  const __m128i last = _mm_castps_si128(_mm_shuffle_ps(a, b, _MM_SHUFFLE(2, 0, 2, 0)));
  const __m128i first = _mm_castps_si128(_mm_shuffle_ps(a, b, _MM_SHUFFLE(3, 1, 3, 1)));
  const __m128i middle =
      _mm_cmpeq_epi32(_mm_and_si128(last, _mm_set1_epi32(0x1fffffff)), _mm_set1_epi32(0x10000000));
  const __m128i magnitude = _mm_and_si128(first, _mm_set1_epi32(0x7fffffff));
  const __m128i small = _mm_and_si128(_mm_cmpgt_epi32(_mm_set1_epi32(0x38100000), magnitude),
                                      _mm_cmpgt_epi32(magnitude, _mm_setzero_si128()));
  return _mm_movemask_ps(_mm_castsi128_ps(_mm_or_si128(middle, small))) != 0;
}

/// Correctly rounded fma of four lanes, computed in double. Rounding a sum to double and then to float
/// equals rounding once, except in the cases of may_round_twice. There the sum is rounded to odd.
GSNAV_HD __m128 fma_by_double(__m128 a, __m128 b, __m128 c) noexcept {
  const auto high = [](__m128 x) GSNAV_INLINED { return _mm_cvtps_pd(_mm_movehl_ps(x, x)); };
  const __m128d p0 = _mm_mul_pd(_mm_cvtps_pd(a), _mm_cvtps_pd(b)), d0 = _mm_cvtps_pd(c);
  const __m128d p1 = _mm_mul_pd(high(a), high(b)), d1 = high(c);
  __m128d s0 = _mm_add_pd(p0, d0), s1 = _mm_add_pd(p1, d1);
  if (may_round_twice(s0, s1)) [[unlikely]] {
    s0 = sum_to_odd(p0, d0);
    s1 = sum_to_odd(p1, d1);
  }
  return _mm_movelh_ps(_mm_cvtpd_ps(s0), _mm_cvtpd_ps(s1));
}
#endif

}  // namespace detail

}  // namespace gsnav
