// SPDX-License-Identifier: Apache-2.0
#include <cuda_pipeline.h>

#include "batch_splat.cuh"
#include "batch_tiles.cuh"

// Culling and projection of a batch: what CPU backends do one camera at a time, by the same formulas.

namespace gsnav::cuda {

namespace {

constexpr unsigned kThreads = 256, kWarps = kThreads / 32;
constexpr unsigned kProjectWarps = 4, kProjectBlocks = 5;  ///< of a block; of a multiprocessor
constexpr unsigned kWarpsPerPart = kChunkPart / 32;
constexpr unsigned kAll = 0xffffffffu;

/// Whether part `part` of the chunk may have visible Gaussians: by bounds of its own, or by the chunk's.
__device__ bool part_is_candidate(const ProjectArgs<float>& args, std::size_t chunk, unsigned part) {
  const GaussianView& gs = args.gaussians;
  const std::size_t at = chunk * kPartsPerChunk + part;
  if (at * kChunkPart >= gs.size || !gs.may_be_seen(chunk) || !gs.seen_rows(chunk).any_of_part(part)) return false;
  if (gs.chunk_bounds.empty()) return true;
  return may_be_visible(args.camera64,
                        gs.part_bounds.empty() ? gs.chunk_bounds[chunk] : gs.part_bounds[at]);
}

/// Parts, a bit each, of a chunk that the lane's instance may see (`seen`): all of them, or where the
/// chunk is at the edge of its view those that the lanes find together, four for each such instance.
__device__ unsigned parts_in_view(const BatchInstance* instances, std::size_t chunk, bool seen) {
  const unsigned lane = threadIdx.x % 32;
  const GaussianView& gs = instances[0].args.gaussians;
  const std::size_t rows = gs.size - chunk * kProjectChunk;
  const unsigned all =
      (1u << (rows < kProjectChunk ? (rows + kChunkPart - 1) / kChunkPart : kPartsPerChunk)) - 1;
  unsigned parts = seen ? all : 0;
  if (seen) parts &= instances[lane].args.gaussians.seen_rows(chunk).parts();
  unsigned edges =
      __ballot_sync(kAll, seen && !gs.part_bounds.empty() &&
                              !lies_in_view(instances[lane].args.camera64, gs.chunk_bounds[chunk]));
  while (edges != 0) {
    unsigned mine = edges, rest = edges;
    for (unsigned k = 0; k < kFewInstances; ++k) {
      if (k < lane / kPartsPerChunk) mine &= mine - 1;
      rest &= rest - 1;
    }
    const bool in_view =
        mine != 0 && part_is_candidate(instances[__ffs(static_cast<int>(mine)) - 1].args, chunk,
                                       lane % kPartsPerChunk);
    const unsigned votes = __ballot_sync(kAll, in_view);
    if (((edges & ~rest) >> lane & 1u) != 0) {
      const int turn = __popc(edges & ((1u << lane) - 1));
      parts = votes >> (turn * static_cast<int>(kPartsPerChunk)) & ((1u << kPartsPerChunk) - 1);
    }
    edges = rest;
  }
  return parts;
}

/// Chunk c of those that are drawn: the same for all instances of a set.
__device__ std::uint32_t chunk_of(const BatchInstance& instance, std::uint32_t c) {
  return static_cast<std::uint32_t>(instance.args.gaussians.chunk_id(c));
}

/// A warp a unit: the lanes are instances, or where these are few parts and instances.
__global__ void __launch_bounds__(kThreads) cull_kernel(const BatchArgs a) {
  const unsigned lane = threadIdx.x % 32;
  const std::uint64_t stride = std::uint64_t{gridDim.x} * kWarps;
  for (std::uint64_t unit = blockIdx.x * kWarps + threadIdx.x / 32; unit < a.units; unit += stride) {
    std::uint32_t low = 0, high = a.set_count;
    while (high - low > 1) {
      const std::uint32_t mid = (low + high) / 2;
      if (a.sets[mid].first_unit <= unit) {
        low = mid;
      } else {
        high = mid;
      }
    }
    const BatchSet set = a.sets[low];
    const std::uint32_t at = static_cast<std::uint32_t>(unit - set.first_unit);
    const BatchInstance* instances = a.instances + set.first_instance;
    std::uint32_t first = set.first_instance, chunk, part, mask;  // the lane's item, if mask is not 0
    if (set.has_few()) {
      const std::uint32_t slot = lane % kFewInstances, index = slot % set.instances;
      part = lane / kFewInstances;
      chunk = at * set.unit_chunks() + slot / set.instances;
      const bool exists = slot / set.instances < set.unit_chunks() && chunk < set.chunks;
      if (exists) chunk = chunk_of(instances[0], chunk);
      const unsigned votes =
          __ballot_sync(kAll, exists && part_is_candidate(instances[index].args, chunk, part));
      mask = index == 0 && exists ? votes >> lane & ((1u << set.instances) - 1) : 0;
    } else {
      const std::uint32_t word = at / set.chunks, index = 32 * word + lane;
      first += 32 * word;
      instances += 32 * word;
      const bool seen =
          index < set.instances && chunk_is_candidate(instances[lane].args, at % set.chunks);
      chunk = chunk_of(instances[0], at % set.chunks);
      const unsigned parts = parts_in_view(instances, chunk, seen);
      part = lane;
      mask = 0;
      for (unsigned p = 0; p < kPartsPerChunk; ++p) {
        const unsigned votes = __ballot_sync(kAll, (parts >> p & 1u) != 0);
        if (lane == p) mask = votes;
      }
    }
    const unsigned items = __ballot_sync(kAll, mask != 0);
    if (items == 0) continue;
    std::uint32_t place = 0;
    if (lane == 0) place = atomicAdd(&a.counters->items, static_cast<std::uint32_t>(__popc(items)));
    place = __shfl_sync(kAll, place, 0) + static_cast<std::uint32_t>(__popc(items & ((1u << lane) - 1)));
    if (mask != 0) a.items[place] = {first, chunk * kPartsPerChunk + part, mask};
  }
}

template <bool Plain>
__device__ void write_record(const BatchArgs& a, std::uint32_t slot, const BatchInstance& instance,
                             float key, std::size_t row, const Splat& s, const SplatColor<float>& c) {
  const SplatGeometry<float>& g = s.geometry;
  const auto pack = [](std::uint32_t low, std::uint32_t high) { return low | high << 16; };
  const std::uint32_t x =
      pack(static_cast<std::uint32_t>(s.bounds.x0), static_cast<std::uint32_t>(s.bounds.x1));
  const std::uint32_t y =
      pack(static_cast<std::uint32_t>(s.bounds.y0), static_cast<std::uint32_t>(s.bounds.y1));
  a.records[slot] = {pack(static_cast<std::uint32_t>(g.ref_x), static_cast<std::uint32_t>(g.ref_y)),
                     g.a,
                     g.k,
                     g.b,
                     g.w1,
                     g.w2,
                     g.log2_opacity,
                     c.r,
                     c.g,
                     c.b,
                     x,
                     y};
  const TileWindow window = window_of(a, s.bounds);
  a.entries[slot] = {instance.args.camera.key_code(key), window.corner, window.tiles, instance.camera};
  a.sources[slot] = instance.args.first_rank + static_cast<std::uint32_t>(row);
  if (Plain) return;
  if (a.depths != nullptr) a.depths[slot] = s.depth;
  if (a.perspectives != nullptr) a.perspectives[slot] = s.perspective;
}

/// The rows of tiles of a splat that binning takes row by row.
struct LargeRows {
  std::uint32_t first, count;
};

__device__ LargeRows large_rows(const BatchArgs& a, const SplatBounds& b) {
  const int shift = a.grid.tile_shift();
  const std::uint32_t first = static_cast<std::uint32_t>(b.y0 >> shift);
  return {first, static_cast<std::uint32_t>((b.y1 - 1) >> shift) + 1 - first};
}

__device__ void queue_large_row(const BatchArgs& a, unsigned long long place, std::uint32_t slot, std::uint32_t row) {
  if (place < a.large_capacity) a.large[place] = {slot, row};
}

/// Queues the rows of the lanes that have some; all lanes call both, `ask` first, so that nobody waits for the counter
/// until `put`.
class LargeQueue {
 public:
  __device__ void ask(const BatchArgs& a, const LargeRows& rows) {
    any_ = __any_sync(kAll, rows.count != 0);
    if (!any_) return;
    const std::uint32_t end = sum_to_lane(rows.count);
    begin_ = end - rows.count;
    if (threadIdx.x % 32 == 31) base_ = atomicAdd(&a.counters->large, static_cast<unsigned long long>(end));
  }
  __device__ void put(const BatchArgs& a, std::uint32_t slot, const LargeRows& rows) const {
    if (!any_) return;
    const unsigned long long base = __shfl_sync(kAll, base_, 31);
    share_in_warp(rows.count, [&](unsigned owner, std::uint32_t k) {
      const unsigned from = owner % 32;
      const std::uint32_t place = __shfl_sync(kAll, begin_, from) + k, of = __shfl_sync(kAll, slot, from),
                          row = __shfl_sync(kAll, rows.first, from) + k;
      if (owner < 32) queue_large_row(a, base + place, of, row);
    });
  }

 private:
  bool any_ = false;
  std::uint32_t begin_ = 0;      ///< of the lane's, among the warp's
  unsigned long long base_ = 0;  ///< of lane 31: where the warp's begin
};

/// 32 Gaussians as a warp keeps them for all cameras of an item, a lane each.
struct alignas(16) WarpRows {
  float mean[3][32], quat[4][32], scales[3][32], opacity[32];
  /// [32][rest], floats or halves as they are stored: from memory a warp would read 32 lines a
  /// coefficient.
  union {
    float sh[32 * 3 * (sh_coefficient_count(kMaxShDegree) - 1)];
    std::uint16_t sh_half[32 * 3 * (sh_coefficient_count(kMaxShDegree) - 1)];
  };
};

/// What a lane reads of its row.
struct LaneRow {
  float mean[3], quat[4], scales[3], opacity;
};

/// Of row `row`, or the first where there is none. Nothing is stored in between, nor decided: behind
/// either, reads would be waited for one after the other.
__device__ LaneRow read_row(const GaussianView& gs, std::size_t row) {
  const std::size_t at = row < gs.size ? row : 0;
  const bool has_axes = !gs.axes[0].empty();
  const auto of = [&](const View<const float>& plane) {
    return (has_axes ? gs.means[0].data : plane.data)[at];
  };
  LaneRow r;
  for (int k = 0; k < 3; ++k) r.mean[k] = gs.means[k].data[at];
  r.opacity = gs.opacities.data[at];
  for (int k = 0; k < 4; ++k) r.quat[k] = of(gs.quats[k]);
  for (int k = 0; k < 3; ++k) r.scales[k] = of(gs.scales[k]);
  return r;
}

__device__ void keep_row(const LaneRow& r, WarpRows& to) {
  const unsigned lane = threadIdx.x % 32;
  for (int k = 0; k < 3; ++k) to.mean[k][lane] = r.mean[k];
  to.opacity[lane] = r.opacity;
  for (int k = 0; k < 4; ++k) to.quat[k][lane] = r.quat[k];
  for (int k = 0; k < 3; ++k) to.scales[k][lane] = r.scales[k];
  __syncwarp();
}

/// Copies n values, a whole number of words, behind what the warp does next.
template <class T>
__device__ void copy_async(T* to, const T* from, unsigned n) {
  constexpr unsigned kWord = 4 / sizeof(T);
  const unsigned lane = threadIdx.x % 32;
  if (n % (4 * kWord) == 0 && reinterpret_cast<std::uintptr_t>(from) % 16 == 0) {
    for (unsigned i = 4 * kWord * lane; i < n; i += 128 * kWord)
      __pipeline_memcpy_async(to + i, from + i, 16);
  } else {
    for (unsigned i = kWord * lane; i < n; i += 32 * kWord) __pipeline_memcpy_async(to + i, from + i, 4);
  }
}

/// ask_for_sh for the bands up to `degree` of each row, `rest` values apart, of which no others are
/// read.
__device__ __noinline__ void ask_for_bands(const GaussianView& gs, int degree, unsigned rest,
                                           std::size_t first, WarpRows& to) {
  const unsigned rows = static_cast<unsigned>(gs.size - first < 32 ? gs.size - first : 32),
                 lane = threadIdx.x % 32;
  const unsigned kept = static_cast<unsigned>(3 * (sh_coefficient_count(degree) - 1));
  const std::size_t begin = rest * first;
  for (unsigned row = 0; row < rows; ++row) {
    if (lane >= kept) continue;  // at most 24 of degree 2
    const std::size_t from = begin + rest * row + lane;
    if (gs.shN_half.empty()) {
      __pipeline_memcpy_async(to.sh + kept * row + lane, gs.shN.data + from, sizeof(float));
    } else {
      to.sh_half[kept * row + lane] = gs.shN_half.data[from];
    }
  }
  __pipeline_commit();
}

/// Asks for the coefficients of rows `first` (lane 0) on, up to `degree` >= 1; they are there after
/// wait_for_sh.
__device__ void ask_for_sh(const GaussianView& gs, int degree, std::size_t first, WarpRows& to) {
  const std::size_t rest = static_cast<std::size_t>(3 * (sh_coefficient_count(gs.sh_degree) - 1));
  if (degree < gs.sh_degree) return ask_for_bands(gs, degree, static_cast<unsigned>(rest), first, to);
  const std::size_t rows = gs.size - first < 32 ? gs.size - first : 32;
  const unsigned n = static_cast<unsigned>(rest * rows);
  if (gs.shN_half.empty()) {
    copy_async(to.sh, gs.shN.data + rest * first, n);
  } else {
    const std::uint16_t* const from = gs.shN_half.data + rest * first;
    copy_async(to.sh_half, from, n & ~1u);
    if (n % 2 != 0 && threadIdx.x % 32 == 0) to.sh_half[n - 1] = from[n - 1];
  }
  __pipeline_commit();
}

__device__ void wait_for_sh() {
  __pipeline_wait_prior(0);
  __syncwarp();
}

/// Colour of row first + at after wait_for_sh; `degree` as it was asked for.
__device__ SplatColor<float> row_color(const GaussianView& gs, int degree, std::size_t first, unsigned at,
                                       const WarpRows& rows, const Vec3<float>& delta) {
  GaussianView v;  // of the warp's rows
  v.sh_degree = degree;
  v.sh0 = {gs.sh0.data + 3 * first, 3 * 32};
  if (gs.shN_half.empty()) {
    v.shN = {rows.sh, 1};
  } else {
    v.shN_half = {rows.sh_half, 1};
  }
  if (!gs.sh_rotations[0].empty()) {
    for (int k = 0; k < 4; ++k) v.sh_rotations[k] = {gs.sh_rotations[k].data + first, 32};
  }
  return gaussian_color<float>(v, degree, at, delta);
}

/// A warp half of an item: Gaussians are read once and projected for each camera of the mask, or where some of the
/// cameras see some of the rows only (`SomeRows`) those of all cameras side by side.
/// `Plain`: records of neither depth nor perspective are asked for.
template <bool Plain, bool SomeRows>
__global__ void __launch_bounds__(32 * kProjectWarps, kProjectBlocks)
    project_kernel(const BatchArgs a) {
  __shared__ WarpRows shared[kProjectWarps];
  const unsigned lane = threadIdx.x % 32;
  WarpRows& rows = shared[threadIdx.x / 32];
  const std::uint32_t halves = a.counters->items * kWarpsPerPart;
  WarpSlab slots(&a.counters->slots, a.slab), several(&a.counters->several, a.slab);
  const auto item_of = [&](std::uint32_t half) {
    return half < halves ? a.items[half / kWarpsPerPart] : BatchItem{};
  };
  std::uint32_t half = blockIdx.x * kProjectWarps + threadIdx.x / 32;
  BatchItem next = item_of(half);
  for (; half < halves; half += gridDim.x * kProjectWarps) {
    const BatchItem item = next;
    next = item_of(half + gridDim.x * kProjectWarps);
    const GaussianView& gs = a.instances[item.first_instance].args.gaussians;
    const std::size_t first = item.part * kChunkPart + half % kWarpsPerPart * 32;  // row of lane 0
    const unsigned existing =
        first >= gs.size ? 0u : gs.size - first >= 32 ? kAll : (1u << (gs.size - first)) - 1u;
    // Of the lane's instance.
    unsigned mine = 0;
    if constexpr (SomeRows) {
      if ((item.mask >> lane & 1u) != 0) {
        mine = existing & a.instances[item.first_instance + lane].args.gaussians.seen_rows(first / kProjectChunk)
                              .word(first % kProjectChunk / 32);
      }
      if (!__any_sync(kAll, mine != 0)) continue;
    }
    const LaneRow read = read_row(gs, first + lane);
    // Instances of a set are drawn to one degree.
    const int degree =
        gs.degree_of(item.part * kChunkPart, a.instances[item.first_instance].args.sh_degree);
    bool has_sh = !a.instances[item.first_instance].args.color || degree == 0 || existing == 0;
    __syncwarp();  // all lanes are done with the rows before
    if (!has_sh) ask_for_sh(gs, degree, first, rows);
    keep_row(read, rows);
    // Of lanes that `exist`: row first + at for an instance. All lanes call it together.
    const auto project_row = [&](bool exists, std::uint32_t index, unsigned at) {
      const BatchInstance& instance = a.instances[index];
      const ProjectArgs<float>& args = instance.args;
      const std::size_t row = first + at;
      const std::size_t origin = exists && !gs.origin_ids.empty() ? gs.origin_ids[row] : 0;
      bool drawn = false, hard = false;
      float key = 0;
      Splat splat;
      const Vec3<float> mean{rows.mean[0][at], rows.mean[1][at], rows.mean[2][at]};
      const Vec3<float> delta = gsnav::detail::camera_delta(args, mean, origin);
      const float z =
          depth_key(args.camera.key_rotation, args.camera.key_scale, mean, args.offsets_f[origin]);
      if (exists && z > args.camera.near_plane) {
        const SplatAxes<float> axes =
            gs.axes[0].empty() ? splat_axes(args.camera.rotation, delta,
                                            Quat<float>{rows.quat[0][at], rows.quat[1][at],
                                                        rows.quat[2][at], rows.quat[3][at]},
                                            Vec3<float>{rows.scales[0][at], rows.scales[1][at],
                                                        rows.scales[2][at]})
                               : gsnav::detail::load_axes(gs, args.camera, delta, row);
        const Projected<float> p = project<float, float>(args.camera, axes, z, rows.opacity[at]);
        if (p.visible) {
          key = key_of(args, z, mean, origin);
          hard = gsnav::detail::needs_double(args.camera, p);
          if (!hard) {
            double mean_x, mean_y;
            gsnav::detail::project_mean(args.camera64, vec_cast<double>(mean) + args.offsets[origin],
                                        mean_x, mean_y);
            drawn = make_splat<Plain>(args.camera, a.depths != nullptr, p, axes, mean_x, mean_y, splat);
          }
        }
      }
      const bool wanted = drawn || hard;
      const std::uint64_t taken = slots.take(wanted);
      const std::uint32_t slot =
          wanted && taken < a.slot_capacity ? static_cast<std::uint32_t>(taken) : kNoSlot;
      if (hard) {
        const unsigned long long place = atomicAdd(&a.counters->hard, 1ull);
        if (slot != kNoSlot) a.entries[slot] = {0, 0, 0, kNoSlot};  // until it has a record
        if (place < a.hard_capacity) a.hard[place] = {slot, index, static_cast<std::uint32_t>(row)};
      }
      LargeRows large{0, 0};
      if (drawn && slot != kNoSlot && is_large(a, splat.bounds)) large = large_rows(a, splat.bounds);
      LargeQueue queue;
      queue.ask(a, large);
      if (!has_sh && __any_sync(kAll, drawn)) {
        wait_for_sh();
        has_sh = true;
      }
      if (drawn && slot != kNoSlot) {
        write_record<Plain>(a, slot, instance, key, row, splat,
                            args.color ? row_color(gs, degree, first, at, rows, delta) : SplatColor<float>{});
      }
      const TileWindow window = drawn && slot != kNoSlot ? window_of(a, splat.bounds) : TileWindow{0, 0};
      const bool single = window.tiles != 0;
      const std::uint32_t tile = tile_of(a, instance.camera, window, 0),
                          code = args.camera.key_code(key);
      if (a.depth_bins.many()) {
        add_pair<true, false>(a, single, tile, code);
      } else {
        add_pair<false, false>(a, single, tile, code);
      }
      const bool queued = drawn && slot != kNoSlot && !single;
      queue.put(a, slot, large);
      const bool few_tiles = queued && large.count == 0;
      const std::uint64_t place = several.take(few_tiles);
      if (few_tiles && place < a.several_capacity) a.several[place] = slot;
    };
    if constexpr (SomeRows) {
      share_in_warp(static_cast<std::uint32_t>(__popc(mine)), [&](unsigned owner, std::uint32_t n) {
        const unsigned from = owner % 32, of_owner = __shfl_sync(kAll, mine, from);
        // What has nothing left goes with the first instance.
        project_row(owner < 32, item.first_instance + (owner < 32 ? from : 0u),
                    owner < 32 ? nth_bit<32>(of_owner, n) : 0u);
      });
    } else {
      for (std::uint32_t mask = item.mask; mask != 0; mask &= mask - 1) {
        project_row((existing >> lane & 1u) != 0,
                    item.first_instance + static_cast<std::uint32_t>(__ffs(static_cast<int>(mask))) - 1, lane);
      }
    }
    if (!has_sh) wait_for_sh();
  }
  slots.rest([&](std::uint64_t slot) {
    if (slot < a.slot_capacity) a.entries[slot] = {0, 0, 0, kNoSlot};
  });
  several.rest([&](std::uint64_t place) {
    if (place < a.several_capacity) a.several[place] = kNoSlot;
  });
}

__global__ void __launch_bounds__(128) project_hard_kernel(const BatchArgs a) {
  const std::uint32_t n = used(a.counters->hard, a.hard_capacity);
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += gridDim.x * blockDim.x) {
    const HardSplat h = a.hard[i];
    if (h.slot == kNoSlot) continue;
    const BatchInstance& instance = a.instances[h.instance];
    const ProjectArgs<float>& args = instance.args;
    const GaussianView& gs = args.gaussians;
    const std::size_t origin = gs.origin_ids.empty() ? 0 : gs.origin_ids[h.row];
    const Vec3<float> mean{gs.means[0][h.row], gs.means[1][h.row], gs.means[2][h.row]};
    const float z =
        depth_key(args.camera.key_rotation, args.camera.key_scale, mean, args.offsets_f[origin]);
    const float key = key_of(args, z, mean, origin);
    Splat splat;
    if (make_splat64(args, a.depths != nullptr, h.row, key, mean, origin, splat)) {
      SplatColor<float> color;
      if (args.color) {
        color = gaussian_color<float>(gs, gs.degree_of(h.row, args.sh_degree), h.row,
                                      gsnav::detail::camera_delta(args, mean, origin));
      }
      write_record<false>(a, h.slot, instance, key, h.row, splat, color);
      const TileWindow window = window_of(a, splat.bounds);
      if (window.tiles != 0) {
        atomicAdd(a.bins + bin_of(a, tile_of(a, instance.camera, window, 0), args.camera.key_code(key)),
                  1u);
      } else if (is_large(a, splat.bounds)) {
        const LargeRows rows = large_rows(a, splat.bounds);
        const unsigned long long place = atomicAdd(&a.counters->large, static_cast<unsigned long long>(rows.count));
        for (std::uint32_t k = 0; k < rows.count; ++k) queue_large_row(a, place + k, h.slot, rows.first + k);
      } else {
        const unsigned long long place = atomicAdd(&a.counters->several, 1ull);
        if (place < a.several_capacity) a.several[place] = h.slot;
      }
    }
  }
}

}  // namespace

void launch_projection(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = static_cast<unsigned>(multiprocessors) * 8;
  cull_kernel<<<blocks, kThreads, 0, stream>>>(args);
  const bool plain = args.depths == nullptr && args.perspectives == nullptr;
  const auto project = [&](auto kernel) {
    kernel<<<static_cast<unsigned>(multiprocessors) * kProjectBlocks, 32 * kProjectWarps, 0, stream>>>(args);
  };
  if (args.seen_rows) {
    project(plain ? project_kernel<true, true> : project_kernel<false, true>);
  } else {
    project(plain ? project_kernel<true, false> : project_kernel<false, false>);
  }
  project_hard_kernel<<<blocks, 128, 0, stream>>>(args);
}

}  // namespace gsnav::cuda
