// SPDX-License-Identifier: Apache-2.0
#pragma once

#if defined(__CUDACC__)
#error "detail/math/pack.hpp is host code: nvcc has no vector types in device functions"
#endif

#include <cstdint>
#include <cstring>

#if defined(__AVX__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

#include "gsnav/detail/math/pack_fma.hpp"
#include "gsnav/detail/math/pack_mask.hpp"
#include "gsnav/math/functions.hpp"

// SIMD packs of floats, built on the compilers' vector extension. They have the functions of
// math/functions.hpp, with the same bits per lane. Kernels are templates over `L` and run on a Pack
// where several pixels or Gaussians are processed together. On instruction sets without fma, one with
// correct rounding is computed.

/// Natural number of float lanes for the flags of this translation unit.
#if defined(__AVX512F__)
#define GSNAV_PACK_WIDTH 16
#elif defined(__AVX2__)
#define GSNAV_PACK_WIDTH 8
#else
#define GSNAV_PACK_WIDTH 4
#endif

namespace gsnav {

/// N floats that are processed together.
template <class T, int N>
struct Pack;
/// N doubles that are processed together (detail/math/pack_double.hpp).
template <int N>
struct PackPair;

namespace detail {
/// Arithmetic of a pack P, whatever its scalar.
template <class P>
struct PackArithmetic {
  GSNAV_HD friend P operator+(P a, P b) noexcept { return P(a.v + b.v); }
  GSNAV_HD friend P operator-(P a, P b) noexcept { return P(a.v - b.v); }
  GSNAV_HD friend P operator*(P a, P b) noexcept { return P(a.v * b.v); }
  GSNAV_HD friend P operator/(P a, P b) noexcept { return P(a.v / b.v); }
  GSNAV_HD friend P operator-(P a) noexcept { return P(-a.v); }
  GSNAV_HD friend P clamp(P a, P low, P high) noexcept { return min(max(a, low), high); }
  /// Rounds towards zero; values that an int32 holds.
  GSNAV_HD friend P truncated(P a) noexcept {
    return P(
        __builtin_convertvector(__builtin_convertvector(a.v, typename P::ints), typename P::vector));
  }
};
}  // namespace detail

template <int N>
struct Pack<float, N> : detail::PackArithmetic<Pack<float, N>> {
  using vector = typename detail::PackTypes<N>::f;
  using ints = typename detail::PackTypes<N>::i;
  vector v{};

  GSNAV_HD Pack() noexcept = default;
  // s - 0 is s for every s, also for -0, so this is a plain broadcast.
  GSNAV_HD Pack(float s) noexcept : v(s - vector{}) {}
  GSNAV_HD explicit Pack(vector x) noexcept : v(x) {}

  /// Reads N floats from any address, aligned or not.
  GSNAV_HD static Pack load(const float* p) noexcept {
    Pack r;
    std::memcpy(&r.v, p, sizeof r.v);
    return r;
  }
  GSNAV_HD void store(float* p) const noexcept { std::memcpy(p, &v, sizeof v); }
  GSNAV_HD float operator[](int i) const noexcept { return v[i]; }

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
  if constexpr (N == 16) {  // g++ does not fuse comparison and selection into one instruction
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

/// Mask as bits: bit i is set if lane i is set.
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
#elif defined(__aarch64__)
  if constexpr (N == 4) {
    constexpr typename detail::PackTypes<4>::u kBit{1, 2, 4, 8};
    return vaddvq_u32(reinterpret_cast<uint32x4_t>(m.v & reinterpret_cast<decltype(m.v)>(kBit)));
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
#if defined(__aarch64__)
      if constexpr (N == 4) {
    return vmaxvq_u32(reinterpret_cast<uint32x4_t>(m.v)) != 0;
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

/// Correctly rounded square root.
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
#elif defined(__aarch64__)
  if constexpr (N == 4) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(
        vsqrtq_f32(reinterpret_cast<float32x4_t>(a.v))));
  }
#endif
  Pack<float, N> r;
  for (int i = 0; i < N; ++i) r.v[i] = __builtin_sqrtf(a.v[i]);
  return r;
}

template <int N>
GSNAV_HD Pack<float, N> sqrt_above(Pack<float, N> a) noexcept {
#if defined(__SSE2__)
  using V = typename Pack<float, N>::vector;
  const Pack<float, N> positive = max(a, Pack<float, N>(1e-30f));
#if defined(__AVX512F__)
  if constexpr (N == 16) {  // error of rsqrt14: 2^-14
    const Pack<float, N> r(reinterpret_cast<V>(
        _mm512_maskz_rsqrt14_ps(static_cast<__mmask16>(-1), reinterpret_cast<__m512>(positive.v))));
    return positive * (r * Pack<float, N>(1.0001f));
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 8) {  // error of rsqrtps: 1.5 * 2^-12
    return positive *
           (Pack<float, N>(reinterpret_cast<V>(_mm256_rsqrt_ps(reinterpret_cast<__m256>(positive.v)))) *
            Pack<float, N>(1.0004f));
  }
#endif
  if constexpr (N == 4) {
    return positive *
           (Pack<float, N>(reinterpret_cast<V>(_mm_rsqrt_ps(reinterpret_cast<__m128>(positive.v)))) *
            Pack<float, N>(1.0004f));
  }
#endif
  return sqrt(a);
}

/// a * b + c, rounded once.
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
#if defined(__aarch64__)
  if constexpr (N == 4) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(
        vfmaq_f32(reinterpret_cast<float32x4_t>(c.v), reinterpret_cast<float32x4_t>(a.v),
                  reinterpret_cast<float32x4_t>(b.v))));
  }
#endif
  Pack<float, N> r;
  for (int i = 0; i < N; ++i) r.v[i] = __builtin_fmaf(a.v[i], b.v[i], c.v[i]);
  return r;
}

template <int N>
GSNAV_HD Pack<float, N> scale_by_rounded(Pack<float, N> p, Pack<float, N> t) noexcept {
  // Unsigned, because lanes that nothing reads may hold any value and their sums wrap.
  typename detail::PackTypes<N>::u a, b;
  std::memcpy(&a, &p.v, sizeof a);
  std::memcpy(&b, &t.v, sizeof b);
  a += b << 23;
  Pack<float, N> r;
  std::memcpy(&r.v, &a, sizeof a);
  return r;
}

/// 2^x for x in [-126, 126], with the bits of the scalar exp2 in each lane. The result for any other x
/// is unspecified.
template <Exp2 M = Exp2::degree5, int N>
GSNAV_HD Pack<float, N> exp2_in_range(Pack<float, N> x) noexcept {
  return detail::exp2_by_polynomial<M>(x);
}
/// 2^x, with the bits of the scalar exp2 in each lane.
template <Exp2 M = Exp2::degree5, int N>
GSNAV_HD Pack<float, N> exp2(Pack<float, N> x) noexcept {
  return exp2_in_range<M>(clamp(x, Pack<float, N>(-126.0f), Pack<float, N>(126.0f)));
}

/// log2(x), with the bits of the scalar log2 in each lane.
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
