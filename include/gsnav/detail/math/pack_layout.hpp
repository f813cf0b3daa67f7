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

#if defined(__AVX2__)
namespace detail {
/// For each of 256 sets of bits: the places of its bits, in order, one byte each.
struct BitPlaces {
  std::uint64_t places[256];
  constexpr BitPlaces() noexcept : places{} {
    for (std::uint32_t bits = 0; bits < 256; ++bits) {
      int count = 0;
      for (std::uint64_t k = 0; k < 8; ++k) {
        if ((bits >> k & 1u) != 0) places[bits] |= k << (8 * count++);
      }
    }
  }
};
/// Not inline: objects of different instruction sets must not share a symbol.
constexpr BitPlaces kBitPlaces;
}  // namespace detail
#endif

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
#if defined(__AVX2__)
      if constexpr (N == 8) {
    const std::uint32_t bits = lane_bits(m);
    const std::uint64_t indices =
        detail::kBitPlaces.places[bits] + 0x0101010101010101u * static_cast<std::uint64_t>(first);
    std::memcpy(out, &indices, sizeof indices);
    return __builtin_popcount(bits);
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
#if defined(__AVX2__)
      if constexpr (N == 8) {
    const __m256i numbers = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256i places =
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(detail::kBitPlaces.places[bits])));
    const __m256i all = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(lanes));
    const int count = __builtin_popcount(bits);
    _mm256_maskstore_epi32(reinterpret_cast<int*>(out),
                           _mm256_cmpgt_epi32(_mm256_set1_epi32(count), numbers),
                           _mm256_permutevar8x32_epi32(all, places));
    return count;
  } else
#endif
  {
    int count = 0;
    for (; bits != 0; bits &= bits - 1) out[count++] = lanes[__builtin_ctz(bits)];
    return count;
  }
}

}  // namespace gsnav
