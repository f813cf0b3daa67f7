// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "gsnav/detail/frame/footprint.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/squares.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/lanes/color.hpp"
#include "gsnav/detail/lanes/isa.hpp"
#include "gsnav/detail/math/pack_double.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// kWidth projected Gaussians. Lane l is row `first + l` of the set.
struct ProjectedPack {
  std::size_t first;
  const RowKey<F>& key;
  const ProjectedRow<F>& projected;
};

namespace detail {

/// The lanes of `lanes` whose bounds reach an open square, as bits.
GSNAV_HD std::uint32_t reaching_open(const OpenSquares& open, const PixelBox<F>& box,
                                     std::uint32_t lanes) noexcept {
  const F inverse(1.0f / static_cast<float>(open.size)), one(1.0f);
  float bounds[4][kWidth];
  truncated(box.x0 * inverse).store(bounds[0]);
  truncated(box.y0 * inverse).store(bounds[1]);
  (truncated((box.x1 - one) * inverse) + one).store(bounds[2]);
  (truncated((box.y1 - one) * inverse) + one).store(bounds[3]);
  std::uint32_t found = 0;
  for (std::uint32_t left = lanes; left != 0; left &= left - 1) {
    const int l = std::countr_zero(left);
    const auto corner = [&](int k) { return static_cast<std::size_t>(bounds[k][l]); };
    if (open.any(corner(0), corner(1), corner(2), corner(3))) found |= 1u << l;
  }
  return found;
}

/// One TileWord and one TileSpans per lane, the latter as the four words that it consists of.
struct SpanWords {
  F::ints tile_word{};
  F::ints word[4]{};
};
static_assert(sizeof(TileSpans) == 4 * sizeof(std::int32_t) && TileSpans::kRows == 5);

GSNAV_HD F as_floats(F::ints x) noexcept { return F(gsnav::detail::floats<kWidth>(x)); }

/// Finds the tiles of kWidth splats, one splat per lane. They are the tiles that for_each_tile() finds.
/// `lanes` has the bits of the lanes that are needed; the words of the others mean nothing.
GSNAV_HD SpanWords find_tiles(const TileGrid& grid, const SplatGeometry<F>& g, float log2_alpha_min,
                              const PixelBox<F>& box, std::uint32_t lanes) noexcept {
  const F zero(0.0f), one(1.0f), size(static_cast<float>(grid.tile_size));
  const F inverse(1.0f / static_cast<float>(grid.tile_size));  // a power of two, so products are exact
  const auto tile_of = [inverse](F pixel) noexcept { return truncated(pixel * inverse); };
  const auto whole = [](F x) noexcept { return __builtin_convertvector(x.v, F::ints); };
  const TileRange<F> tiles = TileRange<F>::of(box, tile_of);
  const F rows = (tiles.y1 - tiles.y0) + one;
  const auto large = (rows > F(static_cast<float>(TileSpans::kRows))) ||
                     (tiles.x1 - tiles.x0 >= F(static_cast<float>(TileSpans::kColumns)));
  const auto single = tiles.single();
  const std::uint32_t wanted = lanes & ~lane_bits(large || single);

  SpanWords out;
  out.word[0] = whole(tiles.y0) * grid.columns + whole(tiles.x0);
  F mask = zero;
  const auto power = [](F::ints x) noexcept { return as_floats((x + 127) << 23); };  // 2^x
  out.word[1] = whole(select(large, F(static_cast<float>(TileSpans::kLarge)), rows));
  F begin = zero, end = one;  // for a single tile
  if (wanted != 0) {
    const FootprintStrips<F> footprint(g, log2_alpha_min, box);
    F top = tiles.y0 * size;
    for (int r = 0; r < TileSpans::kRows; ++r) {
      if ((lane_bits(F(static_cast<float>(r)) < rows) & wanted) == 0) break;
      const F next = top + size;
      const PixelColumns<F> pixels = footprint.pixels(box, top, next);
      const TileColumns<F> reached = TileColumns<F>::of(pixels, tile_of);
      const auto has_any = pixels.any && (F(static_cast<float>(r)) < rows);
      begin = select(has_any, reached.first - tiles.x0, zero);
      end = select(has_any, (reached.last - tiles.x0) + one, zero);
      if (r == 0) {
        begin = select(single, zero, begin);
        end = select(single, one, end);
      }
      const F::ints b = whole(begin), e = whole(end);
      if (r < TileWord::kSide) {  // the bits of columns [begin, end)
        mask = fma(F(static_cast<float>(1 << (r * TileWord::kSide))), power(e) - power(b), mask);
      }
      // Bytes 5 + 2 r and 6 + 2 r of the 16 bytes of a TileSpans.
      out.word[(5 + 2 * r) / 4] |= b << (8 * ((5 + 2 * r) % 4));
      out.word[(6 + 2 * r) / 4] |= e << (8 * ((6 + 2 * r) % 4));
      top = next;
    }
  } else {
    out.word[1] |= whole(begin) << 8 | whole(end) << 16;
    mask = one;
  }
  const F side(static_cast<float>(TileWord::kSide));
  const auto in_square = (rows <= side) && (tiles.x1 - tiles.x0 < side);
  out.tile_word = out.word[0] << TileWord::kMaskBits | whole(select(in_square, mask, zero));
  return out;
}

/// Copies N floats to a record of the same size.
template <int N, class T>
GSNAV_HD void copy_record(T& record, const float* from) noexcept {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) == N * sizeof(float));
  std::memcpy(static_cast<void*>(&record), from, sizeof(T));
}

/// Writes bounds and tile spans of kWidth splats, eight words per splat.
GSNAV_HD void store_bounds(const PixelBox<F>& box, const SpanWords& spans, float* to) noexcept {
  const auto whole = [](F x) noexcept { return as_floats(__builtin_convertvector(x.v, F::ints)); };
  const F columns[8] = {whole(box.x0),
                        whole(box.y0),
                        whole(box.x1),
                        whole(box.y1),
                        as_floats(spans.word[0]),
                        as_floats(spans.word[1]),
                        as_floats(spans.word[2]),
                        as_floats(spans.word[3])};
  store_columns<8>(columns, to);
}

/// Writes the ranks of the lanes `kept` to out[0], out[1], ... Lane l is row `first + l`.
GSNAV_HD void store_ranks(const ViewedSet<float>& args, std::size_t first, std::uint32_t kept,
                          std::uint32_t* out) noexcept {
  constexpr std::size_t n = static_cast<std::size_t>(kWidth);
  const std::size_t size = args.gaussians.size();
  std::uint32_t ranks[kWidth];
  if (first + n <= size && !args.gaussians.row_ids.empty()) {  // ids that follow each other in memory
    std::memcpy(ranks, args.gaussians.row_ids.data + first, sizeof ranks);
    for (std::size_t l = 0; l < n; ++l) ranks[l] = args.rank_of_id(ranks[l]);
  } else {
    for (std::size_t l = 0; l < n; ++l)
      ranks[l] = args.rank_of(static_cast<std::uint32_t>(first + l < size ? first + l : size - 1));
  }
  store_lanes(kept, ranks, out);
}

/// Appends the lanes `kept` to the `count` survivors that color_survivors will colour.
GSNAV_HD void keep_survivors(std::uint32_t kept, const std::uint32_t (&rows)[kWidth],
                             const Vec3<F>& delta, std::size_t count, Survivors& survivors) noexcept {
  store_lanes(kept, rows, survivors.rows + count);
  const F planes[3] = {delta.x, delta.y, delta.z};
  for (int k = 0; k < 3; ++k) {
    std::uint32_t lanes[kWidth];
    std::memcpy(lanes, &planes[k].v, sizeof lanes);
    store_lanes(kept, lanes, survivors.delta[k] + count);
  }
}

/// Projects one row by itself, in double where needed.
GSNAV_STAGE bool project_alone(const ViewedSet<float>& args, const ProjectOutputs<float>& out,
                               std::size_t slot, std::size_t row) noexcept {
  return project_gaussian(args, out, slot, row);
}

}  // namespace detail

/// Writes the rows in `bits` of a pack, in row order, after the `count` splats that their chunk already
/// has from slot `base` on. The bits equal those of write_splat, except colours, which are left to
/// `survivors`. Only for Response::ewa and Compat::none.
/// @return the number of rows with a pixel centre in their bounds
GSNAV_STAGE std::uint32_t write_splats(const ViewedSet<float>& args, const ProjectOutputs<float>& out,
                                       std::size_t base, std::size_t count, const ProjectedPack& pack,
                                       std::uint32_t bits, Survivors& survivors) noexcept {
  const std::size_t slot = base + count;
  const GaussianRows& gs = args.gaussians;
  const ProjectionCamera<float>& camera = args.camera;
  const Projected<F>& p = pack.projected.splat;
  const PixelBox<F> box = gsnav::detail::pixel_box(camera, p);
  // Few rows are too inexact in float. Each of them is projected alone.
  const std::uint32_t needs_double = lane_bits(gsnav::detail::needs_double(camera, p)) & bits;
  bits &= lane_bits(box.any_pixel()) | needs_double;
  if (!out.open.empty()) bits &= detail::reaching_open(out.open, box, bits) | needs_double;
  if (bits == 0) return 0;
  const bool color = !out.colors.empty(), depth = !out.depths.empty();
  if (color) {
    prefetch_colors(gs.color, gs.size(), gs.color.degree_of(pack.first, args.sh_degree), pack.first);
  }

  const auto mean = gsnav::detail::project_mean(args.camera64, pack.key.delta64);
  const SplatGeometry<F> g =
      splat_geometry(p, reference_of<F>(camera.width, camera.height, mean.x, mean.y));

  // Transpose the records from lanes to consecutive memory.
  alignas(64) float geometry[kWidth * 8], bounds[kWidth * 8], depths[2][kWidth * 8];
  std::uint32_t words[kWidth];
  {
    const F columns[8] = {g.ref_x, g.ref_y, g.a, g.k, g.b, g.w1, g.w2, g.log2_opacity};
    store_columns<8>(columns, geometry);
  }
  {
    detail::SpanWords spans;
    if (!out.spans.empty()) {
      spans = detail::find_tiles(out.grid, g, camera.log2_alpha_min, box, bits & ~needs_double);
    }
    detail::store_bounds(box, spans, bounds);
    std::memcpy(words, &spans.tile_word, sizeof words);
  }
  if (depth) {
    const SplatDepth<F> d = make_splat_depth(camera, pack.projected.axes, p);
    const F low[8] = {d.mean_x, d.mean_y, d.z, d.reach, d.g[0], d.g[1], d.g[2], d.gx[0]};
    const F high[8] = {d.gx[1], d.gx[2], d.gy[0], d.gy[1], d.gy[2], F(0.0f), F(0.0f), F(0.0f)};
    store_columns<8>(low, depths[0]);
    store_columns<8>(high, depths[1]);
  }
  std::uint32_t rows[kWidth], keys[kWidth];
  float key[kWidth];
  sort_key(args.camera64, pack.key).store(key);
  for (int l = 0; l < kWidth; ++l) keys[l] = camera.key_code(key[l]);
  const std::uint32_t first = static_cast<std::uint32_t>(pack.first);
  for (std::uint32_t l = 0; l < static_cast<std::uint32_t>(kWidth); ++l) rows[l] = first + l;

  std::uint32_t written = 0, kept = 0;
  for (std::uint32_t left = bits; left != 0; left &= left - 1) {
    const std::size_t l = static_cast<std::size_t>(std::countr_zero(left)), at = slot + written;
    if ((needs_double >> l & 1u) != 0) {
      if (!detail::project_alone(args, out, at, rows[l])) continue;
      words[l] = 0;
    } else {
      detail::copy_record<8>(out.geometry[at], geometry + 8 * l);
      detail::copy_record<4>(out.bounds[at], bounds + 8 * l);
      if ((words[l] & TileWord::kMask) == 0 && !out.spans.empty())
        detail::copy_record<4>(out.spans[at], bounds + 8 * l + 4);
      if (depth) {
        // With one copy of the last 5 floats, g++ 12 copies the record through the stack, and a load
        // waits there for two smaller stores.
        char* const to = reinterpret_cast<char*>(&out.depths[at]);
        std::memcpy(to, depths[0] + 8 * l, 8 * sizeof(float));
        std::memcpy(to + 8 * sizeof(float), depths[1] + 8 * l, 4 * sizeof(float));
        std::memcpy(to + 12 * sizeof(float), depths[1] + 8 * l + 4, sizeof(float));
      }
    }
    kept |= 1u << l;
    ++written;
  }
  store_lanes(kept, keys, out.keys.data + slot);
  if (!out.words.empty()) store_lanes(kept, words, out.words.data + slot);
  if (!out.ranks.empty()) detail::store_ranks(args, pack.first, kept, out.ranks.data + slot);
  if (color) detail::keep_survivors(kept, rows, pack.key.delta, count, survivors);
  return written;
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
