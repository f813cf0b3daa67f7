// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <utility>

#include "gsnav/detail/math/pack.hpp"

// SIMD packs of doubles, with half as many lanes as packs of floats, for the few values that need
// double. Each lane has the bits of the scalar function.

namespace gsnav {

namespace detail {
template <int N>
struct DoublePackTypes;
template <>
struct DoublePackTypes<2> {
  typedef double d __attribute__((vector_size(16)));
  typedef float f __attribute__((vector_size(8)));
  typedef std::int32_t i __attribute__((vector_size(8)));
};
template <>
struct DoublePackTypes<4> {
  typedef double d __attribute__((vector_size(32)));
  typedef float f __attribute__((vector_size(16)));
  typedef std::int32_t i __attribute__((vector_size(16)));
};
template <>
struct DoublePackTypes<8> {
  typedef double d __attribute__((vector_size(64)));
  typedef float f __attribute__((vector_size(32)));
  typedef std::int32_t i __attribute__((vector_size(32)));
};
}  // namespace detail

template <int N>
struct Pack<double, N> : detail::PackArithmetic<Pack<double, N>> {
  using vector = typename detail::DoublePackTypes<N>::d;
  using floats = typename detail::DoublePackTypes<N>::f;
  using ints = typename detail::DoublePackTypes<N>::i;
  vector v{};

  GSNAV_HD Pack() noexcept = default;
  GSNAV_HD Pack(double s) noexcept : v(s - vector{}) {}
  GSNAV_HD explicit Pack(vector x) noexcept : v(x) {}

  /// Reads N floats from any address and widens them.
  GSNAV_HD static Pack load(const float* p) noexcept {
    floats f;
    std::memcpy(&f, p, sizeof f);
    return Pack(__builtin_convertvector(f, vector));
  }
  GSNAV_HD static Pack load(const double* p) noexcept {
    Pack r;
    std::memcpy(&r.v, p, sizeof r.v);
    return r;
  }
  /// Rounds to N floats and writes them to any address.
  GSNAV_HD void store(float* p) const noexcept {
    const floats f = __builtin_convertvector(v, floats);
    std::memcpy(p, &f, sizeof f);
  }
  GSNAV_HD double operator[](int i) const noexcept { return v[i]; }
};

template <int N>
struct LaneTraits<Pack<double, N>> {
  using scalar = double;
  static constexpr int width = N;
};

template <int N>
GSNAV_HD Pack<double, N> min(Pack<double, N> a, Pack<double, N> b) noexcept {
  return Pack<double, N>(a.v < b.v ? a.v : b.v);
}
template <int N>
GSNAV_HD Pack<double, N> max(Pack<double, N> a, Pack<double, N> b) noexcept {
  return Pack<double, N>(a.v > b.v ? a.v : b.v);
}

template <int N>
GSNAV_HD Pack<double, N> sqrt(Pack<double, N> a) noexcept {
#if defined(__aarch64__)
  if constexpr (N == 2) {
    return Pack<double, N>(reinterpret_cast<typename Pack<double, N>::vector>(
        vsqrtq_f64(reinterpret_cast<float64x2_t>(a.v))));
  }
#endif
  Pack<double, N> r;
  for (int i = 0; i < N; ++i) r.v[i] = __builtin_sqrt(a.v[i]);
  return r;
}

namespace detail {
template <int Half, int N, std::size_t... Lane>
GSNAV_HD Pack<double, N / 2> widened(Pack<float, N> a, std::index_sequence<Lane...>) noexcept {
  using P = Pack<double, N / 2>;
  const typename P::floats half =
      __builtin_shufflevector(a.v, a.v, Half * (N / 2) + static_cast<int>(Lane)...);
  return P(__builtin_convertvector(half, typename P::vector));
}
template <int N, std::size_t... Lane>
GSNAV_HD Pack<float, 2 * N> rounded(Pack<double, N> low, Pack<double, N> high,
                                    std::index_sequence<Lane...>) noexcept {
  using P = Pack<double, N>;
  const typename P::floats l = __builtin_convertvector(low.v, typename P::floats);
  const typename P::floats h = __builtin_convertvector(high.v, typename P::floats);
  return Pack<float, 2 * N>(__builtin_shufflevector(l, h, static_cast<int>(Lane)...));
}
}  // namespace detail

/// Half of the lanes of a pack of floats, as doubles: the lower half (0) or the upper half (1).
template <int Half, int N>
GSNAV_HD Pack<double, N / 2> widened(Pack<float, N> a) noexcept {
  return detail::widened<Half>(a, std::make_index_sequence<static_cast<std::size_t>(N / 2)>{});
}

/// Rounds two halves to one pack of floats.
template <int N>
GSNAV_HD Pack<float, 2 * N> rounded(Pack<double, N> low, Pack<double, N> high) noexcept {
  return detail::rounded(low, high, std::make_index_sequence<static_cast<std::size_t>(2 * N)>{});
}

/// a * b + c, rounded once.
template <int N>
GSNAV_HD Pack<double, N> fma(Pack<double, N> a, Pack<double, N> b, Pack<double, N> c) noexcept {
  using P = Pack<double, N>;
#if defined(__AVX512F__)
  if constexpr (N == 8) {
    return P(reinterpret_cast<typename P::vector>(_mm512_fmadd_pd(reinterpret_cast<__m512d>(a.v),
                                                                  reinterpret_cast<__m512d>(b.v),
                                                                  reinterpret_cast<__m512d>(c.v))));
  }
#endif
#if defined(__FMA__)
  if constexpr (N == 4) {
    return P(reinterpret_cast<typename P::vector>(_mm256_fmadd_pd(reinterpret_cast<__m256d>(a.v),
                                                                  reinterpret_cast<__m256d>(b.v),
                                                                  reinterpret_cast<__m256d>(c.v))));
  }
#endif
#if defined(__aarch64__)
  if constexpr (N == 2) {
    return P(reinterpret_cast<typename P::vector>(vfmaq_f64(reinterpret_cast<float64x2_t>(c.v),
                                                            reinterpret_cast<float64x2_t>(a.v),
                                                            reinterpret_cast<float64x2_t>(b.v))));
  }
#endif
  P r;
  for (int i = 0; i < N; ++i) r.v[i] = __builtin_fma(a.v[i], b.v[i], c.v[i]);
  return r;
}

/// N doubles as two packs: the lower and the upper half of the lanes of Pack<float, N>.
template <int N>
struct PackPair {
  using half = Pack<double, N / 2>;
  half low, high;

  GSNAV_HD PackPair() noexcept = default;
  GSNAV_HD PackPair(double s) noexcept : low(s), high(s) {}
  GSNAV_HD PackPair(half l, half h) noexcept : low(l), high(h) {}
  GSNAV_HD explicit PackPair(Pack<float, N> a) noexcept : low(widened<0>(a)), high(widened<1>(a)) {}
  /// Rounds to floats.
  GSNAV_HD explicit operator Pack<float, N>() const noexcept { return rounded(low, high); }
  /// Reads N doubles from any address.
  GSNAV_HD static PackPair load(const double* p) noexcept {
    return {half::load(p), half::load(p + N / 2)};
  }

  GSNAV_HD friend PackPair operator+(PackPair a, PackPair b) noexcept {
    return {a.low + b.low, a.high + b.high};
  }
  GSNAV_HD friend PackPair operator-(PackPair a, PackPair b) noexcept {
    return {a.low - b.low, a.high - b.high};
  }
  GSNAV_HD friend PackPair operator*(PackPair a, PackPair b) noexcept {
    return {a.low * b.low, a.high * b.high};
  }
  GSNAV_HD friend PackPair operator/(PackPair a, PackPair b) noexcept {
    return {a.low / b.low, a.high / b.high};
  }
  /// a * b + c, rounded once.
  GSNAV_HD friend PackPair fma(PackPair a, PackPair b, PackPair c) noexcept {
    return {fma(a.low, b.low, c.low), fma(a.high, b.high, c.high)};
  }
  GSNAV_HD friend PackPair sqrt(PackPair a) noexcept { return {sqrt(a.low), sqrt(a.high)}; }
  GSNAV_HD friend PackPair truncated(PackPair a) noexcept {
    return {truncated(a.low), truncated(a.high)};
  }
  GSNAV_HD friend PackPair clamp(PackPair v, PackPair least, PackPair most) noexcept {
    return {clamp(v.low, least.low, most.low), clamp(v.high, least.high, most.high)};
  }
};

template <int N>
struct LaneTraits<PackPair<N>> {
  using scalar = double;
  static constexpr int width = N;
};

}  // namespace gsnav
