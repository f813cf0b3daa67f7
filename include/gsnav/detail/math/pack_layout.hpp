// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "gsnav/detail/math/pack.hpp"

// Loads and stores of packs in other layouts than one value per lane.

namespace gsnav {

/// Reads K floats from any address and repeats them: lane i holds p[i % K].
template <int K, int N>
GSNAV_HD Pack<float, N> load_repeated(const float* p) noexcept {
  if constexpr (K == N) return Pack<float, N>::load(p);
#if defined(__AVX512F__)
  if constexpr (N == 16 && K == 4) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(
        _mm512_maskz_broadcast_f32x4(static_cast<__mmask16>(-1), _mm_loadu_ps(p))));
  }
#endif
#if defined(__AVX__)
  if constexpr (N == 8 && K == 4) {
    return Pack<float, N>(reinterpret_cast<typename Pack<float, N>::vector>(
        _mm256_broadcast_ps(reinterpret_cast<const __m128*>(p))));
  }
#endif
  float lanes[N];
  for (int i = 0; i < N; ++i) lanes[i] = p[i % K];
  return Pack<float, N>::load(lanes);
}

namespace detail {
/// Source lane for lane l of the K-th pack of interleaved triples; it belongs to pixel (K N + l) / 3.
/// Step 0 places the first and second components, step 1 the third.
template <int N, int K, int Step>
constexpr int interleaved_lane(int l) noexcept {
  const int pixel = (K * N + l) / 3, component = (K * N + l) % 3;
  if (Step == 0) return component == 1 ? N + pixel : pixel;
  return component == 2 ? N + pixel : l;
}
template <int K, int N, std::size_t... Lane>
GSNAV_HD Pack<float, N> interleaved(Pack<float, N> a, Pack<float, N> b, Pack<float, N> c,
                                    std::index_sequence<Lane...>) noexcept {
  const auto ab =
      __builtin_shufflevector(a.v, b.v, interleaved_lane<N, K, 0>(static_cast<int>(Lane))...);
  return Pack<float, N>(
      __builtin_shufflevector(ab, c.v, interleaved_lane<N, K, 1>(static_cast<int>(Lane))...));
}
}  // namespace detail

/// Writes a[0], b[0], c[0], a[1], ...: 3 N floats.
template <int N>
GSNAV_HD void store_interleaved(Pack<float, N> a, Pack<float, N> b, Pack<float, N> c,
                                float* out) noexcept {
  constexpr auto lanes = std::make_index_sequence<static_cast<std::size_t>(N)>{};
  detail::interleaved<0>(a, b, c, lanes).store(out);
  detail::interleaved<1>(a, b, c, lanes).store(out + N);
  detail::interleaved<2>(a, b, c, lanes).store(out + 2 * N);
}

namespace detail {
/// Source lane for lane l of a pack made of chunks of W lanes. The first half of the result comes from
/// pack a, the second from pack b. It takes the chunks first, first + every, ... of each.
template <int W, int N>
constexpr int chunk_lane(int l, int first, int every) noexcept {
  constexpr int kHalf = N / W / 2;  // chunks of the result that come from a
  const int chunk = l / W;
  return (chunk >= kHalf ? N : 0) + (first + every * (chunk % kHalf)) * W + l % W;
}
template <int W, int First, int Every, int N, std::size_t... Lane>
GSNAV_HD Pack<float, N> chunks(Pack<float, N> a, Pack<float, N> b,
                               std::index_sequence<Lane...>) noexcept {
  return Pack<float, N>(
      __builtin_shufflevector(a.v, b.v, chunk_lane<W, N>(static_cast<int>(Lane), First, Every)...));
}
}  // namespace detail

/// Transposes H packs of H chunks each (H is 2 or 4): pack i receives chunk i of every pack, in order.
/// This turns H-row blocks that lie next to each other into whole rows.
template <int H, int N>
GSNAV_HD void transpose_chunks(Pack<float, N>* v) noexcept {
  constexpr auto lanes = std::make_index_sequence<static_cast<std::size_t>(N)>{};
  constexpr int W = N / H;
  if constexpr (H == 2) {
    const Pack<float, N> a = v[0], b = v[1];
    v[0] = detail::chunks<W, 0, 1>(a, b, lanes);
    v[1] = detail::chunks<W, 1, 1>(a, b, lanes);
  } else {
    static_assert(H == 4);
    const Pack<float, N> top_a = detail::chunks<W, 0, 1>(v[0], v[1], lanes),
                         top_b = detail::chunks<W, 0, 1>(v[2], v[3], lanes);
    const Pack<float, N> low_a = detail::chunks<W, 2, 1>(v[0], v[1], lanes),
                         low_b = detail::chunks<W, 2, 1>(v[2], v[3], lanes);
    v[0] = detail::chunks<W, 0, 2>(top_a, top_b, lanes);
    v[1] = detail::chunks<W, 1, 2>(top_a, top_b, lanes);
    v[2] = detail::chunks<W, 0, 2>(low_a, low_b, lanes);
    v[3] = detail::chunks<W, 1, 2>(low_a, low_b, lanes);
  }
}

/// Writes first + l for each lane l set in `m`, in order, and returns the number written. May overwrite
/// up to N bytes from `out` on.
template <int N>
GSNAV_HD int store_lane_indices(Mask<N> m, int first, std::uint8_t* out) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const __m512i indices = _mm512_add_epi32(lanes, _mm512_set1_epi32(first));
    const __m512i packed = _mm512_maskz_compress_epi32(m.v, indices);
    const __m128i bytes = _mm512_maskz_cvtepi32_epi8(static_cast<__mmask16>(-1), packed);
    std::memcpy(out, &bytes, sizeof bytes);
    return __builtin_popcount(m.v);
  } else
#endif
  {
    int count = 0;
    for (std::uint32_t bits = lane_bits(m); bits != 0; bits &= bits - 1)
      out[count++] = static_cast<std::uint8_t>(first + __builtin_ctz(bits));
    return count;
  }
}

/// Writes the lanes selected by `bits` to consecutive positions from `out` on, and nothing else. Returns
/// the number written.
template <int N>
GSNAV_HD int store_lanes(std::uint32_t bits, const std::uint32_t (&lanes)[N],
                         std::uint32_t* out) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16) {
    const int count = __builtin_popcount(bits);
    const __m512i packed =
        _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), _mm512_loadu_si512(lanes));
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
/// Transposes two 8 x 8 matrices: the one in the lower halves of 8 registers, and the one in the upper
/// halves.
GSNAV_HD void transpose_halves(PackTypes<16>::f* r) noexcept {
  using V = PackTypes<16>::f;
  V t[8];
  for (int i = 0; i < 8; i += 2) {
    t[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13,
                                   29);
    t[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14,
                                       30, 15, 31);
  }
  for (int i = 0; i < 8; i += 4) {
    for (int h = 0; h < 2; ++h) {
      const V a = t[i + h], b = t[i + 2 + h];
      r[i + 2 * h] =
          __builtin_shufflevector(a, b, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
      r[i + 2 * h + 1] =
          __builtin_shufflevector(a, b, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
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

/// Reads K floats from each of N rows, one row per lane, into K packs, one per column.
template <int K, int N>
GSNAV_HD void load_columns(const float* const (&rows)[N], Pack<float, N>* columns) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16 && K == 8) {
    // Rows i and i + 8 share a register, so that each half is an 8 x 8 transpose.
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
    const auto row = [&rows](int i) GSNAV_INLINED {
      return reinterpret_cast<typename Pack<float, 4>::vector>(_mm_maskz_loadu_ps(0x7, rows[i]));
    };
    for (int i = 0; i < 4; ++i) {
      const auto low = __builtin_shufflevector(row(i), row(i + 4), 0, 1, 2, 3, 4, 5, 6, 7);
      const auto high = __builtin_shufflevector(row(i + 8), row(i + 12), 0, 1, 2, 3, 4, 5, 6, 7);
      r[i] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    }
    const V t0 =
        __builtin_shufflevector(r[0], r[1], 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    const V t1 =
        __builtin_shufflevector(r[0], r[1], 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    const V t2 =
        __builtin_shufflevector(r[2], r[3], 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    const V t3 =
        __builtin_shufflevector(r[2], r[3], 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    columns[0].v =
        __builtin_shufflevector(t0, t2, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
    columns[1].v =
        __builtin_shufflevector(t0, t2, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
    columns[2].v =
        __builtin_shufflevector(t1, t3, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
    return;
  }
#endif
  for (int k = 0; k < K; ++k) {
    float column[N];
    for (int i = 0; i < N; ++i) column[i] = rows[i][k];
    columns[k] = Pack<float, N>::load(column);
  }
}
/// Reads the columns of a row-major matrix with N rows of K floats.
template <int K, int N>
GSNAV_HD void load_columns(const float* matrix, Pack<float, N>* columns) noexcept {
  const float* rows[N];
  for (int i = 0; i < N; ++i) rows[i] = matrix + K * i;
  load_columns<K>(rows, columns);
}

/// Writes K packs, one per column, as a row-major matrix with N rows (one per lane) of K floats.
template <int K, int N>
GSNAV_HD void store_columns(const Pack<float, N>* columns, float* matrix) noexcept {
#if defined(__AVX512F__)
  if constexpr (N == 16 && K == 8) {
    typename Pack<float, 16>::vector r[8];
    for (int k = 0; k < 8; ++k) r[k] = columns[k].v;
    detail::transpose_halves(r);
    for (int i = 0; i < 8; ++i) {
      Pack<float, 8>(__builtin_shufflevector(r[i], r[i], 0, 1, 2, 3, 4, 5, 6, 7)).store(matrix + 8 * i);
      Pack<float, 8>(__builtin_shufflevector(r[i], r[i], 8, 9, 10, 11, 12, 13, 14, 15))
          .store(matrix + 8 * (i + 8));
    }
    return;
  }
#endif
#if defined(__AVX512F__)
  if constexpr (N == 16 && K == 4) {
    using V = typename Pack<float, 16>::vector;
    const V a = columns[0].v, b = columns[1].v, c = columns[2].v, d = columns[3].v;
    const V ab0 =
        __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    const V ab1 =
        __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    const V cd0 =
        __builtin_shufflevector(c, d, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
    const V cd1 =
        __builtin_shufflevector(c, d, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
    // r[i] holds rows i, i + 4, i + 8 and i + 12, four floats each.
    const V r[4] = {
        __builtin_shufflevector(ab0, cd0, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29),
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
