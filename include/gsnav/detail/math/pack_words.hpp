// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "gsnav/detail/math/pack.hpp"

// Matrices of 16-bit words with one row per lane. Two rows fit in a register where one of floats does.
// So transposing words before they become floats takes half of the instructions.

#if defined(__x86_64__) && defined(__AVX2__) && defined(__F16C__)
#define GSNAV_WORDS  ///< Without it, this header declares nothing.

namespace gsnav {

/// N words of 16 bits, one per lane.
template <int N>
struct WordsOf {
  typedef std::uint16_t type __attribute__((vector_size(2 * N)));
};
template <int N>
using Words = typename WordsOf<N>::type;

namespace detail {
/// Lane of two registers (the second begins at N) that lane l takes, in each group of 8 lanes: W words
/// of the first register, W of the second, and so on; from the lower halves of their groups, or the
/// upper.
template <int N, int W>
constexpr int alternating_lane(int l, bool high) noexcept {
  const int unit = l % 8 / W;
  return (unit % 2 == 0 ? 0 : N) + l / 8 * 8 + (high ? 4 : 0) + unit / 2 * W + l % W;
}
template <int W, bool High, class V, std::size_t... Lane>
GSNAV_HD V alternating(V a, V b, std::index_sequence<Lane...>) noexcept {
  constexpr int n = static_cast<int>(sizeof...(Lane));
  return __builtin_shufflevector(a, b, alternating_lane<n, W>(static_cast<int>(Lane), High)...);
}
/// Transposes the 8 x 8 matrices in the groups of 8 words of 8 registers.
template <int N>
GSNAV_HD void transpose_words(Words<N>* r) noexcept {
  constexpr auto lanes = std::make_index_sequence<static_cast<std::size_t>(N)>{};
  Words<N> pairs[8], quads[8];
  for (int i = 0; i < 8; i += 2) {
    pairs[i] = alternating<1, false>(r[i], r[i + 1], lanes);
    pairs[i + 1] = alternating<1, true>(r[i], r[i + 1], lanes);
  }
  for (int i = 0; i < 8; i += 4) {
    for (int k = 0; k < 2; ++k) {
      quads[i + 2 * k] = alternating<2, false>(pairs[i + k], pairs[i + k + 2], lanes);
      quads[i + 2 * k + 1] = alternating<2, true>(pairs[i + k], pairs[i + k + 2], lanes);
    }
  }
  for (int k = 0; k < 4; ++k) {
    r[2 * k] = alternating<4, false>(quads[k], quads[k + 4], lanes);
    r[2 * k + 1] = alternating<4, true>(quads[k], quads[k + 4], lanes);
  }
}
}  // namespace detail

/// Reads 8 words from each of N = 8 or 16 rows, one row per lane, into 8 registers, one per column.
/// row(i) loads those of row i.
template <int N, class Row>
GSNAV_HD void load_words(const Row& row, Words<N>* columns) noexcept {
  for (int i = 0; i < 8; ++i) {
    if constexpr (N == 16) {
      columns[i] = __builtin_shufflevector(row(i), row(i + 8), 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12,
                                           13, 14, 15);
    } else {
      columns[i] = row(i);
    }
  }
  detail::transpose_words<N>(columns);
}
/// K = 3 or 8 words from p on. The other lanes are 0.
template <int K>
GSNAV_HD Words<8> words_of(const std::uint16_t* p) noexcept {
  if constexpr (K == 8) {
    Words<8> words;
    std::memcpy(&words, p, sizeof words);
    return words;
  } else {
    static_assert(K == 3);
    // A copy of 6 bytes would go through the stack, where the load waits for two stores.
    std::uint32_t two;
    std::memcpy(&two, p, sizeof two);
    return reinterpret_cast<Words<8>>(
        _mm_cvtsi64_si128(static_cast<long long>(std::uint64_t{p[2]} << 32 | two)));
  }
}
/// 8 signed bytes as words.
GSNAV_HD Words<8> words_of_bytes(const std::int8_t* p) noexcept {
  return reinterpret_cast<Words<8>>(
      _mm_cvtepi8_epi16(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p))));
}
/// The values of finite halves, as half_to_float gives them.
GSNAV_HD Pack<float, 8> floats_of_halves(Words<8> halves) noexcept {
  return Pack<float, 8>(
      reinterpret_cast<Pack<float, 8>::vector>(_mm256_cvtph_ps(reinterpret_cast<__m128i>(halves))));
}
GSNAV_HD Pack<float, 8> floats_of_integers(Words<8> integers) noexcept {
  return Pack<float, 8>(reinterpret_cast<Pack<float, 8>::vector>(
      _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(reinterpret_cast<__m128i>(integers)))));
}
#if defined(__AVX512F__)
// Masked forms, because g++ 12 warns of the others.
GSNAV_HD Pack<float, 16> floats_of_halves(Words<16> halves) noexcept {
  return Pack<float, 16>(reinterpret_cast<Pack<float, 16>::vector>(
      _mm512_maskz_cvtph_ps(static_cast<__mmask16>(-1), reinterpret_cast<__m256i>(halves))));
}
GSNAV_HD Pack<float, 16> floats_of_integers(Words<16> integers) noexcept {
  constexpr auto all = static_cast<__mmask16>(-1);
  return Pack<float, 16>(reinterpret_cast<Pack<float, 16>::vector>(_mm512_maskz_cvtepi32_ps(
      all, _mm512_maskz_cvtepi16_epi32(all, reinterpret_cast<__m256i>(integers)))));
}
#endif

}  // namespace gsnav
#endif
