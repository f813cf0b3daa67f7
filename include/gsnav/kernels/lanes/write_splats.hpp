// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "gsnav/kernels/footprint.hpp"
#include "gsnav/kernels/lanes/color.hpp"
#include "gsnav/kernels/lanes/isa.hpp"
#include "gsnav/kernels/project_chunk.hpp"
#include "gsnav/kernels/tiles.hpp"
#include "gsnav/math/pack_double.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Half of the lanes, in double.
using D = Pack<double, kWidth / 2>;

/// kWidth projected Gaussians: lane l is row `first + l` of the set.
struct ProjectedPack {
  std::size_t first;
  const Vec3<F>& delta;       ///< mean - camera, asset frame
  const Vec3<D> (&delta64)[2];  ///< the same in double, of the lower and of the upper half of the lanes
  F key;
  const SplatAxes<F>& axes;
  const Projected<F>& splat;
};

namespace detail {

/// The reference pixel and its distance from the mean, which needs double.
struct References {
  float x[kWidth], y[kWidth], ox[kWidth], oy[kWidth];
};

GSNAV_HD void find_references(const ProjectArgs<float>& args, const ProjectedPack& pack, References& out) noexcept {
  const ProjectionCamera<double>& camera = args.camera64;
  for (int h = 0; h < 2; ++h) {
    D x, y;
    gsnav::detail::project_mean(camera, pack.delta64[h], x, y);
    const D ref_x = gsnav::detail::reference_pixel(x, camera.width);
    const D ref_y = gsnav::detail::reference_pixel(y, camera.height);
    const int first = h * (kWidth / 2);
    ref_x.store(out.x + first);
    ref_y.store(out.y + first);
    (ref_x - x).store(out.ox + first);
    (ref_y - y).store(out.oy + first);
  }
}

/// Those of `lanes` whose bounds reach an open cell.
GSNAV_HD std::uint32_t reaching_open(const OpenCells& open, F x0, F y0, F x1, F y1, std::uint32_t lanes) noexcept {
  const F inverse(1.0f / OpenCells::kSize), one(1.0f);
  float bounds[4][kWidth];
  truncated(x0 * inverse).store(bounds[0]);
  truncated(y0 * inverse).store(bounds[1]);
  (truncated((x1 - one) * inverse) + one).store(bounds[2]);
  (truncated((y1 - one) * inverse) + one).store(bounds[3]);
  std::uint32_t found = 0;
  for (std::uint32_t left = lanes; left != 0; left &= left - 1) {
    const int l = std::countr_zero(left);
    const auto cell = [&](int k) { return static_cast<std::size_t>(bounds[k][l]); };
    if (open.any(cell(0), cell(1), cell(2), cell(3))) found |= 1u << l;
  }
  return found;
}

/// A TileSpans a lane, as the four words that it lies in memory as.
struct SpanWords {
  F::ints word[4]{};
};
static_assert(sizeof(TileSpans) == 4 * sizeof(std::int32_t) && TileSpans::kRows == 5);

/// The tiles of kWidth splats, lane by lane those that for_each_tile finds; `lanes`: which are wanted.
GSNAV_HD SpanWords find_tiles(const TileGrid& grid, const SplatGeometry<F>& g, float log2_alpha_min, F x0, F y0, F x1,
                              F y1, std::uint32_t lanes) noexcept {
  const F zero(0.0f), half(0.5f), one(1.0f), size(static_cast<float>(grid.tile_size));
  const F inverse(1.0f / static_cast<float>(grid.tile_size));  // a power of two: exact
  const auto tile_of = [inverse](F pixel) noexcept { return truncated(pixel * inverse); };
  const auto whole = [](F x) noexcept { return __builtin_convertvector(x.v, F::ints); };
  const F tx0 = tile_of(x0), tx1 = tile_of(x1 - one), ty0 = tile_of(y0), ty1 = tile_of(y1 - one);
  const F rows = (ty1 - ty0) + one;
  const auto large = (rows > F(static_cast<float>(TileSpans::kRows))) ||
                     (tx1 - tx0 >= F(static_cast<float>(TileSpans::kColumns)));
  const auto single = (ty0 >= ty1) && (tx0 >= tx1);
  const std::uint32_t wanted = lanes & ~lane_bits(large || single);

  SpanWords out;
  out.word[0] = whole(ty0) * grid.columns + whole(tx0);
  out.word[1] = whole(select(large, F(static_cast<float>(TileSpans::kLarge)), rows));
  F begin = zero, end = one;  // of a single tile
  if (wanted != 0) {
    const FootprintStrips<F> footprint(g, log2_alpha_min, x0 + half, x1 - half, y0 + half, y1 - half);
    F top = ty0 * size;
    for (int r = 0; r < TileSpans::kRows; ++r) {
      if ((lane_bits(F(static_cast<float>(r)) < rows) & wanted) == 0) break;
      const F next = top + size;
      F left, right;
      const auto covered = footprint.columns(max(top, y0) + half, (min(next, y1) - one) + half, left, right);
      // The padding of left and right is more than what rounding to a pixel may lose.
      const F first = tile_of(clamp(left + half, x0, x1)), edge = truncated(clamp(right + half, x0, x1)) - one;
      const F last = tile_of(edge);
      // Between two columns of centres a strip may have none: edge < x0, or first behind last.
      const auto none = !(covered && (edge >= x0) && (first <= last) && (F(static_cast<float>(r)) < rows));
      begin = select(none, zero, first - tx0);
      end = select(none, zero, (last - tx0) + one);
      if (r == 0) {
        begin = select(single, zero, begin);
        end = select(single, one, end);
      }
      const F::ints b = whole(begin), e = whole(end);
      // Bytes 5 + 2 r and 6 + 2 r of the sixteen.
      out.word[(5 + 2 * r) / 4] |= b << (8 * ((5 + 2 * r) % 4));
      out.word[(6 + 2 * r) / 4] |= e << (8 * ((6 + 2 * r) % 4));
      top = next;
    }
  } else {
    out.word[1] |= whole(begin) << 8 | whole(end) << 16;
  }
  return out;
}

/// Copies a record that is N floats, or as large.
template <int N, class T>
GSNAV_HD void copy_record(T& record, const float* from) noexcept {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) == N * sizeof(float));
  std::memcpy(static_cast<void*>(&record), from, sizeof(T));
}

GSNAV_HD F as_floats(F::ints x) noexcept { return F(gsnav::detail::floats<kWidth>(x)); }

}  // namespace detail

/// Writes the survivors `bits` of a pack, in row order, behind the `count` that their chunk has from slot
/// `base` on: the bits of write_splat, but for colours, which `survivors` are left to. Returns how many had a
/// pixel centre in their bounds. Contract only: Response::ewa, Compat::none.
GSNAV_HD std::uint32_t write_splats(const ProjectArgs<float>& args, std::size_t base, std::size_t count,
                                    const ProjectedPack& pack, std::uint32_t bits,
                                    Survivors& survivors) noexcept {
  const std::size_t slot = base + count;
  const GaussianView& gs = args.gaussians;
  const ProjectionCamera<float>& camera = args.camera;
  const Projected<F>& p = pack.splat;
  F x0, y0, x1, y1;
  gsnav::detail::pixel_range(p.center_x, p.half_width, camera.width, x0, x1);
  gsnav::detail::pixel_range(p.center_y, p.half_height, camera.height, y0, y1);
  // Those whose geometry float cannot hold are few: each goes its own way.
  const std::uint32_t alone = lane_bits(gsnav::detail::needs_double(camera, p)) & bits;
  bits &= lane_bits((x0 < x1) && (y0 < y1)) | alone;
  if (!args.open.empty()) bits &= detail::reaching_open(args.open, x0, y0, x1, y1, bits) | alone;
  if (bits == 0) return 0;
  if (args.color) prefetch_colors(gs, gs.degree_of(pack.first, args.sh_degree), pack.first);

  detail::References refs;
  detail::find_references(args, pack, refs);
  const F ox = F::load(refs.ox), oy = F::load(refs.oy);
  const SplatGeometry<F> g{F::load(refs.x), F::load(refs.y), p.a, p.k, p.b, p.a * ox, fma(p.k, ox, p.b * oy),
                           p.log2_opacity};

  // Records side by side in lanes become one after the other in memory.
  alignas(64) float geometry[kWidth * 8], bounds[kWidth * 8], depths[2][kWidth * 8];
  {
    const F columns[8] = {g.ref_x, g.ref_y, g.a, g.k, g.b, g.w1, g.w2, g.log2_opacity};
    store_columns<8>(columns, geometry);
  }
  {
    const auto whole = [](F x) noexcept { return detail::as_floats(__builtin_convertvector(x.v, F::ints)); };
    detail::SpanWords spans;
    if (!args.spans.empty()) {
      spans = detail::find_tiles(args.grid, g, camera.log2_alpha_min, x0, y0, x1, y1, bits & ~alone);
    }
    const F columns[8] = {whole(x0), whole(y0), whole(x1), whole(y1), detail::as_floats(spans.word[0]),
                          detail::as_floats(spans.word[1]), detail::as_floats(spans.word[2]),
                          detail::as_floats(spans.word[3])};
    store_columns<8>(columns, bounds);
  }
  if (args.depth) {
    const SplatDepth<F> d = make_splat_depth(camera, pack.axes, p);
    const F low[8] = {d.mean_x, d.mean_y, d.z, d.reach, d.g[0], d.g[1], d.g[2], d.gx[0]};
    const F high[8] = {d.gx[1], d.gx[2], d.gy[0], d.gy[1], d.gy[2], F(0.0f), F(0.0f), F(0.0f)};
    store_columns<8>(low, depths[0]);
    store_columns<8>(high, depths[1]);
  }
  std::uint32_t rows[kWidth], keys[kWidth], ranks[kWidth];
  float key[kWidth];
  pack.key.store(key);
  for (int l = 0; l < kWidth; ++l) keys[l] = camera.key_code(key[l]);
  const std::uint32_t first = static_cast<std::uint32_t>(pack.first), last = static_cast<std::uint32_t>(gs.size - 1);
  for (std::uint32_t l = 0; l < static_cast<std::uint32_t>(kWidth); ++l) rows[l] = first + l;
  for (int l = 0; l < kWidth; ++l) ranks[l] = args.first_rank + rows[l];
  if (!gs.row_ids.empty() && !args.ranks.empty()) {
    for (int l = 0; l < kWidth; ++l) ranks[l] = args.first_rank + gs.row_ids[rows[l] < last ? rows[l] : last];
  }

  std::uint32_t written = 0, kept = 0;
  for (std::uint32_t left = bits; left != 0; left &= left - 1) {
    const std::size_t l = static_cast<std::size_t>(std::countr_zero(left)), at = slot + written;
    if ((alone >> l & 1u) != 0) {
      if (!project_gaussian(args, at, rows[l])) continue;
    } else {
      detail::copy_record<8>(args.geometry[at], geometry + 8 * l);
      detail::copy_record<4>(args.bounds[at], bounds + 8 * l);
      if (!args.spans.empty()) detail::copy_record<4>(args.spans[at], bounds + 8 * l + 4);
      if (args.depth) {
        float both[13];
        std::memcpy(both, depths[0] + 8 * l, 8 * sizeof(float));
        std::memcpy(both + 8, depths[1] + 8 * l, 5 * sizeof(float));
        detail::copy_record<13>(args.depths[at], both);
      }
    }
    kept |= 1u << l;
    ++written;
  }
  store_lanes(kept, keys, args.keys.data + slot);
  if (!args.ranks.empty()) store_lanes(kept, ranks, args.ranks.data + slot);
  if (args.color) {
    store_lanes(kept, rows, survivors.rows + count);
    const F planes[3] = {pack.delta.x, pack.delta.y, pack.delta.z};
    for (int k = 0; k < 3; ++k) {
      std::uint32_t lanes[kWidth];
      std::memcpy(lanes, &planes[k].v, sizeof lanes);
      store_lanes(kept, lanes, survivors.delta[k] + count);
    }
  }
  return written;
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
