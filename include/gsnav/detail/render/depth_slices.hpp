// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/detail/frame/cull.hpp"
#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/squares.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/render/order_visible.hpp"
#include "gsnav/detail/render/tuning.hpp"
#include "gsnav/render/config.hpp"

namespace gsnav {

/// Backends that can draw a frame in slices of depth. Their Blend must continue where the previous slice
/// ended (RasterArgs::progress); the generic one cannot.
template <class B, class S>
concept SlicingBackend = ProjectsChunks<B, S> && RunsStage<B, stage::Blend, RasterArgs<S>>;

/// Plan of a frame that is drawn in slices of depth, front to back. Where a slice has closed all pixels,
/// later slices need not project, colour, sort or bin anything. The image has the same bits as with one
/// slice. Each pixel blends the same splats in the same order, except those that come after it is
/// closed.
///
/// A chunk belongs to the slice of its nearest possible key. Its farther Gaussians are projected with it
/// and wait for their own slices.
class DepthSlices {
 public:
  static constexpr int kMost = Tuning::kMostDepthSlices;

  /// Finds the depth and the image region of each chunk.
  /// @param sets one projection per set
  /// @param tile_size pixels
  template <class B>
  void plan(B& backend, View<const ViewedSet<float>> sets, int tile_size) {
    square_ = OpenSquares::size_in(tile_size);
    chunks_.resize(sets.size == 0 ? 0
                                  : sets[sets.size - 1].first_chunk + sets[sets.size - 1].chunk_count());
    for (const ViewedSet<float>& args : sets) {
      backend.parallel_for(args.chunk_count(), [this, &args](std::size_t c) {
        chunks_[args.first_chunk + c] = place_of(args, c);
      });
    }
    weights_.fill(0);
    candidates_ = 0;
    for (const ViewedSet<float>& args : sets) {
      for (std::size_t c = 0; c < args.chunk_count(); ++c) {
        const Place& place = chunks_[args.first_chunk + c];
        if (!place.candidate()) continue;
        const std::size_t first = args.selection.chunk_id(c) * kProjectChunk;
        const std::size_t n = std::min(kProjectChunk, args.gaussians.size() - first);
        weights_[place.bucket] += n;
        candidates_ += n;
      }
    }
  }
  /// Number of Gaussians in chunks that may be visible.
  std::size_t candidates() const noexcept { return candidates_; }

  /// Splits the plan into n slices, or fewer if there are fewer distinct depths.
  void split(int n) noexcept {
    count_ = 0;
    std::size_t taken = 0, bucket = 0;
    const double first = detail::first_slice_share(n);
    for (int s = 0; s + 1 < n; ++s) {
      const double share = first + (1 - first) * s / n;
      const std::size_t wanted = static_cast<std::size_t>(share * static_cast<double>(candidates_));
      if (taken >= wanted) continue;  // a slice would be empty
      while (bucket + 1 < kBuckets && taken < wanted) taken += weights_[bucket++];
      ends_[static_cast<std::size_t>(count_++)] = bucket;
    }
    ends_[static_cast<std::size_t>(count_++)] = kBuckets;
  }
  int count() const noexcept { return count_; }

  /// Range of the keys of slice s.
  KeyRange keys(int s) const noexcept {
    const auto end = [this](int i) { return key_of_bucket(ends_[static_cast<std::size_t>(i)]); };
    return {s == 0 ? 0 : end(s - 1), s + 1 == count_ ? 0xffffffffu : end(s) - 1};
  }
  /// Chunks of one set that slice s projects: those that may reach a square in `open`, or all if `open`
  /// is empty. Valid until the next call.
  View<const std::uint32_t> chunks(int s, const ViewedSet<float>& args, const OpenSquares& open) {
    const std::size_t begin = s == 0 ? 0 : ends_[static_cast<std::size_t>(s - 1)];
    const std::size_t end = ends_[static_cast<std::size_t>(s)];
    list_.clear();
    for (std::size_t c = 0; c < args.chunk_count(); ++c) {
      const Place& place = chunks_[args.first_chunk + c];
      if (place.bucket < begin || place.bucket >= end || !place.candidate()) continue;
      const SquareRange& at = place.squares;
      if (!open.empty() && !open.any(at.x0, at.y0, at.x1, at.y1)) continue;
      list_.push_back(static_cast<std::uint32_t>(c));
    }
    return {list_.data(), list_.size()};
  }

  /// Open squares for the projection of the next slice, from TileProgress::open of the last one. Valid
  /// until the next call.
  OpenSquares open_squares(const TileGrid& grid, View<const std::uint64_t> open) {
    constexpr std::size_t side = OpenSquares::kPerSide;
    const std::size_t tiles = static_cast<std::size_t>(grid.columns);
    const std::size_t stride = tiles * side + 1, rows = static_cast<std::size_t>(grid.rows) * side;
    sums_.resize(stride * (rows + 1));
    std::fill(sums_.begin(), sums_.begin() + static_cast<std::ptrdiff_t>(stride), 0u);
    for (std::size_t y = 0; y < rows; ++y) {
      const std::uint64_t* const masks = open.data + y / side * tiles;
      const std::uint32_t* above = sums_.data() + y * stride;
      std::uint32_t* out = sums_.data() + (y + 1) * stride;
      std::uint32_t row = 0;
      *out++ = 0;
      for (std::size_t t = 0; t < tiles; ++t) {
        const std::uint64_t squares = masks[t] >> (y % side * side);
        for (std::size_t x = 0; x < side; ++x)
          *out++ = *++above + (row += static_cast<std::uint32_t>(squares >> x & 1));
      }
    }
    return {{sums_.data(), sums_.size()}, stride, square_};
  }

  /// Grows the capacity to that of `o` (see ScratchMemory::grow_to).
  void grow_to(const DepthSlices& o) {
    chunks_.reserve(o.chunks_.capacity());
    list_.reserve(o.list_.capacity());
    sums_.reserve(o.sums_.capacity());
  }
  std::size_t capacity_bytes() const noexcept {
    return chunks_.capacity() * sizeof(Place) +
           (list_.capacity() + sums_.capacity()) * sizeof(std::uint32_t);
  }

 private:
  /// Number of depth buckets: 16 per octave, from 1 mm on.
  static constexpr std::size_t kBuckets = 512;
  static constexpr int kBucketShift = 19;

  /// Bucket of a chunk's nearest key, and the squares that it may reach.
  struct Place {
    std::uint16_t bucket = 0;
    SquareRange squares;
    bool candidate() const noexcept { return !squares.empty(); }
  };

  std::uint32_t key_of_bucket(std::size_t bucket) const noexcept {
    return base_ + (static_cast<std::uint32_t>(bucket) << kBucketShift);
  }
  /// Bucket of a positive key.
  std::uint16_t bucket_of(float key) const noexcept {
    const std::uint32_t bits = bits_of(key);
    const std::size_t bucket = bits > base_ ? (bits - base_) >> kBucketShift : 0;
    return static_cast<std::uint16_t>(std::min(bucket, kBuckets - 1));
  }
  Place place_of(const ViewedSet<float>& args, std::size_t c) const noexcept {
    const int width = args.camera.width, height = args.camera.height;
    const Place anywhere{0, SquareRange::all(width, height, square_)};
    const View<const ChunkBounds> bounds = args.gaussians.chunk_bounds;
    const std::size_t id = args.selection.chunk_id(c);
    if (!args.selection.may_be_seen(id)) return {};
    if (bounds.empty()) return anywhere;
    if (!may_be_visible(args.camera64, bounds[id])) return {};
    const ChunkExtent e = chunk_extent(args.camera64, bounds[id]);
    const SquareRange reached = SquareRange::of(e, width, height, square_);
    // Bounds that are not finite tell us nothing: treat the chunk as nearest and as covering the image.
    if (reached.empty()) return anywhere;
    return {e.nearest > 0 ? bucket_of(e.nearest) : std::uint16_t{0}, reached};
  }

  std::vector<Place> chunks_;
  std::vector<std::uint32_t> list_, sums_;
  std::array<std::size_t, kBuckets> weights_{};
  std::array<std::size_t, kMost> ends_{};
  std::uint32_t base_ = bits_of(0.001f);
  std::size_t candidates_ = 0;
  int count_ = 1, square_ = 1;
};

}  // namespace gsnav
