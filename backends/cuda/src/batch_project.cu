// SPDX-License-Identifier: Apache-2.0
#include "batch_lists.cuh"
#include "batch_rows.cuh"

// Projection of a batch, by the same formulas as CPU backends use for one camera.

namespace gsnav::cuda {

namespace {

using Policy = policy::Project;
constexpr unsigned kWarpsPerPart = kChunkPart / 32;

/// Mask of the 32 rows from `first` on: 1 if a set of `size` rows has that row.
__device__ unsigned rows_there(std::size_t size, std::size_t first) {
  if (first >= size) return 0u;
  return size - first >= 32 ? kAll : (1u << (size - first)) - 1u;
}

/// Writes the record of a splat. `Reserved`: lists have reserved space and are not counted first.
template <bool GeometryOnly, bool Reserved>
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
  if constexpr (!Reserved) {
    const TileWindow window = window_of(a, s.bounds);
    a.entries[of.slot] = {of.key, window.corner, window.tiles, of.camera};
  }
  a.sources[of.slot] = source;
  if (GeometryOnly) return;
  if (a.depths != nullptr) a.depths[of.slot] = s.depth;
  if (a.perspectives != nullptr) a.perspectives[of.slot] = s.perspective;
}

/// Result of projecting a row for one camera.
struct CameraSplat {
  bool drawn = false;
  bool precise = false;  ///< It needs double: project_precise_kernel draws it.
  std::uint32_t code = 0, camera = 0;
  RowKey<float> key;
  Splat splat;
};

/// Work of a warp: it reads 32 Gaussians (half of an item) once and projects them for each camera of the
/// mask. If cameras see only some of the rows (`SomeRows`), the rows of all cameras are processed side
/// by side. All lanes must call every function together.
/// @tparam PlainRules There are plain_cameras.
/// @tparam GeometryOnly Records of depth and perspective are not needed.
/// @tparam Reserved Lists have reserved space and are not counted first.
template <bool PlainRules, bool GeometryOnly, bool SomeRows, bool Reserved>
class WarpProjection {
 public:
  __device__ WarpProjection(const BatchArgs& args, WarpRows& rows)
      : a_(args),
        rows_(rows),
        slots_(&args.counters->slots, args.slab),
        several_(&args.counters->several, args.slab) {}

  __device__ void project(const BatchItem& item, std::uint32_t half) {
    first_instance_ = item.first_instance;
    gaussians_ = &a_.instances[first_instance_].args.gaussians;
    first_ = item.part * kChunkPart + half % kWarpsPerPart * 32;
    const unsigned lane = threadIdx.x % 32;
    const unsigned existing = rows_there(gaussians_->size(), first_);
    unsigned seen = 0;  // Mask of the rows that the lane's instance may see.
    if constexpr (SomeRows) {
      if ((item.mask >> lane & 1u) != 0) seen = existing & seen_rows_of(lane);
      if (!__any_sync(kAll, seen != 0)) return;
    }
    read(item.part, existing != 0);
    if constexpr (SomeRows) {
      share_in_warp(static_cast<std::uint32_t>(__popc(seen)), [&](unsigned owner, std::uint32_t n) {
        const unsigned from = owner % 32, of_owner = __shfl_sync(kAll, seen, from);
        // Lanes without work use the first instance, so that they can join the warp-wide calls.
        draw(owner < 32, first_instance_ + (owner < 32 ? from : 0u),
             owner < 32 ? nth_bit<32>(of_owner, n) : 0u);
      });
    } else {
      for (std::uint32_t mask = item.mask; mask != 0; mask &= mask - 1) {
        draw((existing >> lane & 1u) != 0,
             first_instance_ + static_cast<std::uint32_t>(__ffs(static_cast<int>(mask))) - 1, lane);
      }
    }
    if (!has_sh_) wait_for_sh();
  }

  /// Marks places that were reserved but not used.
  __device__ void mark_rest() const {
    if constexpr (!Reserved) {
      slots_.rest([&](std::uint64_t slot) {
        if (slot < a_.slot_capacity) a_.entries[slot] = {0, 0, 0, kNoSlot};
      });
    }
    several_.rest([&](std::uint64_t place) {
      if (place < a_.several_capacity) a_.several[place] = {0, 0, kNoSlot};
    });
  }

 private:
  __device__ std::uint32_t seen_rows_of(unsigned lane) const {
    return a_.instances[first_instance_ + lane]
        .args.seen_rows(first_ / kProjectChunk)
        .word(first_ % kProjectChunk / 32);
  }

  /// Reads the rows and requests their SH coefficients.
  __device__ void read(std::uint32_t part, bool any) {
    const LaneRow read = read_row<PlainRules>(gaussians_->shape, first_ + threadIdx.x % 32);
    // All instances of a set are drawn with one degree.
    degree_ =
        gaussians_->color.degree_of(part * kChunkPart, a_.instances[first_instance_].args.sh_degree);
    has_sh_ = !a_.color || degree_ == 0 || !any;
    __syncwarp();  // Wait until no lane uses the previous rows.
    if (!has_sh_) ask_for_sh(gaussians_->color, gaussians_->size(), degree_, first_, rows_);
    keep_row(read, rows_);
  }

  /// Projects row first_ + at for an instance and lists it. `exists` is false for lanes without a row.
  __device__ void draw(bool exists, std::uint32_t index, unsigned at) {
    const std::uint32_t row = static_cast<std::uint32_t>(first_ + at);
    CameraSplat projected;
    project_row(exists, index, at, projected);
    const bool wanted = projected.drawn || projected.precise;
    const std::uint64_t taken = slots_.take(wanted);
    const std::uint32_t slot =
        wanted && taken < a_.slot_capacity ? static_cast<std::uint32_t>(taken) : kNoSlot;
    if (projected.precise) queue_precise({slot, index, row});
    list(projected, slot, index, at);
  }

  /// Projects row first_ + at for an instance.
  __device__ void project_row(bool exists, std::uint32_t index, unsigned at, CameraSplat& out) const {
    // For rows beyond the near plane.
    const auto fill = [&](const ProjectionCamera<float>& camera, const auto& from,
                          const auto& camera64) {
      const ProjectedRow<float> projected(camera, from, out.key);
      if (!projected.splat.visible) return;
      out.precise = gsnav::detail::needs_double(camera, projected.splat);
      out.drawn = !out.precise && make_splat<GeometryOnly>(camera, camera64(), a_.depths != nullptr,
                                                           out.key, projected, out.splat);
    };
    if constexpr (PlainRules) {
      const PlainCamera& packed = a_.plain_cameras[index];
      const PlainRow from({rows_, at}, packed);
      out.key = row_key<float>(key_camera_of(packed), from);
      out.camera = packed.axes.camera;
      const float near_plane = packed.key.near_plane;
      if (exists && beyond_near_plane(near_plane, out.key.z)) {
        ProjectionCamera<float> camera = camera_of(a_, packed.axes);
        camera.near_plane = near_plane;
        out.code = packed.code.key(out.key.z);
        fill(camera, from, [&] { return camera_of(PlainCamera::Mean(packed.mean)); });
      }
    } else {
      const BatchInstance& instance = a_.instances[index];
      const ViewedSet<float>& args = instance.args;
      const InstanceRow from({rows_, at}, {{gaussians_->shape, exists ? first_ + at : 0}, args.offsets});
      out.key = row_key<float>(args.camera64, from);
      out.camera = instance.camera;
      if (exists && beyond_near_plane(args.camera.near_plane, out.key.z)) {
        out.code = args.camera.key_code(sort_key(args.camera64, out.key));
        fill(args.camera, from, [&]() -> const ProjectionCamera<double>& { return args.camera64; });
      }
    }
  }

  __device__ void queue_precise(const PreciseSplat& splat) const {
    const unsigned long long place = atomicAdd(&a_.counters->precise, 1ull);
    if (!Reserved && splat.slot != kNoSlot)
      a_.entries[splat.slot] = {0, 0, 0, kNoSlot};  // Until it has a record.
    if (place < a_.precise_capacity) a_.precise[place] = splat;
  }

  /// Writes the record and the pairs of a visible splat, or queues it for a kernel that finds its tiles.
  __device__ void list(const CameraSplat& projected, std::uint32_t slot, std::uint32_t index,
                       unsigned at) {
    const SplatKey of{slot, projected.code, projected.camera};
    const SplatBounds& bounds = projected.splat.bounds;
    const bool listed = projected.drawn && slot != kNoSlot;
    LargeRows large{0, 0};
    if (listed && is_large(a_, bounds)) large = large_rows(a_, bounds);
    LargeQueue queue;
    queue.ask(a_, large);
    const bool small = listed && large.count == 0;
    const bool queued = small && (Reserved ? is_wide(a_, bounds) : window_of(a_, bounds).tiles == 0);
    NearPairs pairs;
    if constexpr (Reserved) pairs.ask(a_, projected.camera, small && !queued, bounds);
    if (!has_sh_ && __any_sync(kAll, projected.drawn)) {
      wait_for_sh();
      has_sh_ = true;
    }
    if (listed) write(of, projected, index, at);
    if constexpr (Reserved) {
      pairs.put(a_, {projected.code, slot});
    } else if (small && !queued) {
      add_to_bin(a_, tile_of(a_, projected.camera, window_of(a_, bounds), 0), projected.code);
    }
    queue.put(a_, of, large);
    if (__any_sync(kAll, queued)) {
      const std::uint64_t place = several_.take(queued);
      if (queued && place < a_.several_capacity) a_.several[place] = of;
    }
  }

  __device__ void write(const SplatKey& of, const CameraSplat& projected, std::uint32_t index,
                        unsigned at) const {
    std::uint32_t first_rank;
    if constexpr (PlainRules) {
      first_rank = a_.plain_cameras[index].code.first_rank;
    } else {
      first_rank = a_.instances[index].args.first_rank;
    }
    write_record<GeometryOnly, Reserved>(
        a_, of, first_rank + static_cast<std::uint32_t>(first_ + at), projected.splat,
        a_.color
            ? row_color<PlainRules>(gaussians_->color, degree_, first_, at, rows_, projected.key.delta)
            : SplatColor<float>{});
  }

  const BatchArgs& a_;
  WarpRows& rows_;
  WarpSlab slots_, several_;
  // State of the current item.
  const GaussianRows* gaussians_ = nullptr;
  std::uint32_t first_instance_ = 0;
  std::size_t first_ = 0;  ///< Row of lane 0.
  int degree_ = 0;
  bool has_sh_ = false;  ///< The coefficients have arrived, or are not needed.
};

template <bool PlainRules, bool GeometryOnly, bool SomeRows, bool Reserved>
__global__ void __launch_bounds__(32 * Policy::kWarps, Policy::kResident)
    project_kernel(const BatchArgs a) {
  __shared__ WarpRows shared[Policy::kWarps];
  WarpProjection<PlainRules, GeometryOnly, SomeRows, Reserved> warp(a, shared[threadIdx.x / 32]);
  const std::uint32_t halves = a.counters->items * kWarpsPerPart;
  const auto item_of = [&](std::uint32_t half) {
    return half < halves ? a.items[half / kWarpsPerPart] : BatchItem{};
  };
  std::uint32_t half = blockIdx.x * Policy::kWarps + threadIdx.x / 32;
  BatchItem next = item_of(half);
  for (; half < halves; half += gridDim.x * Policy::kWarps) {
    const BatchItem item = next;
    next = item_of(half + gridDim.x * Policy::kWarps);
    warp.project(item, half);
  }
  warp.mark_rest();
}

__global__ void __launch_bounds__(Policy::kPreciseThreads) project_precise_kernel(const BatchArgs a) {
  const std::uint32_t n = used(a.counters->precise, a.precise_capacity);
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += gridDim.x * blockDim.x) {
    const PreciseSplat h = a.precise[i];
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
  const unsigned blocks = static_cast<unsigned>(multiprocessors) * Policy::kPreciseBlocks;
  const bool geometry_only = args.depths == nullptr && args.perspectives == nullptr;
  const auto project = [&](auto kernel) {
    kernel<<<static_cast<unsigned>(multiprocessors) * Policy::kResident, 32 * Policy::kWarps, 0,
             stream>>>(args);
  };
  const auto of_lists = [&]<bool SomeRows, bool Reserved>() {
    if (geometry_only && args.plain_cameras != nullptr)
      return project(project_kernel<true, true, SomeRows, Reserved>);
    project(geometry_only ? project_kernel<false, true, SomeRows, Reserved>
                          : project_kernel<false, false, SomeRows, Reserved>);
  };
  if (args.seen_rows) {
    args.list_room != 0 ? of_lists.template operator()<true, true>()
                        : of_lists.template operator()<true, false>();
  } else {
    args.list_room != 0 ? of_lists.template operator()<false, true>()
                        : of_lists.template operator()<false, false>();
  }
  project_precise_kernel<<<blocks, Policy::kPreciseThreads, 0, stream>>>(args);
}

}  // namespace gsnav::cuda
