// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/core/parallel.hpp"
#include "gsnav/detail/frame/depth.hpp"
#include "gsnav/detail/frame/footprint.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Rectangle of tiles, inclusive at both ends. L is int, or a lane type that holds integers.
template <class L>
struct TileRange {
  L x0, y0, x1, y1;

  /// Tiles that contain the non-empty box of pixels [x0, x1) x [y0, y1). `tile_of` maps a pixel
  /// coordinate to a tile.
  template <class Box, class F>
  GSNAV_HD static TileRange of(const Box& box, const F& tile_of) noexcept {
    const L one(1);
    return {tile_of(box.x0), tile_of(box.y0), tile_of(box.x1 - one), tile_of(box.y1 - one)};
  }
  GSNAV_HD mask_of<L> single() const noexcept { return x0 >= x1 && y0 >= y1; }
  /// True if it has more than `n` columns or rows.
  GSNAV_HD bool exceeds(int n) const noexcept { return x1 - x0 >= n || y1 - y0 >= n; }
};

/// Columns of tiles, inclusive at both ends, that contain the pixels of a strip. The strip has some.
/// `tile_of` is that of TileRange.
template <class T>
struct TileColumns {
  T first, last;

  template <class L, class F>
  GSNAV_HD static TileColumns of(const PixelColumns<L>& pixels, const F& tile_of) noexcept {
    return {tile_of(pixels.first), tile_of(pixels.end - L(scalar_of<L>(1)))};
  }
};

/// Division of an image into square tiles.
struct TileGrid {
  int width = 0, height = 0;  ///< image, pixels
  int tile_size = 16;
  int columns = 0, rows = 0;

  static TileGrid of(int width, int height, int tile_size) noexcept {
    return {width, height, tile_size, (width + tile_size - 1) / tile_size,
            (height + tile_size - 1) / tile_size};
  }
  /// log2 of tile_size.
  GSNAV_HD int tile_shift() const noexcept { return tile_size == 8 ? 3 : tile_size == 16 ? 4 : 5; }
  GSNAV_HD std::size_t count() const noexcept {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  /// Index of the tile that contains a pixel.
  GSNAV_HD std::size_t tile_of(int x, int y) const noexcept {
    return static_cast<std::size_t>(y / tile_size) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(x / tile_size);
  }
  /// Pixels of a tile that lie in the image, as a half-open box.
  GSNAV_HD SplatBounds pixels_of(std::size_t tile) const noexcept {
    const int x = static_cast<int>(tile % static_cast<std::size_t>(columns)) * tile_size;
    const int y = static_cast<int>(tile / static_cast<std::size_t>(columns)) * tile_size;
    return {x, y, min(x + tile_size, width), min(y + tile_size, height)};
  }
  /// Tiles that contain a non-empty box of pixels (SplatBounds, MeshTriangle).
  template <class Box>
  GSNAV_HD TileRange<int> tiles_of(const Box& box) const noexcept {
    const int shift = tile_shift();
    return TileRange<int>::of(box, [shift](int pixel) GSNAV_INLINED { return pixel >> shift; });
  }
  /// Tiles that bounds in pixels (ChunkExtent) reach, or the nearest ones if they lie outside the image.
  template <class Extent>
  GSNAV_HD TileRange<int> tiles_near(const Extent& e) const noexcept {
    const auto tile = [this](double pixel, int tiles) GSNAV_INLINED {
      return static_cast<int>(clamp(pixel / tile_size, 0.0, static_cast<double>(tiles - 1)));
    };
    return {tile(e.x0, columns), tile(e.y0, rows), tile(e.x1, columns), tile(e.y1, rows)};
  }
  bool operator==(const TileGrid&) const = default;
};

/// Calls f(row, first, last), columns inclusive, for each row of tiles that a splat may touch, in order.
/// `elliptic` is true if the footprint is the ellipse of its geometry (not under perspective). Tiles of
/// its bounds outside the ellipse are then skipped.
template <class S, class F>
GSNAV_HD void for_each_tile_row(const TileGrid& grid, const SplatGeometry<S>& g, const SplatBounds& b,
                                S log2_alpha_min, bool elliptic, const F& f) noexcept {
  const int shift = grid.tile_shift(), ts = grid.tile_size;
  const TileRange<int> tiles = grid.tiles_of(b);
  if (tiles.single()) {
    f(tiles.y0, tiles.x0, tiles.x0);
    return;
  }
  const PixelBox<S> box = PixelBox<S>::of(b);
  const FootprintStrips<S> footprint(g, log2_alpha_min, box);
  for (int ty = tiles.y0; ty <= tiles.y1; ++ty) {
    TileColumns<int> reached{tiles.x0, tiles.x1};
    if (elliptic) {
      const PixelColumns<S> pixels = footprint.pixels(box, S(ty * ts), S((ty + 1) * ts));
      if (!pixels.any) continue;
      reached = TileColumns<int>::of(
          pixels, [shift](S pixel) GSNAV_INLINED { return static_cast<int>(pixel) >> shift; });
    }
    f(ty, reached.first, reached.last);
  }
}

/// Calls f(tile) for each tile that a splat may touch, in row order. Arguments as above.
template <class S, class F>
GSNAV_HD void for_each_tile(const TileGrid& grid, const SplatGeometry<S>& g, const SplatBounds& b,
                            S log2_alpha_min, bool elliptic, const F& f) noexcept {
  for_each_tile_row(
      grid, g, b, log2_alpha_min, elliptic, [&](int ty, int first, int last) GSNAV_INLINED {
        const std::size_t row = static_cast<std::size_t>(ty) * static_cast<std::size_t>(grid.columns);
        for (int tx = first; tx <= last; ++tx) f(row + static_cast<std::size_t>(tx));
      });
}

/// Compact list of the tiles of a splat that covers few. `tile` is the top left one. Row r of tiles has
/// the columns [columns[r][0], columns[r][1]), counted from it; unused rows are empty.
struct TileSpans {
  static constexpr int kRows = 5, kColumns = 255;
  static constexpr std::uint8_t kLarge = 255;  ///< value of `rows` for a splat with too many tiles
  std::uint32_t tile;
  std::uint8_t rows;
  std::uint8_t columns[kRows][2];
};

/// The tiles of a splat in a word, if they are in a square of 3 x 3 tiles, as those of most splats are.
/// The lowest bits have one bit for each tile, row by row. The others are the index of the top left tile
/// of the square. If the lowest bits are 0, the splat's TileSpans has its tiles.
struct TileWord {
  static constexpr int kSide = 3, kMaskBits = kSide * kSide;
  static constexpr std::uint32_t kMask = (1u << kMaskBits) - 1u;
  /// The bits of the upper left 2 x 2 tiles.
  static constexpr std::uint32_t kFour = 3u | 3u << kSide;
};

/// A splat in 64 bits while it is sorted and binned: its key, its TileWord and its slot. Both stages
/// read entries in sequence; an index would send them to random places. The key's lowest bits may have
/// no room. Splats that differ only in them are then sorted once more, by their whole keys.
struct SortEntry {
  static constexpr int kMostKeyBits = 27;  ///< for a sort in three passes
  int slot_bits = 32, word_bits = 32;

  /// For slots below `slots` and tiles below `tiles`. An image has at most 2^22 tiles, so a word has at
  /// most 31 bits.
  static SortEntry of(std::size_t slots, std::size_t tiles) noexcept {
    const auto bits_for = [](std::size_t n) {
      return static_cast<int>(std::bit_width(n > 1 ? n - 1 : n));
    };
    return {bits_for(slots), bits_for(tiles) + TileWord::kMaskBits};
  }
  GSNAV_HD int key_shift() const noexcept { return slot_bits + word_bits; }
  GSNAV_HD int key_bits() const noexcept {
    return 64 - key_shift() < kMostKeyBits ? 64 - key_shift() : kMostKeyBits;
  }
  GSNAV_HD std::uint64_t operator()(std::uint32_t key, std::uint32_t word,
                                    std::uint32_t slot) const noexcept {
    return (std::uint64_t{key} << word_bits | word) << slot_bits | slot;
  }
  GSNAV_HD std::uint32_t slot(std::uint64_t entry) const noexcept {
    return static_cast<std::uint32_t>(entry & ((std::uint64_t{1} << slot_bits) - 1));
  }
  GSNAV_HD std::uint32_t word(std::uint64_t entry) const noexcept {
    return static_cast<std::uint32_t>(entry >> slot_bits & ((std::uint64_t{1} << word_bits) - 1));
  }
};

/// Arguments of binning, which lists for each tile the visible splats that may cover it.
template <class S>
struct BinArgs {
  TileGrid grid;
  View<const std::uint32_t> order;  ///< visible splats, front to back
  View<const SplatGeometry<S>> geometry;
  View<const SplatBounds> bounds;
  S log2_alpha_min{};
  bool elliptic = true;              ///< footprints are ellipses (Response::ewa)
  std::size_t blocks = 1;            ///< number of pieces that `order` is cut into
  View<std::uint64_t> cursors;       ///< [blocks][tiles], counts, later write positions
  View<std::uint64_t> tile_offsets;  ///< [tiles + 1]
  View<std::uint32_t> tile_splats;   ///< splats of all tiles; those of each tile in `order`
  /// For backends with bins_in_lanes, in place of `order`: the visible splats front to back, and the
  /// format of these entries.
  View<const std::uint64_t> entries;
  SortEntry entry;
  View<const TileSpans> spans;  ///< [slots], filled by the projection of such backends
};

/// Calls f(tile) for each tile that the footprint of a splat may reach.
template <class S, class F>
GSNAV_HD void for_each_tile(const BinArgs<S>& args, std::uint32_t splat, const F& f) noexcept {
  for_each_tile(args.grid, args.geometry[splat], args.bounds[splat], args.log2_alpha_min, args.elliptic,
                f);
}

namespace detail {
/// Prefetches the records of a later splat, because `order` accesses them at random.
template <class S>
GSNAV_HD void prefetch_splat(const BinArgs<S>& args, std::size_t i) noexcept {
#if !GSNAV_DEVICE_CODE && defined(__GNUC__)
  constexpr std::size_t kAhead = 16;
  if (i + kAhead < args.order.size) {
    const std::uint32_t next = args.order[i + kAhead];
    __builtin_prefetch(&args.geometry[next]);
    __builtin_prefetch(&args.bounds[next]);
  }
#else
  (void)args;
  (void)i;
#endif
}

/// Calls f(tile, splat) for the tiles of each splat in one block, in order, without those that `cull`
/// hides.
template <class S, class Cull, class F>
GSNAV_HD void for_each_intersection(const BinArgs<S>& args, const Cull& cull, std::size_t block,
                                    const F& f) noexcept {
  const BlockRange r = BlockRange::of(block, args.blocks, args.order.size);
  for (std::size_t i = r.begin; i < r.end; ++i) {
    prefetch_splat(args, i);
    const std::uint32_t splat = args.order[i];
    for_each_tile(args, splat, [&](std::size_t tile) GSNAV_INLINED {
      if (!cull.hides(tile, splat)) f(tile, splat);
    });
  }
}

/// Counts the items of each tile for one block. `each(f)` calls f(tile, item) for the items of the
/// block, in order. A third argument of 0 says that the tile is not the item's after all, so that
/// callers need no branch.
template <class S, class Each>
GSNAV_HD void count_in_tiles(const BinArgs<S>& args, std::size_t block, const Each& each) noexcept {
  std::uint64_t* counts = args.cursors.data + block * args.grid.count();
  for (std::size_t t = 0; t < args.grid.count(); ++t) counts[t] = 0;
  each([=](std::size_t tile, std::uint32_t, std::uint32_t covered = 1)
           GSNAV_INLINED { counts[tile] += covered; });
}
/// Writes the items of one block to the lists of their tiles, in order, after ScanTileIntersections.
template <class S, class Each>
GSNAV_HD void scatter_to_tiles(const BinArgs<S>& args, std::size_t block, const Each& each) noexcept {
  std::uint64_t* cursors = args.cursors.data + block * args.grid.count();
  std::uint32_t* out = args.tile_splats.data;
  std::uint32_t nowhere = 0;
  each([=, &nowhere](std::size_t tile, std::uint32_t item, std::uint32_t covered = 1) GSNAV_INLINED {
    const std::uint64_t at = cursors[tile];
    *(covered != 0 ? out + at : &nowhere) = item;
    cursors[tile] = at + covered;
  });
}
}  // namespace detail

/// Cull rule that hides no splat, for frames without a mesh.
struct NoCull {
  GSNAV_HD bool hides(std::size_t, std::uint32_t) const noexcept { return false; }
};

/// Cull rule that hides splats behind a mesh.
template <class S>
struct MeshCull {
  View<const SplatDepth<S>> depths;
  View<const S> tile_far;  ///< farthest depth of the mesh in each tile, metres (MeshLayer)

  /// True if the splat is behind the mesh at every pixel of a tile.
  GSNAV_HD bool hides(std::size_t tile, std::uint32_t splat) const noexcept {
    return behind(depths[splat], tile_far[tile]);
  }
};

/// Kernel that counts the splats of each tile for one block of `order`, without those that `cull` hides.
template <class S, class Cull = NoCull>
struct CountTileIntersections {
  BinArgs<S> args;
  Cull cull{};
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    detail::count_in_tiles(args, block, [=, this](const auto& f) GSNAV_INLINED {
      detail::for_each_intersection(args, cull, block, f);
    });
  }
};

/// Kernel that converts counts to write positions (block-major within each tile) and tile offsets.
template <class S>
struct ScanTileIntersections {
  BinArgs<S> args;
  GSNAV_HD void operator()(std::size_t) const noexcept {
    const std::size_t tiles = args.grid.count();
    std::uint64_t sum = 0;
    for (std::size_t t = 0; t < tiles; ++t) {
      args.tile_offsets[t] = sum;
      for (std::size_t b = 0; b < args.blocks; ++b) {
        std::uint64_t& c = args.cursors[b * tiles + t];
        const std::uint64_t n = c;
        c = sum;
        sum += n;
      }
    }
    args.tile_offsets[tiles] = sum;
  }
};

/// Kernel that writes the splats of one block to the lists of their tiles, without those that `cull`
/// hides. Keeps their order.
template <class S, class Cull = NoCull>
struct ScatterTileIntersections {
  BinArgs<S> args;
  Cull cull{};
  GSNAV_HD void operator()(std::size_t block) const noexcept {
    detail::scatter_to_tiles(args, block, [=, this](const auto& f) GSNAV_INLINED {
      detail::for_each_intersection(args, cull, block, f);
    });
  }
};

}  // namespace gsnav
