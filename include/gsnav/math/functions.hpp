// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "gsnav/config.hpp"

// Scalar functions with the same names for float and double, some also for long double.
// detail/math/pack.hpp adds these names for SIMD packs, so that a kernel written once runs on all of
// them. All functions use correctly rounded operations (+ - * / sqrt fma), except exp2 and log2 of
// double and the trigonometric functions, which come from the platform.

namespace gsnav {

/// Number of bits that are set.
GSNAV_HD int count_bits(std::uint32_t bits) noexcept {
#if defined(__CUDA_ARCH__)
  return __popc(bits);
#else
  return __builtin_popcount(bits);
#endif
}

/// Element type, mask type and width of a lane type L. This is the form for scalars; packs specialise
/// it.
template <class L>
struct LaneTraits {
  using scalar = L;                ///< the element type
  using mask = bool;               ///< the result of a comparison
  using doubles = double;          ///< a double for each element
  static constexpr int width = 1;  ///< number of elements
};
/// Element type of a scalar or SIMD pack.
template <class L>
using scalar_of = typename LaneTraits<L>::scalar;
/// Result type of comparisons of a scalar or SIMD pack.
template <class L>
using mask_of = typename LaneTraits<L>::mask;
/// Type with one double per element of a scalar or SIMD pack (detail/math/pack_double.hpp). static_cast
/// converts both ways.
template <class L>
using doubles_of = typename LaneTraits<L>::doubles;

#if defined(__CUDACC__)
/// a * b + c, rounded once.
GSNAV_HD float fma(float a, float b, float c) noexcept { return ::fmaf(a, b, c); }
/// a * b + c, rounded once.
GSNAV_HD double fma(double a, double b, double c) noexcept { return ::fma(a, b, c); }
/// Correctly rounded square root.
GSNAV_HD float sqrt(float a) noexcept { return ::sqrtf(a); }
/// Correctly rounded square root.
GSNAV_HD double sqrt(double a) noexcept { return ::sqrt(a); }
/// Absolute value.
GSNAV_HD float abs(float a) noexcept { return ::fabsf(a); }
/// Absolute value.
GSNAV_HD double abs(double a) noexcept { return ::fabs(a); }
#else
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__FMA__)
// Code for any x86-64 may not assume FMA, so compilers call libm, which takes five times as long. All
// processors since 2013 have the instruction. It rounds as libm does, so both paths give the same bits.

/// a * b + c, rounded once.
GSNAV_HD float fma(float a, float b, float c) noexcept {
  if (!__builtin_cpu_supports("fma")) return __builtin_fmaf(a, b, c);
  // volatile, or the compiler may execute it before the test.
  __asm__ volatile("vfmadd231ss %2, %1, %0" : "+x"(c) : "x"(a), "x"(b));
  return c;
}
/// a * b + c, rounded once.
GSNAV_HD double fma(double a, double b, double c) noexcept {
  if (!__builtin_cpu_supports("fma")) return __builtin_fma(a, b, c);
  __asm__ volatile("vfmadd231sd %2, %1, %0" : "+x"(c) : "x"(a), "x"(b));
  return c;
}
#else
/// a * b + c, rounded once.
GSNAV_HD float fma(float a, float b, float c) noexcept { return __builtin_fmaf(a, b, c); }
/// a * b + c, rounded once.
GSNAV_HD double fma(double a, double b, double c) noexcept { return __builtin_fma(a, b, c); }
#endif
/// a * b + c, rounded once.
GSNAV_HD long double fma(long double a, long double b, long double c) noexcept {
  return __builtin_fmal(a, b, c);
}
/// Correctly rounded square root.
GSNAV_HD float sqrt(float a) noexcept { return __builtin_sqrtf(a); }
/// Correctly rounded square root.
GSNAV_HD double sqrt(double a) noexcept { return __builtin_sqrt(a); }
/// Correctly rounded square root.
GSNAV_HD long double sqrt(long double a) noexcept { return __builtin_sqrtl(a); }
/// Absolute value.
GSNAV_HD float abs(float a) noexcept { return __builtin_fabsf(a); }
/// Absolute value.
GSNAV_HD double abs(double a) noexcept { return __builtin_fabs(a); }
/// Absolute value.
GSNAV_HD long double abs(long double a) noexcept { return __builtin_fabsl(a); }
#endif

/// Upper bound of the square root of a >= 0, too large by at most 1e-3 relative plus 1e-15. Packs and
/// GPUs compute it faster than a correctly rounded root. Its bits may differ between processors.
template <class S>
GSNAV_HD S sqrt_above(S a) noexcept {
  return sqrt(a);
}
/// 1 / a, correctly rounded except in float on a GPU, where the error is at most 1 ulp.
template <class S>
GSNAV_HD S reciprocal_near(S a) noexcept {
  return S(1) / a;
}
#if defined(__CUDACC__)
// Error bounds of the approximate instructions (PTX ISA): 2^-23 relative for the square root, 1 ulp for
// the reciprocal.
/// Upper bound of the square root, by the approximate instruction in device code.
GSNAV_HD float sqrt_above(float a) noexcept {
#if defined(__CUDA_ARCH__)
  float y;
  asm("sqrt.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(a));
  // The instruction gives 0 for subnormal input; the constant covers it.
  return ::fmaf(y, 1.000001f, 2e-19f);
#else
  return sqrt(a);
#endif
}
/// 1 / a within 1 ulp, by the approximate instruction in device code.
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
/// Integer part of a, rounded toward zero. |a| < 2^31.
GSNAV_HD float truncated(float a) noexcept { return static_cast<float>(static_cast<std::int32_t>(a)); }
/// Integer part of a, rounded toward zero. |a| < 2^31.
GSNAV_HD double truncated(double a) noexcept {
  return static_cast<double>(static_cast<std::int32_t>(a));
}

/// Sine of an angle in radians.
GSNAV_HD float sin(float a) noexcept { return ::sinf(a); }
/// Sine of an angle in radians.
GSNAV_HD double sin(double a) noexcept { return ::sin(a); }
/// Cosine of an angle in radians.
GSNAV_HD float cos(float a) noexcept { return ::cosf(a); }
/// Cosine of an angle in radians.
GSNAV_HD double cos(double a) noexcept { return ::cos(a); }
/// Arc cosine in radians.
GSNAV_HD float acos(float a) noexcept { return ::acosf(a); }
/// Arc cosine in radians.
GSNAV_HD double acos(double a) noexcept { return ::acos(a); }

/// Smaller of two values, or b if either is NaN (the rule of SSE's minimum).
template <class S>
GSNAV_HD constexpr S min(S a, S b) noexcept {
  return a < b ? a : b;
}
/// Larger of two values, or b if either is NaN.
template <class S>
GSNAV_HD constexpr S max(S a, S b) noexcept {
  return a > b ? a : b;
}
/// v limited to [low, high].
template <class S>
GSNAV_HD S clamp(S v, S low, S high) noexcept {
  return min(max(v, low), high);
}
/// Converts a value in [0, 1] to 8 bits: round(255 clamp(v, 0, 1)), halves away from zero. NaN gives 0.
template <class S>
GSNAV_HD std::uint8_t to_byte(S v) noexcept {
  const S scaled = S(255) * clamp(v, S(0), S(1)), whole = truncated(scaled);
  // Not truncated(scaled + 0.5): that sum would round.
  return static_cast<std::uint8_t>(static_cast<int>(whole) + (scaled - whole >= S(0.5) ? 1 : 0));
}
/// a where mask is set, else b.
template <class S>
GSNAV_HD constexpr S select(bool mask, S a, S b) noexcept {
  return mask ? a : b;
}
/// True if any lane of the mask is set.
GSNAV_HD constexpr bool any(bool mask) noexcept { return mask; }
/// True if all lanes of the mask are set.
GSNAV_HD constexpr bool all(bool mask) noexcept { return mask; }

/// Bit pattern of a float.
GSNAV_HD std::uint32_t bits_of(float a) noexcept {
  std::uint32_t u;
  std::memcpy(&u, &a, sizeof u);
  return u;
}
/// Float with the bit pattern u.
GSNAV_HD float float_of_bits(std::uint32_t u) noexcept {
  float a;
  std::memcpy(&a, &u, sizeof a);
  return a;
}

/// True unless a is infinite or NaN.
GSNAV_HD bool is_finite(float a) noexcept { return (bits_of(a) & 0x7f800000u) != 0x7f800000u; }
/// True unless a is infinite or NaN. Compares with a literal, because numeric_limits' constexpr
/// functions are host code for nvcc.
GSNAV_HD bool is_finite(double a) noexcept { return abs(a) <= 1.7976931348623157e308; }
#if !defined(__CUDACC__)
/// True unless a is infinite or NaN.
GSNAV_HD bool is_finite(long double a) noexcept {
  return abs(a) <= std::numeric_limits<long double>::max();
}
#endif

/// Method of exp2 in float. Relative errors over [-126, 126]: 1.7e-7 for degree5 (half of it rounding),
/// 1.0e-4 for degree3. `hardware` is a GPU's ex2.approx instruction with 1.8e-7 (PTX ISA); on a CPU it
/// is degree5.
enum class Exp2 {
  degree5,  ///< polynomial of degree 5
  degree3,  ///< polynomial of degree 3
  hardware  ///< a GPU's own instruction
};

namespace detail {

// 2^f for f in [-1/2, 1/2]. The degree-5 polynomial has the least relative error among those with 2^0 =
// 1 (9.1e-8 before rounding). The degree-3 polynomial interpolates at Chebyshev nodes.
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

/// Adding this to x with |x| < 2^21 rounds x to an integer, which then stands in the low bits of the
/// sum.
inline constexpr float kRoundMagic = 12582912.0f;

}  // namespace detail

/// p * 2^n for positive p, where t = n + detail::kRoundMagic for an integer n. Overflow is not checked.
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

/// 2^x for x in [-126, 126], without the clamp of exp2. In float, the result for any other x is
/// unspecified.
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
/// 2^x. In float, x is clamped to [-126, 126]; the integer part goes to the exponent, and a polynomial
/// computes the rest. Each step is correctly rounded, so all backends agree on the bits. In double the
/// platform's function is used.
template <Exp2 M = Exp2::degree5>
GSNAV_HD float exp2(float x) noexcept {
  return exp2_in_range<M>(clamp(x, -126.0f, 126.0f));
}
/// 2^x by the platform's function.
template <Exp2 = Exp2::degree5>
GSNAV_HD double exp2(double x) noexcept {
  return ::exp2(x);
}
/// 2^x by the platform's function.
template <Exp2 = Exp2::degree5>
GSNAV_HD double exp2_in_range(double x) noexcept {
  return ::exp2(x);
}

namespace detail {
/// log2(m) + exponent, where t = (m - 1) / (m + 1). Uses log2(m) = 2 / ln 2 * artanh(t), with five terms
/// of the series.
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

/// log2(x) for a positive, normal x, with an error below 1e-7 absolute plus 1.2e-7 relative. It uses
/// only correctly rounded operations, so all backends agree on the bits.
GSNAV_HD float log2(float x) noexcept {
  const std::uint32_t u = bits_of(x);
  // Subtracting the bits of sqrt(1/2) moves the mantissa to [sqrt(1/2), sqrt(2)).
  const std::int32_t e = static_cast<std::int32_t>(u - 0x3f3504f3u) >> 23;
  const float m = float_of_bits(u - (static_cast<std::uint32_t>(e) << 23));
  return detail::log2_from_ratio((m - 1.0f) / (m + 1.0f), static_cast<float>(e));
}
/// log2(x) by the platform's function.
GSNAV_HD double log2(double x) noexcept { return ::log2(x); }

}  // namespace gsnav
