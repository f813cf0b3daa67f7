// SPDX-License-Identifier: Apache-2.0
// Loops that bound the blending of a frame: they find the blocks that an ellipse reaches, and blend
// them.
#include <memory>
#include <utility>

#include "floor_loops.hpp"
#include "gsnav/core/rng.hpp"
#include "native_loop.hpp"

namespace gsnav_bench {

namespace {

using gsnav::Rng;
using Ints = F::ints;
#if defined(__AVX512F__)
constexpr __mmask16 kAll = 0xffff;  // g++ 12 warns of the unmasked forms' undefined source
#endif

/// Square root to at least 14 bits, which is enough for a footprint that is padded by a thousandth of a
/// pixel.
F root(F x) noexcept {
#if defined(__AVX512F__)
  if constexpr (kLanes == 16) {
    const F v = gsnav::max(x, F(1e-20f));
    return v *
           F(reinterpret_cast<F::vector>(_mm512_maskz_rsqrt14_ps(kAll, reinterpret_cast<__m512>(v.v))));
  }
#endif
  return gsnav::sqrt(gsnav::max(x, F(0.0f)));
}

Ints whole(F x) noexcept { return __builtin_convertvector(x.v, Ints); }

/// Ellipses of many pairs (splat, tile) by planes, relative to the tile's corner. Planes: mean, half
/// width, height at which the right edge is farthest, 1 / half height, slope of the middle line.
struct Ellipses {
  const float *x, *y, *half_width, *widest, *inv_height, *slope;
};

/// Masks of kLanes ellipses: each has one bit for each 4x4 block of a 16x16 tile that the ellipse
/// reaches.
Ints block_masks(const Ellipses& e, std::size_t i) noexcept {
  const F x = F::load(e.x + i), y = F::load(e.y + i), half = F::load(e.half_width + i);
  const F widest = F::load(e.widest + i), inv = F::load(e.inv_height + i), slope = F::load(e.slope + i);
  const Ints one = Ints{} + 1;
  Ints masks{};
  for (int strip = 0; strip < 4; ++strip) {
    const float first = 4.0f * static_cast<float>(strip) + 0.5f;
    const F low = F(first) - y, high = F(first + 3.0f) - y;  // rows of pixel centres
    // The right edge is farthest at `widest` and the left one at -widest; both are clamped to the strip.
    const auto edge = [&](F at) {
      const F n = at * inv;
      return std::pair<F, F>(half * root(fma(-n, n, F(1.0f))), fma(slope, at, x));
    };
    const auto [right_half, right_mid] = edge(gsnav::clamp(widest, low, high));
    const auto [left_half, left_mid] = edge(gsnav::clamp(-widest, low, high));
    // Block c holds the centres 4c + 0.5 to 4c + 3.5. Values are shifted by 4 so that truncation rounds
    // down.
    const F begin = gsnav::clamp(fma(left_mid - left_half, F(0.25f), F(1.125f)), F(1.0f), F(5.0f));
    const F reached = gsnav::clamp(fma(right_mid + right_half, F(0.25f), F(0.875f)), F(0.0f), F(4.0f));
    const F nearest = gsnav::clamp(F(0.0f), low, high) * inv;  // the strip's row nearest to the mean
    const F end = select(nearest * nearest <= F(1.0f), reached, F(0.0f));
    const Ints row = ((one << whole(end)) - 1) & -(one << (whole(begin) - 1));
    masks |= row << (4 * strip);
  }
  return masks;
}

}  // namespace

double measure_mask_ns() {
  constexpr std::size_t kPairs = 1024;  // in the first-level cache, like the batch of a tile
  const std::unique_ptr<float[]> planes(new float[6 * kPairs]);
  const std::unique_ptr<std::int32_t[]> masks(new std::int32_t[kPairs]);
  Rng rng(3);
  for (std::size_t i = 0; i < kPairs; ++i) {
    const double values[6] = {rng.uniform(0, 16), rng.uniform(0, 16),    rng.uniform(1, 6),
                              rng.uniform(-2, 2), rng.uniform(0.2, 1.0), rng.uniform(-1, 1)};
    for (std::size_t k = 0; k < 6; ++k) planes[k * kPairs + i] = static_cast<float>(values[k]);
  }
  const float* p = planes.get();
  const Ellipses ellipses{p, p + kPairs, p + 2 * kPairs, p + 3 * kPairs, p + 4 * kPairs, p + 5 * kPairs};
  constexpr int kRounds = 64;
  const double ns = best_ns(40, [&] {
    for (int r = 0; r < kRounds; ++r) {
      for (std::size_t i = 0; i < kPairs; i += kLanes) {
        const Ints m = block_masks(ellipses, i);
        __builtin_memcpy(masks.get() + i, &m, sizeof m);
      }
      keep(masks);
    }
  });
  return ns / static_cast<double>(kPairs * kRounds);
}

namespace {

/// The data of a splat that blending reads, relative to its block: half a cache line, and the colour.
struct alignas(64) BlockSplat {
  float a, w1, k, b, w2, log2_opacity, r, g, blue;
};

/// alpha = 2^e by a cubic polynomial; zero below log2(1/255).
F alpha_of(F e) noexcept {
  const auto hit = e >= F(-7.9943534f);
#if defined(__AVX512DQ__)
  if constexpr (kLanes == 16) {
    // 2^f for f = e - floor(e) by a cubic polynomial (relative error 1e-4), scaled by 2^floor(e).
    const __m512 v = reinterpret_cast<__m512>(e.v);
    const F f(reinterpret_cast<F::vector>(_mm512_maskz_reduce_ps(kAll, v, 0x01)));
    F p = fma(f, F(0.078967257f), F(0.22469316f));
    p = fma(f, p, F(0.69632477f));
    p = fma(f, p, F(0.99990029f));
    const __m512 scaled = _mm512_maskz_scalef_ps(kAll, reinterpret_cast<__m512>(p.v), v);
    return F(reinterpret_cast<F::vector>(_mm512_maskz_min_ps(hit.v, scaled, _mm512_set1_ps(0.99f))));
  }
#endif
  const F t = e + F(gsnav::detail::kRoundMagic);
  const F p = gsnav::detail::exp2_degree3(e - (t - F(gsnav::detail::kRoundMagic)));
  const F alpha(gsnav::detail::floats<kLanes>(gsnav::detail::bits<kLanes>(p.v) +
                                              (gsnav::detail::bits<kLanes>(t.v) << 23)));
  return select(hit, gsnav::min(alpha, F(0.99f)), F(0.0f));
}

/// Blends splats onto one block of 8x8 pixels. A pack holds rows of eight columns, or half a row. The
/// first square of the exponent depends only on the column, so that all packs of a splat share it.
template <bool Color>
void blend_block(const BlockSplat* splats, std::size_t n, float* out) noexcept {
  constexpr int kPacks = 64 / kLanes, kColumnPacks = kLanes < 8 ? 8 / kLanes : 1;
  constexpr int kRowsPerPack = kLanes > 8 ? kLanes / 8 : 1;
  float xs[kColumnPacks][kLanes], ys[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    ys[l] = static_cast<float>(l / 8);
    for (int c = 0; c < kColumnPacks; ++c) xs[c][l] = static_cast<float>(c * kLanes + l % 8);
  }
  F x[kColumnPacks];
  for (int c = 0; c < kColumnPacks; ++c) x[c] = F::load(xs[c]);
  const F y = F::load(ys);
  F t[kPacks], r[kPacks], g[kPacks], b[kPacks];
  for (int p = 0; p < kPacks; ++p) t[p] = F(1.0f);
  for (std::size_t i = 0; i < n; ++i) {
    const BlockSplat& s = splats[i];
    F column[kColumnPacks], w2[kColumnPacks];
    for (int c = 0; c < kColumnPacks; ++c) {
      const F w1 = fma(x[c], F(s.a), F(s.w1));
      column[c] = fma(-w1, w1, F(s.log2_opacity));
      w2[c] = fma(x[c], F(s.k), fma(y, F(s.b), F(s.w2)));
    }
    const F down(s.b * static_cast<float>(kRowsPerPack));
#pragma GCC unroll 16
    for (int p = 0; p < kPacks; ++p) {
      const int c = p % kColumnPacks;
      const F weight = alpha_of(fma(-w2[c], w2[c], column[c])) * t[p];
      w2[c] = w2[c] + down;
      t[p] = t[p] - weight;
      if constexpr (Color) {
        r[p] = fma(weight, F(s.r), r[p]);
        g[p] = fma(weight, F(s.g), g[p]);
        b[p] = fma(weight, F(s.blue), b[p]);
      }
    }
  }
  F sum;
  for (int p = 0; p < kPacks; ++p) sum = sum + (t[p] + r[p]) + (g[p] + b[p]);
  sum.store(out);
}

template <bool Color>
double fragment_ns() {
  constexpr std::size_t kSplats = 256;
  const std::unique_ptr<BlockSplat[]> splats(new BlockSplat[kSplats]);
  Rng rng(4);
  const auto value = [&](double low, double high) { return static_cast<float>(rng.uniform(low, high)); };
  for (std::size_t i = 0; i < kSplats; ++i) {
    splats[i] = {value(0.1, 0.3), value(-1, 0), value(-0.1, 0.1), value(0.1, 0.3), value(-1, 0),
                 value(-6, -4),   value(0, 1),  value(0, 1),      value(0, 1)};
  }
  float out[kLanes];
  constexpr int kRounds = 100;
  const double ns = best_ns(40, [&] {
    for (int i = 0; i < kRounds; ++i) {
      blend_block<Color>(splats.get(), kSplats, out);
      keep(out);
    }
  });
  return ns / (64.0 * kSplats * kRounds);
}

}  // namespace

double measure_fragment_ns(bool color) { return color ? fragment_ns<true>() : fragment_ns<false>(); }

}  // namespace gsnav_bench
