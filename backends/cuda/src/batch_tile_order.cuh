// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_order.cuh"

namespace gsnav::cuda {

/// Reads a tile's list from front to back, up to kOrderBatch splats at a time.
class TileOrder {
 public:
  __device__ TileOrder(const PairRange& list, std::uint32_t tile, std::uint32_t camera)
      : tile_(tile), camera_(camera), begin_(list.begin), end_(list.end) {}
  __device__ TileOrder(const ListRange& part, std::uint32_t camera)
      : tile_(part.tile), camera_(camera), begin_(part.begin), end_(part.end), bin_(part.bin) {}

  /// Stores the next splats in s.slots and returns their number. 0 at the end.
  __device__ __noinline__ std::uint32_t next(OrderShared& s, const BatchArgs& a) {
    if (level_ >= 0) {
      const std::uint32_t n = next_of_bin(s, a);
      if (n != 0) return n;
    }
    if (begin_ == end_) return 0;
    const Bins bins = take(a);
    const std::uint32_t begin = begin_, n = bins.end - begin;
    begin_ = bins.end;
    bin_ = bins.next;
    if (n <= kOrderBatch) {
      ordering::sort_batch(s, a, camera_, list(a), begin, n, bins.low, bins.high);
      return n;
    }
    level_ = 0;
    ordering::partition(s, a, camera_, list(a), bins_of_list(a), begin, n, 0);
    return next_of_bin(s, a);
  }

 private:
  static constexpr int kNone = -1;

  /// Depth bins that are read together: pairs up to `end`, with keys in [low, high]. low > high means
  /// that the range is unknown.
  struct Bins {
    std::uint32_t end, next, low, high;
  };

  __device__ const std::uint32_t* bin_ends(const BatchArgs& a) const {
    return a.bins + (std::size_t{tile_} << a.depth_bins.bits);
  }

  /// Takes as many bins as fit into a batch, but at least one. Every warp computes this itself.
  __device__ Bins take(const BatchArgs& a) const {
    constexpr std::uint32_t kNoBin = 0xffffffffu;
    const DepthBins& bins = a.depth_bins;
    if (!bins.many() || end_ - begin_ <= kOrderBatch) return {end_, bins.count(), kNoBin, 0};
    const std::uint32_t* const ends = bin_ends(a);
    const std::uint32_t lane = threadIdx.x % 32;
    std::uint32_t bin = bin_, end = begin_;
    for (;;) {
      const std::uint32_t mine = bin + lane < bins.count() ? min(ends[bin + lane], end_) : kNoBin;
      const bool fits = mine != kNoBin && mine - begin_ <= kOrderBatch;
      const int fitting = __popc(__ballot_sync(0xffffffffu, fits));
      if (fitting > 0) end = __shfl_sync(0xffffffffu, mine, fitting - 1);
      if (fitting < 32 && end == begin_) {  // The next bin alone exceeds a batch.
        end = __shfl_sync(0xffffffffu, mine, fitting);
        bin += static_cast<std::uint32_t>(fitting) + 1;
        break;
      }
      bin += static_cast<std::uint32_t>(fitting);
      if (fitting < 32) break;
    }
    if (bin_ == 0 || bin == bins.count()) return {end, bin, kNoBin, 0};
    return {end, bin, bins.base + (bin_ << bins.shift), bins.base + (bin << bins.shift) - 1};
  }

  /// Continues with a bin that exceeds a batch.
  __device__ std::uint32_t next_of_bin(OrderShared& s, const BatchArgs& a) {
    while (level_ >= 0) {
      const std::uint32_t* begins = s.begins[level_];
      std::uint32_t bin = s.next_bin[level_];
      while (bin < kOrderBins && begins[bin + 1] == begins[bin]) ++bin;
      if (bin == kOrderBins) {
        --level_;
        continue;
      }
      // As many bins as fit, but at least one.
      const std::uint32_t end = last_start(bin + 1, std::uint32_t{kOrderBins + 1}, [&](std::uint32_t i) {
        return begins[i] - begins[bin] <= kOrderBatch;
      });
      const std::uint32_t begin = begins[bin], n = begins[end] - begin;
      __syncthreads();
      if (threadIdx.x == 0) s.next_bin[level_] = end;
      const ordering::PairsAt here = level_ % 2 == 0 ? bins_of_list(a) : list(a);
      if (n <= kOrderBatch) {
        const int shift = s.shifts[level_];
        std::uint32_t low = 0xffffffffu, high = 0;
        if (shift != kByRank) {
          low = s.bases[level_] + (bin << shift);
          high = s.bases[level_] + (end << shift) - 1;
        }
        ordering::sort_batch(s, a, camera_, here, begin, n, low, high);
        return n;
      }
      ++level_;
      ordering::partition(s, a, camera_, here, level_ % 2 == 0 ? bins_of_list(a) : list(a), begin, n,
                          level_);
    }
    return 0;
  }

  static constexpr std::uint32_t kNowhere = 0xffffffffu;
  __device__ ordering::PairsAt list(const BatchArgs& a) const {
    if (a.list_room == 0) return {a.pairs, 0, kNowhere, 0};
    return {a.pairs, 0, (tile_ + 1) * a.list_room, a.tile_shifts[tile_].x};
  }
  /// Array that the bins of every other level are written to.
  __device__ ordering::PairsAt bins_of_list(const BatchArgs& a) const {
    return {a.pairs_alt, a.list_room != 0 ? a.tile_shifts[tile_].y : 0, kNowhere, 0};
  }

  std::uint32_t tile_, camera_, begin_, end_;
  std::uint32_t bin_ = 0;  ///< Depth bin to be sorted next.
  int level_ = kNone;      ///< Level of the bin that is being read.
};

}  // namespace gsnav::cuda
