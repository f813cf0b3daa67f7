// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "batch_region_order.cuh"

// Reads a region's list from front to back, for one tile.

namespace gsnav::cuda {

/// Rows that a warp holds, and which pairs of pixels a rectangle reaches.
struct ReaderShared {
  uint2 rows[kHeld];
  TieShared ties;
  std::uint32_t columns[64], lines[64];  ///< By the two ranges of a rectangle.
};

/// How far a list has been read.
struct ReaderState {
  std::uint32_t next, restart, held, target;
  std::uint32_t begin_key, end_key, first_rank, crowded;
};

/// Work of a warp. All lanes must call every function together.
class TileReader {
 public:
  __device__ TileReader(const BatchArgs& a, const RegionArgs& r, ReaderShared& s)
      : a_(a), r_(r), s_(s), rows_(s.rows), lane_(threadIdx.x % 32), below_((1u << lane_) - 1) {}

  /// Starts with the list of the tile at (x, y).
  __device__ void begin(std::uint32_t camera, int x, int y) {
    const std::uint32_t regions = static_cast<std::uint32_t>(r_.columns * r_.rows);
    const uint2 list =
        r_.lists[camera * regions + static_cast<std::uint32_t>(y / kRegion * r_.columns + x / kRegion)];
    list_ = {reinterpret_cast<const uint2*>(r_.pairs) + list.x, list.y, camera, x, y};
    base_ = r_.bases[camera];
    for (std::uint32_t i = lane_; i < 64; i += 32) {
      constexpr std::uint32_t kAllLines = 7u << 9, kAllColumns = 7u << 3;
      s_.columns[i] = reached_pairs(i | kAllLines, x, y);
      s_.lines[i] = reached_pairs(i << 6 | kAllColumns, x, y);
    }
    __syncwarp();
    next_ = restart_ = held_ = begin_key_ = first_rank_ = 0;
    end_key_ = kLastKey;
    target_ = Policy::kTarget;
    crowded_ = false;
  }

  /// Between keep_rest() and collect(). The rows held are copied to `rows`.
  __device__ ReaderState save(uint2* rows) const {
    for (std::uint32_t i = lane_; i < held_; i += 32) rows[i] = rows_[i];
    return {next_, restart_, held_, target_, begin_key_, end_key_, first_rank_, crowded_ ? 1u : 0u};
  }
  /// After begin(): goes on where the reader that was saved had stopped.
  __device__ void resume(const ReaderState& from, const uint2* rows) {
    next_ = from.next;
    restart_ = from.restart;
    held_ = from.held;
    target_ = from.target;
    begin_key_ = from.begin_key;
    end_key_ = from.end_key;
    first_rank_ = from.first_rank;
    crowded_ = from.crowded != 0;
    for (std::uint32_t i = lane_; i < held_; i += 32) rows_[i] = rows[i];
    __syncwarp();
  }

  /// Number of rows of the list that were not read.
  __device__ std::uint32_t left() const { return list_.length - min(next_, list_.length); }

  /// Pairs of pixels that the rectangle of a row reaches.
  __device__ std::uint32_t reached(std::uint32_t word) const {
    return s_.columns[word & 63u] & s_.lines[word >> 6 & 63u];
  }

  /// Word of row i of those collected.
  __device__ std::uint32_t word(std::uint32_t i) const { return rows_[i].x; }

  /// Returns true if the list has no rows besides those collected.
  __device__ bool done() const { return next_ >= list_.length && end_key_ == kLastKey; }

  /// Collects rows that reach one of the pairs `open`, in order. Returns how many of them are certainly
  /// the next ones of the list.
  __device__ std::uint32_t collect(unsigned open) {
    for (;;) {
      if (crowded_) {
        const uint2 taken = take_equal_keys(a_, r_, list_, begin_key_, first_rank_, open, rows_);
        held_ = taken.x;
        first_rank_ = taken.y + 1;
        order_equal_keys(a_, r_, list_.camera, rows_, held_, s_.ties);
        crowded_ = first_rank_ != 0;
        end_key_ = limit_ = begin_key_ + (crowded_ ? 0 : 1);
        return held_;
      }
      read(open);
      limit_ = min(next_key(), end_key_);
      order();
      const std::uint32_t safe = limit_ == kLastKey ? held_ : nearer_than(limit_);
      if (safe >= Policy::kLeast || limit_ == end_key_ || next_ >= list_.length) return safe;
      if (held_ + 32 <= kHeld) {
        target_ = kHeld;
        continue;
      }
      // Too many rows of one bin: keep the nearer half, and come back for the others.
      end_key_ = rows_[held_ / 2].y;
      held_ = nearer_than(end_key_);
      if (held_ == 0) {  // They have one key.
        crowded_ = true;
        begin_key_ = end_key_;
        first_rank_ = 0;
      }
    }
  }

  /// Keeps the rows that were not drawn.
  __device__ void keep_rest(std::uint32_t safe) {
    const std::uint32_t rest = held_ - safe;
    for (std::uint32_t first = 0; first < rest; first += 32) {
      const bool mine = first + lane_ < rest;
      const uint2 row = mine ? rows_[safe + first + lane_] : uint2{0, 0};
      __syncwarp();
      if (mine) rows_[first + lane_] = row;
      __syncwarp();
    }
    held_ = rest;
    target_ = max(Policy::kTarget, rest + Policy::kTarget / 2);
    if (limit_ != end_key_ || end_key_ == kLastKey) return;
    begin_key_ = end_key_;
    end_key_ = kLastKey;
    held_ = 0;
    next_ = restart_ = begin_of_bin(begin_key_);
  }

 private:
  using Policy = policy::Regions;

  /// Place from restart_ on before which all keys are less than `key`, near the begin of its bin.
  __device__ std::uint32_t begin_of_bin(std::uint32_t key) const {
    const std::uint32_t low = first_key_of_bin(r_, base_, key);
    std::uint32_t first = restart_, last = min(next_, list_.length);
    while (last > first + 32) {
      const std::uint32_t step = (last - first + 31) / 32, i = first + lane_ * step;
      const bool earlier = i < last && first_key_of_bin(r_, base_, list_.rows[i].y) < low;
      const auto n = static_cast<std::uint32_t>(__popc(__ballot_sync(kAll, earlier)));
      if (n == 0) break;
      last = min(first + n * step, last);
      first += (n - 1) * step;
    }
    return first / 32 * 32;
  }

  /// Lower bound of the keys from place next_ of the list on.
  __device__ std::uint32_t next_key() const {
    return next_ < list_.length ? first_key_of_bin(r_, base_, list_.rows[next_].y) : kLastKey;
  }

  /// Reads on until `target_` rows are held, the space is full, or no row before end_key_ is left.
  __device__ void read(unsigned open) {
    constexpr std::uint32_t kRead = Policy::kReadAtOnce;
    while (next_ < list_.length && held_ < target_ && held_ + 32 <= kHeld) {
      uint2 row[kRead];
#pragma unroll
      for (std::uint32_t q = 0; q < kRead; ++q) {
        const std::uint32_t i = next_ + 32 * q + lane_;
        row[q] = i < list_.length ? list_.rows[i] : uint2{0, kLastKey};
      }
      if (end_key_ != kLastKey &&
          first_key_of_bin(r_, base_, __shfl_sync(kAll, row[0].y, 0)) >= end_key_)
        break;
#pragma unroll
      for (std::uint32_t q = 0; q < kRead; ++q) {
        if (next_ >= list_.length || held_ + 32 > kHeld) break;
        const bool late = row[q].y >= begin_key_ && row[q].y != kLastKey;
        const bool wanted = late && row[q].y < end_key_ && (reached(row[q].x) & open) != 0;
        const unsigned votes = __ballot_sync(kAll, wanted);
        if (begin_key_ != 0 && next_ == restart_ && !__any_sync(kAll, late)) restart_ += 32;
        if (wanted) rows_[held_ + static_cast<std::uint32_t>(__popc(votes & below_))] = row[q];
        held_ += static_cast<std::uint32_t>(__popc(votes));
        next_ += 32;
      }
    }
    __syncwarp();
  }

  /// Number of held rows, in order, whose key is less than `limit`.
  __device__ std::uint32_t nearer_than(std::uint32_t limit) const {
    std::uint32_t n = 0;
    for (std::uint32_t first = 0; first < held_; first += 32) {
      const unsigned votes =
          __ballot_sync(kAll, first + lane_ < held_ && rows_[first + lane_].y < limit);
      n += static_cast<std::uint32_t>(__popc(votes));
      if (votes != kAll) break;
    }
    return n;
  }

  __device__ void order() {
    if (order_rows(rows_, held_)) order_equal_keys(a_, r_, list_.camera, rows_, held_, s_.ties);
  }

  const BatchArgs& a_;
  const RegionArgs& r_;
  ReaderShared& s_;
  uint2* const rows_;
  const unsigned lane_, below_;
  TileList list_{};
  std::uint32_t base_ = 0, next_ = 0, restart_ = 0, held_ = 0, target_ = 0;
  // Rows held have keys of [begin_key_, end_key_). All keys before limit_ have been read.
  std::uint32_t begin_key_ = 0, end_key_ = 0, limit_ = 0;
  std::uint32_t first_rank_ = 0;  ///< Next rank among the rows with begin_key_, if crowded_.
  bool crowded_ = false;          ///< More rows have begin_key_ than a warp holds.
};

}  // namespace gsnav::cuda
