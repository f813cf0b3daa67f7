// SPDX-License-Identifier: Apache-2.0
#pragma once

#if defined(__CUDACC__)
#error "math/pack.hpp is host code: nvcc has no vector types in device functions"
#endif

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

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
  /// Reads K floats from any address, and repeats them: lane i holds p[i % K].
  template <int K>
  GSNAV_HD static Pack load_repeated(const float* p) noexcept {
    if constexpr (K == N) return load(p);
#if defined(__AVX512F__)
    if constexpr (N == 16 && K == 4) {
      return Pack(reinterpret_cast<vector>(_mm512_maskz_broadcast_f32x4(static_cast<__mmask16>(-1), _mm_loadu_ps(p))));
    }
#endif
#if defined(__AVX__)
    if constexpr (N == 8 && K == 4) {
      return Pack(reinterpret_cast<vector>(_mm256_broadcast_ps(reinterpret_cast<const __m128*>(p))));
    }
#endif
    float lanes[N];
    for (int i = 0; i < N; ++i) lanes[i] = p[i % K];
    return load(lanes);
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
  const auto half = [](__m128d x, __m128d y, __m128d d) {
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
  const auto high = [](__m128 x) { return _mm_cvtps_pd(_mm_movehl_ps(x, x)); };
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
template <Exp2 M = Exp2::degree6, int N>
GSNAV_HD Pack<float, N> exp2_in_range(Pack<float, N> x) noexcept {
  return detail::exp2_by_polynomial<M>(x);
}
/// 2^x, lane by lane the bits of the scalar exp2.
template <Exp2 M = Exp2::degree6, int N>
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

namespace detail {
/// Lane l of the K-th pack of interleaved triples comes from pixel (K N + l) / 3. Step 0 places the first and
/// second of each triple, step 1 the third.
template <int N, int K, int Step>
constexpr int interleaved_lane(int l) noexcept {
  const int pixel = (K * N + l) / 3, component = (K * N + l) % 3;
  if (Step == 0) return component == 1 ? N + pixel : pixel;
  return component == 2 ? N + pixel : l;
}
template <int K, int N, std::size_t... Lane>
GSNAV_HD Pack<float, N> interleaved(Pack<float, N> a, Pack<float, N> b, Pack<float, N> c,
                                    std::index_sequence<Lane...>) noexcept {
  const auto ab = __builtin_shufflevector(a.v, b.v, interleaved_lane<N, K, 0>(static_cast<int>(Lane))...);
  return Pack<float, N>(__builtin_shufflevector(ab, c.v, interleaved_lane<N, K, 1>(static_cast<int>(Lane))...));
}
}  // namespace detail

/// Writes a[0], b[0], c[0], a[1], ...: 3 N floats.
template <int N>
GSNAV_HD void store_interleaved(Pack<float, N> a, Pack<float, N> b, Pack<float, N> c, float* out) noexcept {
  constexpr auto lanes = std::make_index_sequence<static_cast<std::size_t>(N)>{};
  detail::interleaved<0>(a, b, c, lanes).store(out);
  detail::interleaved<1>(a, b, c, lanes).store(out + N);
  detail::interleaved<2>(a, b, c, lanes).store(out + 2 * N);
}

/// Writes first + l for each lane l of `bits`, in order, and returns how many. Up to N bytes from `out` on
/// are overwritten.
template <int N>
GSNAV_HD int store_lane_indices(std::uint32_t bits, int first, std::uint8_t* out) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const __m512i indices = _mm512_add_epi32(lanes, _mm512_set1_epi32(first));
    const __m512i packed = _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), indices);
    const __m128i bytes = _mm512_maskz_cvtepi32_epi8(static_cast<__mmask16>(-1), packed);
    std::memcpy(out, &bytes, sizeof bytes);
    return __builtin_popcount(bits);
  } else
#endif
  {
    int count = 0;
    for (; bits != 0; bits &= bits - 1) out[count++] = static_cast<std::uint8_t>(first + __builtin_ctz(bits));
    return count;
  }
}

/// Writes the lanes of `bits` to consecutive places from `out` on, nothing else, and returns how many.
template <int N>
GSNAV_HD int store_lanes(std::uint32_t bits, const std::uint32_t (&lanes)[N], std::uint32_t* out) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    const int count = __builtin_popcount(bits);
    const __m512i packed = _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), _mm512_loadu_si512(lanes));
    _mm512_mask_storeu_epi32(out, static_cast<__mmask16>((1u << count) - 1u), packed);
    return count;
  } else
#endif
  {
    int count = 0;
    for (; bits != 0; bits &= bits - 1) out[count++] = lanes[__builtin_ctz(bits)];
    return count;
  }
}

namespace detail {
#if defined(__AVX512F__)
/// Transposes the 8 x 8 matrices in the lower and in the upper halves of 8 registers.
GSNAV_HD void transpose_halves(PackTypes<16>::f* r) noexcept {
  using V = PackTypes<16>::f;
  V t[8];
  for (int i = 0; i < 8; i += 2) {
    t[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    t[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
  }
  for (int i = 0; i < 8; i += 4) {
    for (int h = 0; h < 2; ++h) {
      const V a = t[i + h], b = t[i + 2 + h];
      r[i + 2 * h] = __builtin_shufflevector(a, b, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
      r[i + 2 * h + 1] = __builtin_shufflevector(a, b, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
    }
  }
  for (int i = 0; i < 4; ++i) {
    const V a = r[i], b = r[i + 4];
    r[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 16, 17, 18, 19, 8, 9, 10, 11, 24, 25, 26, 27);
    r[i + 4] = __builtin_shufflevector(a, b, 4, 5, 6, 7, 20, 21, 22, 23, 12, 13, 14, 15, 28, 29, 30, 31);
  }
}
#endif
}  // namespace detail

/// Reads K floats from each of N rows (one a lane) as K packs, one a column.
template <int K, int N>
GSNAV_HD void load_columns(const float* const (&rows)[N], Pack<float, N>* columns) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16 && K == 8) {
    // Rows i and i + 8 share a register: then each half is an 8 x 8 transpose.
    typename Pack<float, 16>::vector r[8];
    for (int i = 0; i < 8; ++i) {
      const Pack<float, 8> a = Pack<float, 8>::load(rows[i]), b = Pack<float, 8>::load(rows[i + 8]);
      r[i] = __builtin_shufflevector(a.v, b.v, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    }
    detail::transpose_halves(r);
    for (int k = 0; k < 8; ++k) columns[k].v = r[k];
    return;
  }
#endif
#if defined(__AVX512VL__)
  if constexpr (N == 16 && K == 3) {
    // Rows i, i + 4, i + 8 and i + 12 share a register.
    using V = typename Pack<float, 16>::vector;
    V r[4];
    const auto row = [&rows](int i) noexcept {
      return reinterpret_cast<typename Pack<float, 4>::vector>(_mm_maskz_loadu_ps(0x7, rows[i]));
    };
    for (int i = 0; i < 4; ++i) {
      const auto low = __builtin_shufflevector(row(i), row(i + 4), 0, 1, 2, 3, 4, 5, 6, 7);
      const auto high = __builtin_shufflevector(row(i + 8), row(i + 12), 0, 1, 2, 3, 4, 5, 6, 7);
      r[i] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    }
    const V t0 = __builtin_shufflevector(r[0], r[1], 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    const V t1 = __builtin_shufflevector(r[0], r[1], 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    const V t2 = __builtin_shufflevector(r[2], r[3], 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    const V t3 = __builtin_shufflevector(r[2], r[3], 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    columns[0].v = __builtin_shufflevector(t0, t2, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
    columns[1].v = __builtin_shufflevector(t0, t2, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
    columns[2].v = __builtin_shufflevector(t1, t3, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
    return;
  }
#endif
  for (int k = 0; k < K; ++k) {
    float column[N];
    for (int i = 0; i < N; ++i) column[i] = rows[i][k];
    columns[k] = Pack<float, N>::load(column);
  }
}
/// The same of a row-major matrix.
template <int K, int N>
GSNAV_HD void load_columns(const float* matrix, Pack<float, N>* columns) noexcept {
  const float* rows[N];
  for (int i = 0; i < N; ++i) rows[i] = matrix + K * i;
  load_columns<K>(rows, columns);
}

/// Writes K packs, one a column, as a row-major matrix of N rows (one a lane) and K floats a row.
template <int K, int N>
GSNAV_HD void store_columns(const Pack<float, N>* columns, float* matrix) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16 && K == 8) {
    typename Pack<float, 16>::vector r[8];
    for (int k = 0; k < 8; ++k) r[k] = columns[k].v;
    detail::transpose_halves(r);
    for (int i = 0; i < 8; ++i) {
      Pack<float, 8>(__builtin_shufflevector(r[i], r[i], 0, 1, 2, 3, 4, 5, 6, 7)).store(matrix + 8 * i);
      Pack<float, 8>(__builtin_shufflevector(r[i], r[i], 8, 9, 10, 11, 12, 13, 14, 15)).store(matrix + 8 * (i + 8));
    }
    return;
  }
#endif
#if defined(__AVX512F__)
  if constexpr (N == 16 && K == 4) {
    using V = typename Pack<float, 16>::vector;
    const V a = columns[0].v, b = columns[1].v, c = columns[2].v, d = columns[3].v;
    const V ab0 = __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    const V ab1 = __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    const V cd0 = __builtin_shufflevector(c, d, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    const V cd1 = __builtin_shufflevector(c, d, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    // Rows 0, 4, 8 and 12; 1, 5, ...; four floats each.
    const V r[4] = {__builtin_shufflevector(ab0, cd0, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29),
                    __builtin_shufflevector(ab0, cd0, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31),
                    __builtin_shufflevector(ab1, cd1, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29),
                    __builtin_shufflevector(ab1, cd1, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31)};
    for (int i = 0; i < 4; ++i) {
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 0, 1, 2, 3)).store(matrix + 4 * i);
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 4, 5, 6, 7)).store(matrix + 4 * (i + 4));
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 8, 9, 10, 11)).store(matrix + 4 * (i + 8));
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 12, 13, 14, 15)).store(matrix + 4 * (i + 12));
    }
    return;
  }
#endif
  for (int k = 0; k < K; ++k) {
    for (int i = 0; i < N; ++i) matrix[K * i + k] = columns[k][i];
  }
}

}  // namespace gsnav
