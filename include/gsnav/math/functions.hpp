// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "gsnav/config.hpp"

// Scalar functions under one set of names for float, double and long double. detail/math/pack.hpp adds
// the same names for lanes, so that a kernel written once runs on any of them. Everything here uses
// correctly rounded operations only (+ - * / sqrt fma), except exp2, log2 and the trigonometric
// functions of double, which come from the platform.

namespace gsnav {

/// How many bits are set.
GSNAV_HD int count_bits(std::uint32_t bits) noexcept {
#if defined(__CUDA_ARCH__)
  return __popc(bits);
#else
  return __builtin_popcount(bits);
#endif
}

/// Types that belong to a scalar or a lane pack.
template <class L>
struct LaneTraits {
  using scalar = L;                ///< the element type
  using mask = bool;               ///< the result of a comparison
  using doubles = double;          ///< a double for each element
  static constexpr int width = 1;  ///< Number of elements.
};
/// Element type of a scalar or lane pack.
template <class L>
using scalar_of = typename LaneTraits<L>::scalar;
/// Comparison result of a scalar or lane pack.
template <class L>
using mask_of = typename LaneTraits<L>::mask;
/// A double for each element of a scalar or lane pack (detail/math/pack_double.hpp). static_cast
/// converts both ways.
template <class L>
using doubles_of = typename LaneTraits<L>::doubles;

#if defined(__CUDACC__)
GSNAV_HD float fma(float a, float b, float c) noexcept { return ::fmaf(a, b, c); }
GSNAV_HD double fma(double a, double b, double c) noexcept { return ::fma(a, b, c); }
GSNAV_HD float sqrt(float a) noexcept { return ::sqrtf(a); }
GSNAV_HD double sqrt(double a) noexcept { return ::sqrt(a); }
GSNAV_HD float abs(float a) noexcept { return ::fabsf(a); }
GSNAV_HD double abs(double a) noexcept { return ::fabs(a); }
#else
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__FMA__)
// Code for any x86-64 may not use the instruction unasked, so that compilers call libm, at five times
// the cost. All processors since 2013 have it, and it rounds as libm does: the same bits.
GSNAV_HD float fma(float a, float b, float c) noexcept {
  if (!__builtin_cpu_supports("fma")) return __builtin_fmaf(a, b, c);
  // Not volatile, it may be executed before the test.
  __asm__ volatile("vfmadd231ss %2, %1, %0" : "+x"(c) : "x"(a), "x"(b));
  return c;
}
GSNAV_HD double fma(double a, double b, double c) noexcept {
  if (!__builtin_cpu_supports("fma")) return __builtin_fma(a, b, c);
  __asm__ volatile("vfmadd231sd %2, %1, %0" : "+x"(c) : "x"(a), "x"(b));
  return c;
}
#else
/// a b + c, rounded once.
GSNAV_HD float fma(float a, float b, float c) noexcept { return __builtin_fmaf(a, b, c); }
/// a b + c, rounded once.
GSNAV_HD double fma(double a, double b, double c) noexcept { return __builtin_fma(a, b, c); }
#endif
/// a b + c, rounded once.
GSNAV_HD long double fma(long double a, long double b, long double c) noexcept {
  return __builtin_fmal(a, b, c);
}
/// Square root, correctly rounded.
GSNAV_HD float sqrt(float a) noexcept { return __builtin_sqrtf(a); }
/// Square root, correctly rounded.
GSNAV_HD double sqrt(double a) noexcept { return __builtin_sqrt(a); }
/// Square root, correctly rounded.
GSNAV_HD long double sqrt(long double a) noexcept { return __builtin_sqrtl(a); }
/// Absolute value.
GSNAV_HD float abs(float a) noexcept { return __builtin_fabsf(a); }
/// Absolute value.
GSNAV_HD double abs(double a) noexcept { return __builtin_fabs(a); }
/// Absolute value.
GSNAV_HD long double abs(long double a) noexcept { return __builtin_fabsl(a); }
#endif

/// Not below the square root of a >= 0, and above it by 1e-3 relative (and 1e-15) at most: packs need
/// not take the time of a correctly rounded one. The bits may differ between processors.
template <class S>
GSNAV_HD S sqrt_above(S a) noexcept {
  return sqrt(a);
}
/// 1 / a, on a GPU in float within 1 ulp of it.
template <class S>
GSNAV_HD S reciprocal_near(S a) noexcept {
  return S(1) / a;
}
#if defined(__CUDACC__)
// Of what is approximate the hardware says: 2^-23 for a root, 1 ulp for an inverse (PTX ISA).
GSNAV_HD float sqrt_above(float a) noexcept {
#if defined(__CUDA_ARCH__)
  float y;
  asm("sqrt.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(a));
  return ::fmaf(y, 1.000001f, 2e-19f);  // of numbers below the normal ones it is 0
#else
  return sqrt(a);
#endif
}
GSNAV_HD float reciprocal_near(float a) noexcept {
#if defined(__CUDA_ARCH__)
  float y;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(a));
  return y;
#else
  return 1.0f / a;
#endif
}
#endif
/// x without its fraction, |x| < 2^31.
GSNAV_HD float truncated(float a) noexcept { return static_cast<float>(static_cast<std::int32_t>(a)); }
GSNAV_HD double truncated(double a) noexcept {
  return static_cast<double>(static_cast<std::int32_t>(a));
}

/// Sine of radians.
GSNAV_HD float sin(float a) noexcept { return ::sinf(a); }
/// Sine of radians.
GSNAV_HD double sin(double a) noexcept { return ::sin(a); }
/// Cosine of radians.
GSNAV_HD float cos(float a) noexcept { return ::cosf(a); }
/// Cosine of radians.
GSNAV_HD double cos(double a) noexcept { return ::cos(a); }
/// Arc cosine, radians.
GSNAV_HD float acos(float a) noexcept { return ::acosf(a); }
/// Arc cosine, radians.
GSNAV_HD double acos(double a) noexcept { return ::acos(a); }

/// Smaller of two values; the second where either is NaN (the rule of SSE and of `a < b ? a : b`).
template <class S>
GSNAV_HD constexpr S min(S a, S b) noexcept {
  return a < b ? a : b;
}
/// Larger of two values; the second where either is NaN.
template <class S>
GSNAV_HD constexpr S max(S a, S b) noexcept {
  return a > b ? a : b;
}
/// The value, limited to [low, high].
template <class S>
GSNAV_HD S clamp(S v, S low, S high) noexcept {
  return min(max(v, low), high);
}
/// A value in 8 bits: round(255 clamp(v, 0, 1)), halves away from zero; 0 for NaN.
template <class S>
GSNAV_HD std::uint8_t to_byte(S v) noexcept {
  const S scaled = S(255) * clamp(v, S(0), S(1)), whole = truncated(scaled);
  // Not truncated(scaled + 0.5): the sum rounds.
  return static_cast<std::uint8_t>(static_cast<int>(whole) + (scaled - whole >= S(0.5) ? 1 : 0));
}
/// a if the mask is set, else b.
template <class S>
GSNAV_HD constexpr S select(bool mask, S a, S b) noexcept {
  return mask ? a : b;
}
/// Whether any lane is set.
GSNAV_HD constexpr bool any(bool mask) noexcept { return mask; }
/// Whether all lanes are set.
GSNAV_HD constexpr bool all(bool mask) noexcept { return mask; }

/// The bits of a float.
GSNAV_HD std::uint32_t bits_of(float a) noexcept {
  std::uint32_t u;
  std::memcpy(&u, &a, sizeof u);
  return u;
}
/// The float that has these bits.
GSNAV_HD float float_of_bits(std::uint32_t u) noexcept {
  float a;
  std::memcpy(&a, &u, sizeof a);
  return a;
}

/// Whether it is neither NaN nor infinite.
GSNAV_HD bool is_finite(float a) noexcept { return (bits_of(a) & 0x7f800000u) != 0x7f800000u; }
// A literal: numeric_limits' constexpr functions are host code to nvcc.
/// Whether it is neither NaN nor infinite.
GSNAV_HD bool is_finite(double a) noexcept { return abs(a) <= 1.7976931348623157e308; }
#if !defined(__CUDACC__)
/// Whether it is neither NaN nor infinite.
GSNAV_HD bool is_finite(long double a) noexcept {
  return abs(a) <= std::numeric_limits<long double>::max();
}
#endif

/// How exp2 is computed in float. Relative error against the true value, over [-126, 126]:
/// degree 5: 1.7e-7 (half of it rounding); degree 3: 1.0e-4 (the polynomial). hardware: a GPU's own
/// instruction, 1.8e-7 (PTX ISA, ex2.approx); on a CPU it is degree 5.
enum class Exp2 { degree5, degree3, hardware };

namespace detail {

// 2^f over [-1/2, 1/2]: the least relative error of a degree 5 with 2^0 = 1 (9.1e-8 before rounding),
// and the interpolant at Chebyshev nodes of degree 3.
template <class L>
GSNAV_HD L exp2_degree5(L f) noexcept {
  L p = fma(f, L(1.326472539421809e-3f), L(9.671512835181242e-3f));
  p = fma(f, p, L(5.550733750213024e-2f));
  p = fma(f, p, L(2.4022242082335424e-1f));
  p = fma(f, p, L(6.931469775953782e-1f));
  return fma(f, p, L(1.0f));
}
template <class L>
GSNAV_HD L exp2_degree3(L f) noexcept {
  L p = fma(f, L(5.5838282946219855e-2f), L(2.4263947854625853e-1f));
  p = fma(f, p, L(6.931367338836215e-1f));
  return fma(f, p, L(9.999245569508708e-1f));
}

/// Adding this to |x| < 2^21 rounds x to an integer, which stands in the low bits of the sum.
inline constexpr float kRoundMagic = 12582912.0f;

}  // namespace detail

/// p 2^n for a positive p and the t = n + detail::kRoundMagic of an integer n; no check for overflow.
GSNAV_HD float scale_by_rounded(float p, float t) noexcept {
  return float_of_bits(bits_of(p) + (bits_of(t) << 23));
}

namespace detail {
template <Exp2 M, class L>
GSNAV_HD L exp2_by_polynomial(L x) noexcept {
  const L t = x + L(kRoundMagic);
  const L f = x - (t - L(kRoundMagic));
  if constexpr (M == Exp2::degree3) return scale_by_rounded(exp2_degree3(f), t);
  return scale_by_rounded(exp2_degree5(f), t);
}
}  // namespace detail

/// 2^x for x in [-126, 126], without the clamp of exp2; of any other x in float: anything.
template <Exp2 M = Exp2::degree5>
GSNAV_HD float exp2_in_range(float x) noexcept {
#if defined(__CUDA_ARCH__)
  if constexpr (M == Exp2::hardware) {
    float y;
    asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(x));
    return y;
  }
#endif
  return detail::exp2_by_polynomial<M>(x);
}
/// 2^x. In float: x is clamped to [-126, 126], the integer part goes into the exponent and a
/// polynomial does the rest; every step is a correctly rounded operation, so all backends agree on
/// the bits. In double and long double: the platform's.
template <Exp2 M = Exp2::degree5>
GSNAV_HD float exp2(float x) noexcept {
  return exp2_in_range<M>(clamp(x, -126.0f, 126.0f));
}
template <Exp2 = Exp2::degree5>
GSNAV_HD double exp2(double x) noexcept {
  return ::exp2(x);
}
/// 2^x for every x, by the platform.
template <Exp2 = Exp2::degree5>
GSNAV_HD double exp2_in_range(double x) noexcept {
  return ::exp2(x);
}
#if !defined(__CUDACC__)
/// 2^x, by the platform.
template <Exp2 = Exp2::degree5>
GSNAV_HD long double exp2(long double x) noexcept {
  return ::exp2l(x);
}
/// 2^x for every x, by the platform.
template <Exp2 = Exp2::degree5>
GSNAV_HD long double exp2_in_range(long double x) noexcept {
  return ::exp2l(x);
}
#endif

namespace detail {
/// log2(m) + exponent for t = (m - 1) / (m + 1): log2(m) = 2 / ln 2 * artanh(t).
template <class L>
GSNAV_HD L log2_from_ratio(L t, L exponent) noexcept {
  const L t2 = t * t;
  L p = fma(t2, L(0.32059889f), L(0.41219858f));  // 2 / (9 ln 2), 2 / (7 ln 2)
  p = fma(t2, p, L(0.57707802f));                 // 2 / (5 ln 2)
  p = fma(t2, p, L(0.96179669f));                 // 2 / (3 ln 2)
  p = fma(t2, p, L(2.8853901f));                  // 2 / ln 2
  return fma(t, p, exponent);
}
}  // namespace detail

/// log2(x) for a positive normal x, from correctly rounded operations only: the same bits on every
/// backend. Error below 1e-7 absolute + 1.2e-7 relative.
GSNAV_HD float log2(float x) noexcept {
  const std::uint32_t u = bits_of(x);
  // Subtracting the bits of sqrt(1/2) puts the mantissa into [sqrt(1/2), sqrt(2)).
  const std::int32_t e = static_cast<std::int32_t>(u - 0x3f3504f3u) >> 23;
  const float m = float_of_bits(u - (static_cast<std::uint32_t>(e) << 23));
  return detail::log2_from_ratio((m - 1.0f) / (m + 1.0f), static_cast<float>(e));
}
GSNAV_HD double log2(double x) noexcept { return ::log2(x); }
#if !defined(__CUDACC__)
GSNAV_HD long double log2(long double x) noexcept { return ::log2l(x); }
#endif

}  // namespace gsnav
