// SPDX-License-Identifier: Apache-2.0
#include "batch_lists.cuh"
#include "batch_rows.cuh"

// Projection of a batch: what CPU backends do one camera at a time, by the same formulas.

namespace gsnav::cuda {

namespace {

constexpr unsigned kProjectWarps = 4, kProjectBlocks = 5;  ///< of a block; of a multiprocessor
constexpr unsigned kWarpsPerPart = kChunkPart / 32;
constexpr unsigned kAll = 0xffffffffu;

/// A bit for each of the 32 rows from `first` on: 1 where a set of `size` rows has that row.
__device__ unsigned rows_there(std::size_t size, std::size_t first) {
  if (first >= size) return 0u;
  return size - first >= 32 ? kAll : (1u << (size - first)) - 1u;
}

/// `Room`: lists are not counted first.
template <bool Plain, bool Room>
__device__ void write_record(const BatchArgs& a, const SplatKey& of, std::uint32_t source,
                             const Splat& s, const SplatColor<float>& c) {
  const SplatGeometry<float>& g = s.geometry;
  const auto pack = [](std::uint32_t low, std::uint32_t high) { return low | high << 16; };
  const std::uint32_t x =
      pack(static_cast<std::uint32_t>(s.bounds.x0), static_cast<std::uint32_t>(s.bounds.x1));
  const std::uint32_t y =
      pack(static_cast<std::uint32_t>(s.bounds.y0), static_cast<std::uint32_t>(s.bounds.y1));
  a.records[of.slot] = {pack(static_cast<std::uint32_t>(g.ref_x), static_cast<std::uint32_t>(g.ref_y)),
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
  if constexpr (!Room) {
    const TileWindow window = window_of(a, s.bounds);
    a.entries[of.slot] = {of.key, window.corner, window.tiles, of.camera};
  }
  a.sources[of.slot] = source;
  if (Plain) return;
  if (a.depths != nullptr) a.depths[of.slot] = s.depth;
  if (a.perspectives != nullptr) a.perspectives[of.slot] = s.perspective;
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

__device__ void queue_large_row(const BatchArgs& a, unsigned long long place, const SplatKey& splat,
                                std::uint32_t row) {
  if (place < a.large_capacity) a.large[place] = {splat, row};
}

/// Queues the rows of the lanes that have some; all lanes call both, `ask` first, so that nobody waits
/// for the counter until `put`.
class LargeQueue {
 public:
  __device__ void ask(const BatchArgs& a, const LargeRows& rows) {
    any_ = __any_sync(kAll, rows.count != 0);
    if (!any_) return;
    const std::uint32_t end = sum_to_lane(rows.count);
    begin_ = end - rows.count;
    if (threadIdx.x % 32 == 31)
      base_ = atomicAdd(&a.counters->large, static_cast<unsigned long long>(end));
  }
  __device__ void put(const BatchArgs& a, const SplatKey& splat, const LargeRows& rows) const {
    if (!any_) return;
    const unsigned long long base = __shfl_sync(kAll, base_, 31);
    share_in_warp(rows.count, [&](unsigned owner, std::uint32_t k) {
      const unsigned from = owner % 32;
      const std::uint32_t place = __shfl_sync(kAll, begin_, from) + k,
                          row = __shfl_sync(kAll, rows.first, from) + k;
      const SplatKey of{__shfl_sync(kAll, splat.slot, from), __shfl_sync(kAll, splat.key, from),
                        __shfl_sync(kAll, splat.camera, from)};
      if (owner < 32) queue_large_row(a, base + place, of, row);
    });
  }

 private:
  bool any_ = false;
  std::uint32_t begin_ = 0;      ///< of the lane's, among the warp's
  unsigned long long base_ = 0;  ///< of lane 31: where the warp's begin
};

/// A warp half of an item: Gaussians are read once and projected for each camera of the mask, or where
/// some of the cameras see some of the rows only (`SomeRows`) those of all cameras side by side.
/// `Plain`: records of neither depth nor perspective are asked for. `PlainRules`: there are
/// plain_cameras. `Room`: lists are not counted first.
template <bool PlainRules, bool Plain, bool SomeRows, bool Room>
__global__ void __launch_bounds__(32 * kProjectWarps, kProjectBlocks) project_kernel(const BatchArgs a) {
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
    const GaussianRows& gs = a.instances[item.first_instance].args.gaussians;
    const std::size_t size = gs.size();
    const std::size_t first = item.part * kChunkPart + half % kWarpsPerPart * 32;  // row of lane 0
    const unsigned existing = rows_there(size, first);
    // Of the lane's instance.
    unsigned mine = 0;
    if constexpr (SomeRows) {
      if ((item.mask >> lane & 1u) != 0) {
        mine = existing & a.instances[item.first_instance + lane]
                              .args.seen_rows(first / kProjectChunk)
                              .word(first % kProjectChunk / 32);
      }
      if (!__any_sync(kAll, mine != 0)) continue;
    }
    const LaneRow read = read_row<PlainRules>(gs.shape, first + lane);
    // Instances of a set are drawn to one degree.
    const int degree =
        gs.color.degree_of(item.part * kChunkPart, a.instances[item.first_instance].args.sh_degree);
    bool has_sh = !a.color || degree == 0 || existing == 0;
    __syncwarp();  // all lanes are done with the rows before
    if (!has_sh) ask_for_sh(gs.color, size, degree, first, rows);
    keep_row(read, rows);
    // Of lanes that `exist`: row first + at for an instance. All lanes call it together.
    const auto draw_row = [&](bool exists, std::uint32_t index, unsigned at) {
      const std::size_t row = first + at;
      bool drawn = false, hard = false;
      std::uint32_t code = 0, camera_index = 0;
      Splat splat;
      RowKey<float> key;
      // Of what lies beyond the near plane: the splat, or that it is hard.
      const auto project_row = [&](const ProjectionCamera<float>& camera, const auto& from,
                                   const auto& camera64) {
        const SeenRow<float> seen_row(camera, from, key);
        if (!seen_row.splat.visible) return;
        hard = gsnav::detail::needs_double(camera, seen_row.splat);
        drawn =
            !hard && make_splat<Plain>(camera, camera64(), a.depths != nullptr, key, seen_row, splat);
      };
      if constexpr (PlainRules) {
        const PlainCamera& packed = a.plain_cameras[index];
        const PlainRow from({rows, at}, packed);
        key = row_key<float>(key_camera_of(packed), from);
        camera_index = packed.axes.camera;
        const float near_plane = packed.key.near_plane;
        if (exists && key.z > near_plane) {
          ProjectionCamera<float> camera = camera_of(a, packed.axes);
          camera.near_plane = near_plane;
          code = packed.code.key(key.z);
          project_row(camera, from, [&] { return camera_of(PlainCamera::Mean(packed.mean)); });
        }
      } else {
        const BatchInstance& instance = a.instances[index];
        const ViewedSet<float>& args = instance.args;
        const InstanceRow from({rows, at}, {{gs.shape, exists ? row : 0}, args.offsets});
        key = row_key<float>(args.camera64, from);
        camera_index = instance.camera;
        if (exists && key.z > args.camera.near_plane) {
          code = args.camera.key_code(sort_key(args.camera64, key));
          project_row(args.camera, from,
                      [&]() -> const ProjectionCamera<double>& { return args.camera64; });
        }
      }
      const bool wanted = drawn || hard;
      const std::uint64_t taken = slots.take(wanted);
      const std::uint32_t slot =
          wanted && taken < a.slot_capacity ? static_cast<std::uint32_t>(taken) : kNoSlot;
      if (hard) {
        const unsigned long long place = atomicAdd(&a.counters->hard, 1ull);
        if (!Room && slot != kNoSlot) a.entries[slot] = {0, 0, 0, kNoSlot};  // until it has a record
        if (place < a.hard_capacity) a.hard[place] = {slot, index, static_cast<std::uint32_t>(row)};
      }
      const SplatKey of{slot, code, camera_index};
      const bool listed = drawn && slot != kNoSlot;
      LargeRows large{0, 0};
      if (listed && is_large(a, splat.bounds)) large = large_rows(a, splat.bounds);
      LargeQueue queue;
      queue.ask(a, large);
      const bool small = listed && large.count == 0;
      // Those whose tiles another kernel finds.
      const bool queued =
          small && (Room ? is_wide(a, splat.bounds) : window_of(a, splat.bounds).tiles == 0);
      NearPairs pairs;
      if constexpr (Room) pairs.ask(a, camera_index, small && !queued, splat.bounds);
      if (!has_sh && __any_sync(kAll, drawn)) {
        wait_for_sh();
        has_sh = true;
      }
      if (listed) {
        std::uint32_t first_rank;
        if constexpr (PlainRules) {
          first_rank = a.plain_cameras[index].code.first_rank;
        } else {
          first_rank = a.instances[index].args.first_rank;
        }
        write_record<Plain, Room>(
            a, of, first_rank + static_cast<std::uint32_t>(row), splat,
            a.color ? row_color<PlainRules>(gs.color, degree, first, at, rows, key.delta)
                    : SplatColor<float>{});
      }
      if constexpr (Room) {
        pairs.put(a, {code, slot});
      } else if (small && !queued) {
        add_to_bin(a, tile_of(a, camera_index, window_of(a, splat.bounds), 0), code);
      }
      queue.put(a, of, large);
      if (__any_sync(kAll, queued)) {
        const std::uint64_t place = several.take(queued);
        if (queued && place < a.several_capacity) a.several[place] = of;
      }
    };
    if constexpr (SomeRows) {
      share_in_warp(static_cast<std::uint32_t>(__popc(mine)), [&](unsigned owner, std::uint32_t n) {
        const unsigned from = owner % 32, of_owner = __shfl_sync(kAll, mine, from);
        // What has nothing left goes with the first instance.
        draw_row(owner < 32, item.first_instance + (owner < 32 ? from : 0u),
                 owner < 32 ? nth_bit<32>(of_owner, n) : 0u);
      });
    } else {
      for (std::uint32_t mask = item.mask; mask != 0; mask &= mask - 1) {
        draw_row((existing >> lane & 1u) != 0,
                 item.first_instance + static_cast<std::uint32_t>(__ffs(static_cast<int>(mask))) - 1,
                 lane);
      }
    }
    if (!has_sh) wait_for_sh();
  }
  if constexpr (!Room) {
    slots.rest([&](std::uint64_t slot) {
      if (slot < a.slot_capacity) a.entries[slot] = {0, 0, 0, kNoSlot};
    });
  }
  several.rest([&](std::uint64_t place) {
    if (place < a.several_capacity) a.several[place] = {0, 0, kNoSlot};
  });
}

__global__ void __launch_bounds__(128) project_hard_kernel(const BatchArgs a) {
  const std::uint32_t n = used(a.counters->hard, a.hard_capacity);
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += gridDim.x * blockDim.x) {
    const HardSplat h = a.hard[i];
    if (h.slot == kNoSlot) continue;
    const BatchInstance& instance = a.instances[h.instance];
    const ViewedSet<float>& args = instance.args;
    const ColorRows& sh = args.gaussians.color;
    const ViewedRow row({args.gaussians.shape, h.row}, args.offsets);
    const RowKey<float> key = row_key<float>(args.camera64, row);
    Splat splat;
    if (make_splat64(args.camera64, a.depths != nullptr, row, key, splat)) {
      SplatColor<float> color;
      if (a.color)
        color = gaussian_color<float>(sh, sh.degree_of(h.row, args.sh_degree), h.row, key.delta);
      const SplatKey of{h.slot, args.camera.key_code(sort_key(args.camera64, key)), instance.camera};
      const std::uint32_t source = args.first_rank + h.row;
      const bool counted = a.list_room == 0;
      if (counted) {
        write_record<false, false>(a, of, source, splat, color);
      } else {
        write_record<false, true>(a, of, source, splat, color);
      }
      const TileWindow window = window_of(a, splat.bounds);
      if (counted && window.tiles != 0) {
        add_to_bin(a, tile_of(a, of.camera, window, 0), of.key);
      } else if (is_large(a, splat.bounds)) {
        const LargeRows rows = large_rows(a, splat.bounds);
        const unsigned long long place =
            atomicAdd(&a.counters->large, static_cast<unsigned long long>(rows.count));
        for (std::uint32_t k = 0; k < rows.count; ++k) queue_large_row(a, place + k, of, rows.first + k);
      } else {
        const unsigned long long place = atomicAdd(&a.counters->several, 1ull);
        if (place < a.several_capacity) a.several[place] = of;
      }
    }
  }
}

}  // namespace

void launch_projection(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = static_cast<unsigned>(multiprocessors) * 8;
  const bool plain = args.depths == nullptr && args.perspectives == nullptr;
  const auto project = [&](auto kernel) {
    kernel<<<static_cast<unsigned>(multiprocessors) * kProjectBlocks, 32 * kProjectWarps, 0, stream>>>(
        args);
  };
  const auto of_lists = [&]<bool SomeRows, bool Room>() {
    if (plain && args.plain_cameras != nullptr)
      return project(project_kernel<true, true, SomeRows, Room>);
    project(plain ? project_kernel<false, true, SomeRows, Room>
                  : project_kernel<false, false, SomeRows, Room>);
  };
  if (args.seen_rows) {
    args.list_room != 0 ? of_lists.template operator()<true, true>()
                        : of_lists.template operator()<true, false>();
  } else {
    args.list_room != 0 ? of_lists.template operator()<false, true>()
                        : of_lists.template operator()<false, false>();
  }
  project_hard_kernel<<<blocks, 128, 0, stream>>>(args);
}

}  // namespace gsnav::cuda
