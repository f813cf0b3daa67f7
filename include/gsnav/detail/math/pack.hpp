// SPDX-License-Identifier: Apache-2.0
#pragma once

#if defined(__CUDACC__)
#error "detail/math/pack.hpp is host code: nvcc has no vector types in device functions"
#endif

#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "gsnav/math/functions.hpp"

// Float lanes over the compilers' vector extension: the functions of math/functions.hpp with the same
// bits per lane. Kernels are written over `L` and run on a Pack where pixels or Gaussians go side by
// side. Where the instruction set has no fma, one is computed with correct rounding.

/// Lanes that the flags of this translation unit make natural.
#if defined(__AVX512F__)
#define GSNAV_PACK_WIDTH 16
#elif defined(__AVX2__)
#define GSNAV_PACK_WIDTH 8
#else
#define GSNAV_PACK_WIDTH 4
#endif

namespace gsnav {

namespace detail {

// g++ 12 rejects a vector_size that depends on a template parameter, so widths are spelled out.
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

/// Comparison result of a Pack: all bits of a lane set, or none.
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
/// With AVX-512 a mask is a register of one bit a lane; g++ does not see through the vector form.
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
  // By name, or g++ moves masks to general registers and back.
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

/// N floats that are computed with together.
template <class T, int N>
struct Pack;
/// N doubles: detail/math/pack_double.hpp.
template <int N>
struct PackPair;

template <int N>
struct Pack<float, N> {
  using vector = typename detail::PackTypes<N>::f;
  using ints = typename detail::PackTypes<N>::i;
  vector v{};

  GSNAV_HD Pack() noexcept = default;
  // s - 0 is s for every s, -0 included, so this is a plain broadcast.
  GSNAV_HD Pack(float s) noexcept : v(s - vector{}) {}
  GSNAV_HD explicit Pack(vector x) noexcept : v(x) {}

  /// Reads N floats from any address.
  GSNAV_HD static Pack load(const float* p) noexcept {
    Pack r;
    std::memcpy(&r.v, p, sizeof r.v);
    return r;
  }
  GSNAV_HD void store(float* p) const noexcept { std::memcpy(p, &v, sizeof v); }
  GSNAV_HD float operator[](int i) const noexcept { return v[i]; }

  GSNAV_HD friend Pack operator+(Pack a, Pack b) noexcept { return Pack(a.v + b.v); }
  GSNAV_HD friend Pack operator-(Pack a, Pack b) noexcept { return Pack(a.v - b.v); }
  GSNAV_HD friend Pack operator*(Pack a, Pack b) noexcept { return Pack(a.v * b.v); }
  GSNAV_HD friend Pack operator/(Pack a, Pack b) noexcept { return Pack(a.v / b.v); }
  GSNAV_HD friend Pack operator-(Pack a) noexcept { return Pack(-a.v); }
  GSNAV_HD friend Mask<N> operator<(Pack a, Pack b) noexcept {
    return detail::compare<N, detail::Compare::less>(a.v, b.v);
  }
  GSNAV_HD friend Mask<N> operator<=(Pack a, Pack b) noexcept {
    return detail::compare<N, detail::Compare::less_equal>(a.v, b.v);
  }
  GSNAV_HD friend Mask<N> operator>(Pack a, Pack b) noexcept { return b < a; }
  GSNAV_HD friend Mask<N> operator>=(Pack a, Pack b) noexcept { return b <= a; }
};

template <int N>
struct LaneTraits<Pack<float, N>> {
  using scalar = float;
  using mask = Mask<N>;
  using doubles = PackPair<N>;
  static constexpr int width = N;
};

template <int N>
GSNAV_HD Pack<float, N> select(Mask<N> m, Pack<float, N> a, Pack<float, N> b) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(
        _mm512_mask_blend_ps(m.v, reinterpret_cast<__m512>(b.v), reinterpret_cast<__m512>(a.v))));
  } else
#endif
  {
    return Pack<float, N>(m.v ? a.v : b.v);
  }
}
template <int N>
GSNAV_HD Pack<float, N> min(Pack<float, N> a, Pack<float, N> b) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {  // g++ does not make one instruction of the two
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(_mm512_maskz_min_ps(
        static_cast<__mmask16>(-1), reinterpret_cast<__m512>(a.v), reinterpret_cast<__m512>(b.v))));
  } else
#endif
  {
    return select(a < b, a, b);
  }
}
template <int N>
GSNAV_HD Pack<float, N> max(Pack<float, N> a, Pack<float, N> b) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(_mm512_maskz_max_ps(
        static_cast<__mmask16>(-1), reinterpret_cast<__m512>(a.v), reinterpret_cast<__m512>(b.v))));
  } else
#endif
  {
    return select(a > b, a, b);
  }
}
template <int N>
GSNAV_HD Pack<float, N> clamp(Pack<float, N> v, Pack<float, N> low, Pack<float, N> high) noexcept {
  return min(max(v, low), high);
}

namespace detail {
template <int N>
GSNAV_HD typename PackTypes<N>::i bits(typename PackTypes<N>::f x) noexcept {
  typename PackTypes<N>::i r;
  std::memcpy(&r, &x, sizeof r);
  return r;
}
template <int N>
GSNAV_HD typename PackTypes<N>::f floats(typename PackTypes<N>::i x) noexcept {
  typename PackTypes<N>::f r;
  std::memcpy(&r, &x, sizeof r);
  return r;
}
}  // namespace detail

template <int N>
GSNAV_HD Pack<float, N> abs(Pack<float, N> a) noexcept {
  return Pack<float, N>(detail::floats<N>(detail::bits<N>(a.v) & 0x7fffffff));
}

template <int N>
GSNAV_HD Pack<float, N> truncated(Pack<float, N> a) noexcept {
  using P = Pack<float, N>;
  return P(__builtin_convertvector(__builtin_convertvector(a.v, typename P::ints), typename P::vector));
}

/// Bit i is set where lane i is.
template <int N>
GSNAV_HD std::uint32_t lane_bits(Mask<N> m) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return m.v;
  } else
#endif
#if defined(__AVX__)
      if constexpr (N == 8) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(m.v)));
  } else
#endif
#if defined(__SSE2__)
      if constexpr (N == 4) {
    return static_cast<std::uint32_t>(_mm_movemask_ps(reinterpret_cast<__m128>(m.v)));
  } else
#endif
  {
    std::uint32_t r = 0;
    for (int i = 0; i < N; ++i) r |= static_cast<std::uint32_t>(m.v[i] & 1) << i;
    return r;
  }
}
template <int N>
GSNAV_HD bool any(Mask<N> m) noexcept {
#if defined(__AVX512DQ__)
  if constexpr (N == 16) {
    return _kortestz_mask16_u8(m.v, m.v) == 0;
  } else
#endif
  {
    return lane_bits(m) != 0;
  }
}
template <int N>
GSNAV_HD bool all(Mask<N> m) noexcept {
  return lane_bits(m) == (N == 32 ? ~0u : (1u << N) - 1u);
}

/// Square root, correctly rounded.
template <int N>
GSNAV_HD Pack<float, N> sqrt(Pack<float, N> a) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(
        _mm512_maskz_sqrt_ps(static_cast<__mmask16>(-1), reinterpret_cast<__m512>(a.v))));
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 8) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(
        _mm256_sqrt_ps(reinterpret_cast<__m256>(a.v))));
  }
#endif
#if defined(__SSE2__)
  if constexpr (N == 4) {
    return Pack<float, N>(
        reinterpret_cast<typename Pack<float, N>::vector>(_mm_sqrt_ps(reinterpret_cast<__m128>(a.v))));
  }
#endif
  Pack<float, N> r;
  for (int i = 0; i < N; ++i) r.v[i] = __builtin_sqrtf(a.v[i]);
  return r;
}

template <int N>
GSNAV_HD Pack<float, N> sqrt_above(Pack<float, N> a) noexcept {
  using V = typename Pack<float, N>::vector;
  const Pack<float, N> positive = max(a, Pack<float, N>(1e-30f));
#if defined(__AVX512F__)
  if constexpr (N == 16) {  // 2^-14
    const Pack<float, N> r(reinterpret_cast<V>(
        _mm512_maskz_rsqrt14_ps(static_cast<__mmask16>(-1), reinterpret_cast<__m512>(positive.v))));
    return positive * (r * Pack<float, N>(1.0001f));
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 8) {  // 1.5 * 2^-12
    return positive *
           (Pack<float, N>(reinterpret_cast<V>(_mm256_rsqrt_ps(reinterpret_cast<__m256>(positive.v)))) *
            Pack<float, N>(1.0004f));
  }
#endif
#if defined(__SSE2__)
  if constexpr (N == 4) {
    return positive *
           (Pack<float, N>(reinterpret_cast<V>(_mm_rsqrt_ps(reinterpret_cast<__m128>(positive.v)))) *
            Pack<float, N>(1.0004f));
  }
#endif
  return sqrt(a);
}

namespace detail {

/// fma by way of double: the product is exact there, the sum is rounded to odd, and rounding that to
/// float gives the correctly rounded result (Boldo and Melquiond 2008).
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
/// The same for two lanes at once.
GSNAV_HD __m128 fma_by_double(__m128 a, __m128 b, __m128 c) noexcept {
  const auto half = [](__m128d x, __m128d y, __m128d d) GSNAV_INLINED {
    const __m128d p = _mm_mul_pd(x, y), s = _mm_add_pd(p, d), t = _mm_sub_pd(s, p);
    const __m128d error = _mm_add_pd(_mm_sub_pd(p, _mm_sub_pd(s, t)), _mm_sub_pd(d, t));
    const __m128d zero = _mm_setzero_pd();
    const __m128i u = _mm_castpd_si128(s), one = _mm_set1_epi64x(1);
    const __m128d inexact = _mm_or_pd(_mm_cmplt_pd(error, zero), _mm_cmpgt_pd(error, zero));
    // All ones where the last bit is 0: subtracting 1 from that bit alone.
    const __m128i even = _mm_sub_epi64(_mm_and_si128(u, one), one);
    const __m128d same_sign = _mm_cmpge_pd(
        _mm_mul_pd(_mm_or_pd(_mm_and_pd(error, _mm_set1_pd(-0.0)), _mm_set1_pd(1.0)), s), zero);
    // +1 where error and sum point the same way, else -1.
    const __m128i move =
        _mm_or_si128(_mm_andnot_si128(_mm_castpd_si128(same_sign), _mm_set1_epi64x(-1)), one);
    const __m128i apply = _mm_and_si128(_mm_castpd_si128(inexact), even);
    return _mm_castsi128_pd(_mm_add_epi64(u, _mm_and_si128(move, apply)));
  };
  const auto high = [](__m128 x) GSNAV_INLINED { return _mm_cvtps_pd(_mm_movehl_ps(x, x)); };
  const __m128 low = _mm_cvtpd_ps(half(_mm_cvtps_pd(a), _mm_cvtps_pd(b), _mm_cvtps_pd(c)));
  return _mm_movelh_ps(low, _mm_cvtpd_ps(half(high(a), high(b), high(c))));
}
#endif

}  // namespace detail

/// a * b + c with one rounding.
template <int N>
GSNAV_HD Pack<float, N> fma(Pack<float, N> a, Pack<float, N> b, Pack<float, N> c) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(_mm512_fmadd_ps(
        reinterpret_cast<__m512>(a.v), reinterpret_cast<__m512>(b.v), reinterpret_cast<__m512>(c.v))));
  }
#endif
#if defined(__FMA__)
  if constexpr (N == 8) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(_mm256_fmadd_ps(
        reinterpret_cast<__m256>(a.v), reinterpret_cast<__m256>(b.v), reinterpret_cast<__m256>(c.v))));
  }
  if constexpr (N == 4) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(_mm_fmadd_ps(
        reinterpret_cast<__m128>(a.v), reinterpret_cast<__m128>(b.v), reinterpret_cast<__m128>(c.v))));
  }
#endif
#if defined(__SSE2__) && !defined(__FMA__)
  if constexpr (N == 4) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(detail::fma_by_double(
        reinterpret_cast<__m128>(a.v), reinterpret_cast<__m128>(b.v), reinterpret_cast<__m128>(c.v))));
  }
#endif
  Pack<float, N> r;
  for (int i = 0; i < N; ++i) r.v[i] = __builtin_fmaf(a.v[i], b.v[i], c.v[i]);
  return r;
}

template <int N>
GSNAV_HD Pack<float, N> scale_by_rounded(Pack<float, N> p, Pack<float, N> t) noexcept {
  // Without a sign: lanes that nobody will read may hold anything, and their sums wrap.
  typename detail::PackTypes<N>::u a, b;
  std::memcpy(&a, &p.v, sizeof a);
  std::memcpy(&b, &t.v, sizeof b);
  a += b << 23;
  Pack<float, N> r;
  std::memcpy(&r.v, &a, sizeof a);
  return r;
}

/// 2^x for x in [-126, 126], lane by lane the bits of the scalar exp2; of any other x: anything.
template <Exp2 M = Exp2::degree5, int N>
GSNAV_HD Pack<float, N> exp2_in_range(Pack<float, N> x) noexcept {
  return detail::exp2_by_polynomial<M>(x);
}
/// 2^x, lane by lane the bits of the scalar exp2.
template <Exp2 M = Exp2::degree5, int N>
GSNAV_HD Pack<float, N> exp2(Pack<float, N> x) noexcept {
  return exp2_in_range<M>(clamp(x, Pack<float, N>(-126.0f), Pack<float, N>(126.0f)));
}

/// log2(x), lane by lane the bits of the scalar log2.
template <int N>
GSNAV_HD Pack<float, N> log2(Pack<float, N> x) noexcept {
  using P = Pack<float, N>;
  const auto u = detail::bits<N>(x.v);
  const auto e = (u - 0x3f3504f3) >> 23;
  const P m(detail::floats<N>(u - (e << 23)));
  const P t = (m - P(1.0f)) / (m + P(1.0f));
  P exponent;
  exponent.v = __builtin_convertvector(e, typename P::vector);
  return detail::log2_from_ratio(t, exponent);
}

}  // namespace gsnav
