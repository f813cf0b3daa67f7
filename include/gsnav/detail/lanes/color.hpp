// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/set_rows.hpp"
#include "gsnav/detail/lanes/isa.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Visible Gaussians of one chunk, in row order: row, and mean - camera in the asset frame.
struct Survivors {
  static constexpr std::size_t kRoom = kProjectChunk + static_cast<std::size_t>(kWidth);
  std::uint32_t rows[kRoom];
  std::uint32_t delta[3][kRoom];  ///< bit patterns of floats
};

/// Colours of kWidth Gaussians of one chunk, with the bits of gaussian_color. Lane l is row rows[l].
/// Coefficients are stored by rows; groups of 8 columns are transposed into lanes as they are loaded.
GSNAV_HD SplatColor<F> gaussian_colors(const ColorRows& sh, int degree, const std::uint32_t* rows,
                                       Vec3<F> delta) noexcept {
  constexpr int kGroup = 8;
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
  const float* at[kWidth];
  float widened[kWidth][kGroup];
  const bool packed = sh.packed();
  for (int l = 0; l < kWidth; ++l) {
    const std::size_t row = rows[l];
    if (packed) {
      for (std::size_t k = 0; k < 3; ++k) widened[l][k] = sh_value(sh.sh0_half[3 * row + k]);
    }
    at[l] = packed ? widened[l] : sh.sh0.data + 3 * row;
  }
  F dc[3];
  load_columns<3>(at, dc);
  for (int k = 0; k < 3; ++k) c[k] = dc[k].v;
  const std::size_t stride = sh.rest();
  const int columns = 3 * (sh_coefficient_count(degree) - 1);  // 0, 9, 24 or 45
  const BandEncoding encoding = sh.band_encoding();
  for (int first = 0; first < columns; first += kGroup) {
    const int from = first + kGroup <= columns ? first : columns - kGroup;
    if (encoding == BandEncoding::codes) {  // all rows belong to the same chunk
      float steps[kGroup];
      const PackedChunk& chunk = sh.chunks[rows[0] / kProjectChunk];
      for (int k = 0; k < kGroup; ++k) steps[k] = chunk.sh_steps[packed_band(1 + (from + k) / 3)];
      for (int l = 0; l < kWidth; ++l) {
        const std::int8_t* codes = sh.shN_codes.data + stride * rows[l] + from;
        for (int k = 0; k < kGroup; ++k) widened[l][k] = sh_value(codes[k], steps[k]);
        at[l] = widened[l];
      }
    } else if (encoding == BandEncoding::floats) {
      for (int l = 0; l < kWidth; ++l) at[l] = sh.shN.data + stride * rows[l] + from;
    } else {
      for (int l = 0; l < kWidth; ++l) {
        const std::uint16_t* halves = sh.shN_half.data + stride * rows[l] + from;
        for (int k = 0; k < kGroup; ++k) widened[l][k] = sh_value(halves[k]);
        at[l] = widened[l];
      }
    }
    F group[kGroup];
    load_columns<kGroup>(at, group);
    for (int k = 0; k < kGroup; ++k) c[3 + from + k] = group[k].v;
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
