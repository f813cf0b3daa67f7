// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/math/pack.hpp"
#include "gsnav/detail/math/pack_layout.hpp"

// Matrices with one row per lane: their columns are packs.

namespace gsnav {

namespace detail {
/// Transposes the 4 x 4 matrix in 4 registers.
GSNAV_HD void transpose_quarters(PackTypes<4>::f* r) noexcept {
  using V = PackTypes<4>::f;
  const V low01 = __builtin_shufflevector(r[0], r[1], 0, 4, 1, 5);
  const V high01 = __builtin_shufflevector(r[0], r[1], 2, 6, 3, 7);
  const V low23 = __builtin_shufflevector(r[2], r[3], 0, 4, 1, 5);
  const V high23 = __builtin_shufflevector(r[2], r[3], 2, 6, 3, 7);
  r[0] = __builtin_shufflevector(low01, low23, 0, 1, 4, 5);
  r[1] = __builtin_shufflevector(low01, low23, 2, 3, 6, 7);
  r[2] = __builtin_shufflevector(high01, high23, 0, 1, 4, 5);
  r[3] = __builtin_shufflevector(high01, high23, 2, 3, 6, 7);
}
#if defined(__AVX512F__)
/// Transposes the 4 x 4 matrices in the four quarters of 4 registers.
GSNAV_HD void transpose_quarters(PackTypes<16>::f* r) noexcept {
  using V = PackTypes<16>::f;
  V t[4];
  for (int i = 0; i < 4; i += 2) {
    t[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13,
                                   29);
    t[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14,
                                       30, 15, 31);
  }
  for (int h = 0; h < 2; ++h) {
    const V a = t[h], b = t[h + 2];
    r[2 * h] = __builtin_shufflevector(a, b, 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29);
    r[2 * h + 1] =
        __builtin_shufflevector(a, b, 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31);
  }
}
/// Transposes two 8 x 8 matrices: the one in the lower halves of 8 registers, and the one in the upper
/// halves.
GSNAV_HD void transpose_halves(PackTypes<16>::f* r) noexcept {
  using V = PackTypes<16>::f;
  transpose_quarters(r);
  transpose_quarters(r + 4);
  for (int i = 0; i < 4; ++i) {
    const V a = r[i], b = r[i + 4];
    r[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 16, 17, 18, 19, 8, 9, 10, 11, 24, 25, 26, 27);
    r[i + 4] = __builtin_shufflevector(a, b, 4, 5, 6, 7, 20, 21, 22, 23, 12, 13, 14, 15, 28, 29, 30, 31);
  }
}
#endif
#if defined(__AVX2__)
/// Transposes the 4 x 4 matrices in the lower and in the upper halves of 4 registers.
GSNAV_HD void transpose_quarters(PackTypes<8>::f* r) noexcept {
  using V = PackTypes<8>::f;
  const V low01 = __builtin_shufflevector(r[0], r[1], 0, 8, 1, 9, 4, 12, 5, 13);
  const V high01 = __builtin_shufflevector(r[0], r[1], 2, 10, 3, 11, 6, 14, 7, 15);
  const V low23 = __builtin_shufflevector(r[2], r[3], 0, 8, 1, 9, 4, 12, 5, 13);
  const V high23 = __builtin_shufflevector(r[2], r[3], 2, 10, 3, 11, 6, 14, 7, 15);
  r[0] = __builtin_shufflevector(low01, low23, 0, 1, 8, 9, 4, 5, 12, 13);
  r[1] = __builtin_shufflevector(low01, low23, 2, 3, 10, 11, 6, 7, 14, 15);
  r[2] = __builtin_shufflevector(high01, high23, 0, 1, 8, 9, 4, 5, 12, 13);
  r[3] = __builtin_shufflevector(high01, high23, 2, 3, 10, 11, 6, 7, 14, 15);
}
/// Transposes an 8 x 8 matrix.
GSNAV_HD void transpose_eight(PackTypes<8>::f* r) noexcept {
  using V = PackTypes<8>::f;
  transpose_quarters(r);
  transpose_quarters(r + 4);
  for (int i = 0; i < 4; ++i) {
    const V a = r[i], b = r[i + 4];
    r[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11);
    r[i + 4] = __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
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
    typename Pack<float, 16>::vector r[4];
    const auto row = [&rows](int i) GSNAV_INLINED {
      return reinterpret_cast<typename Pack<float, 4>::vector>(_mm_maskz_loadu_ps(0x7, rows[i]));
    };
    for (int i = 0; i < 4; ++i) {
      const auto low = __builtin_shufflevector(row(i), row(i + 4), 0, 1, 2, 3, 4, 5, 6, 7);
      const auto high = __builtin_shufflevector(row(i + 8), row(i + 12), 0, 1, 2, 3, 4, 5, 6, 7);
      r[i] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    }
    detail::transpose_quarters(r);
    for (int k = 0; k < 3; ++k) columns[k].v = r[k];
    return;
  }
#endif
#if defined(__AVX2__)
  if constexpr (N == 8 && K == 8) {
    typename Pack<float, 8>::vector r[8];
    for (int i = 0; i < 8; ++i) r[i] = Pack<float, 8>::load(rows[i]).v;
    detail::transpose_eight(r);
    for (int k = 0; k < 8; ++k) columns[k].v = r[k];
    return;
  }
  if constexpr (N == 8 && K == 3) {
    // Rows i and i + 4 share a register.
    typename Pack<float, 8>::vector r[4];
    const auto row = [&rows](int i) GSNAV_INLINED {
      return reinterpret_cast<typename Pack<float, 4>::vector>(
          _mm_maskload_ps(rows[i], _mm_setr_epi32(-1, -1, -1, 0)));
    };
    for (int i = 0; i < 4; ++i)
      r[i] = __builtin_shufflevector(row(i), row(i + 4), 0, 1, 2, 3, 4, 5, 6, 7);
    detail::transpose_quarters(r);
    for (int k = 0; k < 3; ++k) columns[k].v = r[k];
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
    // r[i] gets rows i, i + 4, i + 8 and i + 12, four floats each.
    typename Pack<float, 16>::vector r[4];
    for (int k = 0; k < 4; ++k) r[k] = columns[k].v;
    detail::transpose_quarters(r);
    for (int i = 0; i < 4; ++i) {
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 0, 1, 2, 3)).store(matrix + 4 * i);
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 4, 5, 6, 7)).store(matrix + 4 * (i + 4));
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 8, 9, 10, 11)).store(matrix + 4 * (i + 8));
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 12, 13, 14, 15)).store(matrix + 4 * (i + 12));
    }
    return;
  }
#endif
#if defined(__AVX2__)
  if constexpr (N == 8 && K == 8) {
    typename Pack<float, 8>::vector r[8];
    for (int k = 0; k < 8; ++k) r[k] = columns[k].v;
    detail::transpose_eight(r);
    for (int i = 0; i < 8; ++i) Pack<float, 8>(r[i]).store(matrix + 8 * i);
    return;
  }
  if constexpr (N == 8 && K == 4) {
    typename Pack<float, 8>::vector r[4];
    for (int k = 0; k < 4; ++k) r[k] = columns[k].v;
    detail::transpose_quarters(r);
    for (int i = 0; i < 4; ++i) {
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 0, 1, 2, 3)).store(matrix + 4 * i);
      Pack<float, 4>(__builtin_shufflevector(r[i], r[i], 4, 5, 6, 7)).store(matrix + 4 * (i + 4));
    }
    return;
  }
#endif
  for (int k = 0; k < K; ++k) {
    for (int i = 0; i < N; ++i) matrix[K * i + k] = columns[k][i];
  }
}

}  // namespace gsnav
