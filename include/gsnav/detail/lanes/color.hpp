// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/set_rows.hpp"
#include "gsnav/detail/lanes/isa.hpp"
#include "gsnav/detail/math/pack_words.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Visible Gaussians of one chunk, in row order: row, and mean - camera in the asset frame.
struct Survivors {
  static constexpr std::size_t kRoom = kProjectChunk + static_cast<std::size_t>(kWidth);
  std::uint32_t rows[kRoom];
  std::uint32_t delta[3][kRoom];  ///< bit patterns of floats
};

/// Number of values of the bands above degree 0 that are read together.
inline constexpr int kBandGroup = 8;  // of load_words, too

/// Reads K halves of each of kWidth rows of `stride` values, one row per lane.
template <int K>
GSNAV_HD void load_halves(const std::uint16_t* first, std::size_t stride, const std::uint32_t* rows,
                          F* columns) noexcept {
#if defined(GSNAV_WORDS)
  const auto row = [=](int l) GSNAV_INLINED { return words_of<K>(first + stride * rows[l]); };
  Words<kWidth> words[8];
  load_words<kWidth>(row, words);
  for (int k = 0; k < K; ++k) columns[k] = floats_of_halves(words[k]);
#else
  float values[K * kWidth];
  for (int l = 0; l < kWidth; ++l) {
    for (int k = 0; k < K; ++k)
      values[K * l + k] = sh_value(first[stride * rows[l] + static_cast<std::size_t>(k)]);
  }
  load_columns<K>(values, columns);
#endif
}

/// Reads kBandGroup codes of each of kWidth rows of `stride` values, in units of `steps`, one row per
/// lane.
GSNAV_HD void load_codes(const std::int8_t* first, std::size_t stride, const std::uint32_t* rows,
                         const float* steps, F* columns) noexcept {
#if defined(GSNAV_WORDS)
  const auto row = [=](int l) GSNAV_INLINED { return words_of_bytes(first + stride * rows[l]); };
  Words<kWidth> words[8];
  load_words<kWidth>(row, words);
  for (int k = 0; k < kBandGroup; ++k) columns[k] = floats_of_integers(words[k]) * F(steps[k]);
#else
  float values[kBandGroup * kWidth];
  for (int l = 0; l < kWidth; ++l) {
    for (int k = 0; k < kBandGroup; ++k)
      values[kBandGroup * l + k] =
          sh_value(first[stride * rows[l] + static_cast<std::size_t>(k)], steps[k]);
  }
  load_columns<kBandGroup>(values, columns);
#endif
}

/// Reads values [from, from + kBandGroup) of the bands of kWidth rows of one chunk, one row per lane.
GSNAV_HD void load_bands(const ColorRows& sh, BandEncoding encoding, const std::uint32_t* rows,
                         std::size_t from, F* columns) noexcept {
  const std::size_t stride = sh.rest();
  if (encoding == BandEncoding::codes) {
    float steps[kBandGroup];
    const PackedChunk& chunk = sh.chunks[rows[0] / kProjectChunk];
    for (int k = 0; k < kBandGroup; ++k)
      steps[k] = chunk.sh_steps[packed_band(1 + (static_cast<int>(from) + k) / 3)];
    load_codes(sh.shN_codes.data + from, stride, rows, steps, columns);
  } else if (encoding == BandEncoding::halves) {
    load_halves<kBandGroup>(sh.shN_half.data + from, stride, rows, columns);
  } else {
    const float* at[kWidth];
    for (int l = 0; l < kWidth; ++l) at[l] = sh.shN.data + stride * rows[l] + from;
    load_columns<kBandGroup>(at, columns);
  }
}

/// Colours of kWidth Gaussians of one chunk, with the bits of gaussian_color. Lane l is row rows[l].
/// Coefficients are stored by rows; groups of columns are transposed into lanes as they are loaded.
GSNAV_HD SplatColor<F> gaussian_colors(const ColorRows& sh, int degree, const std::uint32_t* rows,
                                       Vec3<F> delta) noexcept {
  if (degree > 0) {
    delta = view_direction(delta);
    if (!sh.rotations.empty()) {
      float q[4][kWidth];
      for (std::size_t k = 0; k < 4; ++k) {
        for (int l = 0; l < kWidth; ++l) q[k][l] = sh.rotations[k][rows[l]];
      }
      delta = turned_back(delta, Quat<F>{F::load(q[0]), F::load(q[1]), F::load(q[2]), F::load(q[3])});
    }
  }
  // Plain vectors, because packs would be initialised first.
  typename F::vector c[3 * sh_coefficient_count(kMaxShDegree)];
  F dc[3];
  if (sh.packed()) {
    load_halves<3>(sh.sh0_half.data, 3, rows, dc);
  } else {
    const float* at[kWidth];
    for (int l = 0; l < kWidth; ++l) at[l] = sh.sh0.data + 3 * std::size_t{rows[l]};
    load_columns<3>(at, dc);
  }
  for (int k = 0; k < 3; ++k) c[k] = dc[k].v;
  const int columns = 3 * (sh_coefficient_count(degree) - 1);  // 0, 9, 24 or 45
  const BandEncoding encoding = sh.band_encoding();
  for (int first = 0; first < columns; first += kBandGroup) {
    const int from = first + kBandGroup <= columns ? first : columns - kBandGroup;
    F group[kBandGroup];
    load_bands(sh, encoding, rows, static_cast<std::size_t>(from), group);
    for (int k = 0; k < kBandGroup; ++k) c[3 + from + k] = group[k].v;
  }
  const Vec3<F> color = sh_color<F>(degree, delta, [&c](int k) noexcept {
    return Vec3<F>{F(c[3 * k]), F(c[3 * k + 1]), F(c[3 * k + 2])};
  });
  return {color.x, color.y, color.z, F(0.0f)};
}

/// Prefetches the coefficients of rows [first, first + kWidth), which color_survivors will read.
GSNAV_HD void prefetch_colors(const ColorRows& sh, std::size_t size, int degree,
                              std::size_t first) noexcept {
  constexpr std::size_t kLine = 64;
  if (degree == 0) return;
  const void* data = sh.shN.data;
  if (sh.band_encoding() == BandEncoding::codes) data = sh.shN_codes.data;
  if (sh.band_encoding() == BandEncoding::halves) data = sh.shN_half.data;
  const std::size_t stride = bytes_of(sh.band_encoding()) * sh.rest();
  const std::size_t begin = stride * first, room = stride * size - begin;
  const std::size_t rows = stride * static_cast<std::size_t>(kWidth),
                    end = begin + (rows < room ? rows : room);
  for (std::size_t i = begin; i < end; i += kLine)
    __builtin_prefetch(static_cast<const char*>(data) + i, 0, 2);
}

/// Writes the colours of the `count` survivors of a chunk to out[0], out[1], ... This runs after all
/// geometry of the chunk has been written. Coefficients are most of the data that a frame reads, and a
/// single stream reads them fastest.
GSNAV_STAGE void color_survivors(const ColorRows& sh, int degree, Survivors& s, std::size_t count,
                                 SplatColor<float>* out) noexcept {
  constexpr std::size_t step = static_cast<std::size_t>(kWidth);
  if (count == 0) return;
  for (std::size_t i = count; i % step != 0; ++i) s.rows[i] = s.rows[count - 1];
  for (std::size_t i = 0; i < count; i += step) {
    float delta[3][step];
    std::memcpy(delta[0], s.delta[0] + i, sizeof delta[0]);
    std::memcpy(delta[1], s.delta[1] + i, sizeof delta[1]);
    std::memcpy(delta[2], s.delta[2] + i, sizeof delta[2]);
    const SplatColor<F> c = gaussian_colors(sh, degree, s.rows + i,
                                            {F::load(delta[0]), F::load(delta[1]), F::load(delta[2])});
    const F columns[4] = {c.r, c.g, c.b, c.pad};
    float rows[4 * kWidth];
    store_columns<4>(columns, rows);
    const std::size_t n = count - i < step ? count - i : step;
    std::memcpy(static_cast<void*>(out + i), rows, n * sizeof(SplatColor<float>));
  }
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
