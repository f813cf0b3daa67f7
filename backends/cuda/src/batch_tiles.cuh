// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_args.cuh"

// Tiles of a splat. They are found and counted once, and kept until the splat's pairs are written.

namespace gsnav::cuda {

/// Tiles that a splat may touch, if they lie in a window of 4 x 4 tiles.
struct TileWindow {
  static constexpr int kSide = 4;  ///< A larger splat is processed by a warp.
  std::uint32_t corner;            ///< Column | row << 16.
  std::uint32_t tiles;             ///< Bit kSide * row + column.
  __device__ std::uint32_t column() const { return corner & 0xffffu; }
  __device__ std::uint32_t row() const { return corner >> 16; }
};

/// Index of the counter for pairs of a tile with this key.
__device__ inline std::uint32_t bin_of(const BatchArgs& a, std::uint32_t tile, std::uint32_t key) {
  return (tile << a.depth_bins.bits) + a.depth_bins.of(key);
}

/// Counts a pair of a list in bins. Once the bins have places, it returns the place of the pair.
__device__ inline std::uint32_t add_to_bin(const BatchArgs& a, std::uint32_t tile, std::uint32_t key) {
  return atomicAdd(a.bins + bin_of(a, tile, key), 1u);
}

/// First tile of a camera.
__device__ inline std::uint32_t first_tile(const BatchArgs& a, std::uint32_t camera) {
  return camera * static_cast<std::uint32_t>(a.grid.count());
}

/// Window of a splat's bounds. If they lie in one tile, it contains that tile; otherwise its tiles still
/// have to be found.
__device__ inline TileWindow window_of(const BatchArgs& a, const SplatBounds& b) {
  const TileRange<int> tiles = a.grid.tiles_of(b);
  return {static_cast<std::uint32_t>(tiles.x0) | static_cast<std::uint32_t>(tiles.y0) << 16,
          tiles.single() ? 1u : 0u};
}

/// Returns true if the bounds exceed a window.
__device__ inline bool is_large(const BatchArgs& a, const SplatBounds& b) {
  return a.grid.tiles_of(b).exceeds(TileWindow::kSide);
}

/// Index, among the tiles of all cameras, of a window's tile with bit `bit`.
__device__ inline std::uint32_t tile_of(const BatchArgs& a, std::uint32_t camera,
                                        const TileWindow& window, std::uint32_t bit) {
  const std::uint32_t columns = static_cast<std::uint32_t>(a.grid.columns);
  return first_tile(a, camera) + (window.row() + bit / TileWindow::kSide) * columns + window.column() +
         bit % TileWindow::kSide;
}

/// Sum of `value` over the lanes up to this one. All lanes of the warp must call it.
template <class T>
__device__ inline T sum_to_lane(T value) {
  for (unsigned step = 1; step < 32; step *= 2) {
    const T other = __shfl_up_sync(0xffffffffu, value, step);
    if (threadIdx.x % 32 >= step) value += other;
  }
  return value;
}

/// Reserves `count` consecutive places of a counter per lane, with one atomic operation per warp. All
/// lanes must call it.
__device__ inline unsigned long long take_places(unsigned long long* counter, std::uint32_t count) {
  const unsigned long long end = sum_to_lane(static_cast<unsigned long long>(count));
  unsigned long long base = 0;
  if (threadIdx.x % 32 == 31 && end != 0) base = atomicAdd(counter, end);
  return __shfl_sync(0xffffffffu, base, 31) + end - count;
}

/// Calls f(owner, i) for i in [0, count) of each lane `owner`, with all calls of the warp divided evenly
/// among its lanes. All lanes must call it. f is called by all lanes together; lanes without work get
/// owner 32.
template <class F>
__device__ inline void share_in_warp(std::uint32_t count, const F& f) {
  const unsigned lane = threadIdx.x % 32;
  const std::uint32_t end = sum_to_lane(count);  // End of the lane's calls among those of the warp.
  const std::uint32_t total = __shfl_sync(kAll, end, 31);
  for (std::uint32_t first = 0; first < total; first += 32) {
    const std::uint32_t at = first + lane;
    unsigned owner = 0;  // First lane whose end is beyond `at`.
    for (unsigned step = 16; step > 0; step /= 2) {
      if (__shfl_sync(kAll, end, owner + step - 1) <= at) owner += step;
    }
    const std::uint32_t begin = __shfl_sync(kAll, end - count, owner);
    f(at < total ? owner : 32u, at - begin);
  }
}

/// Index of the set bit that has n set bits below it, among the lowest kBits.
template <std::uint32_t kBits>
__device__ inline std::uint32_t nth_bit(std::uint32_t bits, std::uint32_t n) {
  std::uint32_t place = 0;
#pragma unroll
  for (std::uint32_t width = kBits / 2; width > 0; width /= 2) {
    const std::uint32_t below = static_cast<std::uint32_t>(__popc(bits & ((1u << width) - 1)));
    if (n >= below) {
      n -= below;
      bits >>= width;
      place += width;
    }
  }
  return place;
}

/// Places that a warp takes from a counter one slab at a time. The caller must handle unused ones.
class WarpSlab {
 public:
  __device__ WarpSlab(unsigned long long* counter, std::uint32_t slab)
      : counter_(counter), slab_(slab) {}

  /// Place of each lane whose `wanted` is true. All lanes must call it.
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

  /// Calls f(place) for each place that was reserved but not used.
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
