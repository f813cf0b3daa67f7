// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_args.cuh"

// The tiles of a splat: found and counted once, and remembered until its pairs are written.

namespace gsnav::cuda {

/// The tiles that a splat may touch, where they lie in a window of 4 x 4.
struct TileWindow {
  static constexpr int kSide = 4;  ///< a splat that needs more gets a warp
  std::uint32_t corner;            ///< column | row << 16
  std::uint32_t tiles;             ///< bit kSide * row + column
  __device__ std::uint32_t column() const { return corner & 0xffffu; }
  __device__ std::uint32_t row() const { return corner >> 16; }
  /// Of the lowest of `bits` from the corner.
  __device__ static std::uint32_t offset(std::uint32_t bits, std::uint32_t columns) {
    const std::uint32_t bit = static_cast<std::uint32_t>(__ffs(static_cast<int>(bits)) - 1);
    return bit / kSide * columns + bit % kSide;
  }
};

/// The first tile of a camera.
__device__ inline std::uint32_t first_tile(const BatchArgs& a, std::uint32_t camera) {
  return camera * static_cast<std::uint32_t>(a.grid.count());
}

/// Of bounds; `tiles` is 1 where they lie in one tile, else 0: still to be found.
__device__ inline TileWindow window_of(const BatchArgs& a, const SplatBounds& b) {
  const int shift = a.grid.tile_shift();
  const int tx = b.x0 >> shift, ty = b.y0 >> shift;
  const bool single = (b.x1 - 1) >> shift == tx && (b.y1 - 1) >> shift == ty;
  return {static_cast<std::uint32_t>(tx) | static_cast<std::uint32_t>(ty) << 16, single ? 1u : 0u};
}

/// Whether bounds reach beyond a window.
__device__ inline bool is_large(const BatchArgs& a, const SplatBounds& b) {
  const int shift = a.grid.tile_shift();
  return ((b.x1 - 1) >> shift) - (b.x0 >> shift) >= TileWindow::kSide ||
         ((b.y1 - 1) >> shift) - (b.y0 >> shift) >= TileWindow::kSide;
}

/// The window's tile of the lowest of `bits`, among those of all cameras.
__device__ inline std::uint32_t tile_of(const BatchArgs& a, std::uint32_t camera, const TileWindow& window,
                                        std::uint32_t bits) {
  const std::uint32_t columns = static_cast<std::uint32_t>(a.grid.columns);
  return first_tile(a, camera) + window.row() * columns + window.column() + TileWindow::offset(bits, columns);
}

/// Adds one to the counter of `tile` for each lane that wants it, by one atomic operation a tile, since lanes often
/// share one and a tile may be in great demand. Returns the lane's place. All lanes of the warp call it.
template <bool Place>
__device__ inline std::uint32_t add_together(std::uint32_t* counters, bool wanted, std::uint32_t tile) {
  const unsigned takers = __ballot_sync(0xffffffffu, wanted);
  if (!wanted) return 0;
  const unsigned lane = threadIdx.x % 32, peers = __match_any_sync(takers, tile);
  const int leader = __ffs(static_cast<int>(peers)) - 1;
  std::uint32_t at = 0;
  if (static_cast<int>(lane) == leader) at = atomicAdd(counters + tile, static_cast<std::uint32_t>(__popc(peers)));
  if constexpr (!Place) return 0;
  return __shfl_sync(peers, at, leader) + static_cast<std::uint32_t>(__popc(peers & ((1u << lane) - 1)));
}

/// Places that a warp takes from a counter by the slab; those that it has not used are left to the caller.
class WarpSlab {
 public:
  __device__ WarpSlab(unsigned long long* counter, std::uint32_t slab) : counter_(counter), slab_(slab) {}

  /// The place of each lane that wants one. All lanes call it.
  __device__ std::uint64_t take(bool wanted) {
    const unsigned lane = threadIdx.x % 32, votes = __ballot_sync(0xffffffffu, wanted);
    const std::uint32_t count = static_cast<std::uint32_t>(__popc(votes));
    const std::uint32_t place = static_cast<std::uint32_t>(__popc(votes & ((1u << lane) - 1)));
    std::uint64_t at = next_ + place;
    if (count > left_) {
      unsigned long long slab = 0;
      if (lane == 0) slab = atomicAdd(counter_, static_cast<unsigned long long>(slab_));
      slab = __shfl_sync(0xffffffffu, slab, 0);
      if (place >= left_) at = slab + place - left_;
      next_ = slab + count - left_;
      left_ = slab_ - (count - left_);
    } else {
      next_ += count;
      left_ -= count;
    }
    return at;
  }

  /// Calls f(place) for each place taken and not used.
  template <class F>
  __device__ void rest(const F& f) const {
    for (std::uint32_t i = threadIdx.x % 32; i < left_; i += 32) f(next_ + i);
  }

 private:
  unsigned long long* counter_;
  std::uint64_t next_ = 0;
  std::uint32_t left_ = 0, slab_;
};

}  // namespace gsnav::cuda
