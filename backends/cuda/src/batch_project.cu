// SPDX-License-Identifier: Apache-2.0
#include "batch_args.cuh"

// Culling and projection of a batch: what CPU backends do one camera at a time, by the same formulas.

namespace gsnav::cuda {

namespace {

constexpr unsigned kThreads = 256, kWarps = kThreads / 32;
constexpr unsigned kWarpsPerChunk = kProjectChunk / 32;
constexpr unsigned kAll = 0xffffffffu;

/// A warp a unit: the lanes are instances.
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
    const std::uint32_t word = at / set.chunks, chunk = at % set.chunks;
    const std::uint32_t first = set.first_instance + 32 * word, index = 32 * word + lane;
    const bool seen = index < set.instances && chunk_is_candidate(a.instances[first + lane].args, chunk);
    const unsigned mask = __ballot_sync(kAll, seen);
    if (lane == 0 && mask != 0) a.items[atomicAdd(&a.counters->items, 1u)] = {first, chunk, mask};
  }
}

struct Splat {
  SplatGeometry<float> geometry;
  SplatBounds bounds;
  SplatDepth<float> depth;
  SplatPerspective<float> perspective;
};

/// `store_splat` into registers. False where no pixel centre lies in the bounds.
template <class T, class U>
__device__ bool make_splat(const ProjectionCamera<T>& camera, bool depth, const Projected<T>& p,
                           const SplatAxes<T>& axes, U mean_x, U mean_y, Splat& out) {
  ProjectArgs<float> to;
  to.depth = depth;
  to.geometry = {&out.geometry, 1};
  to.bounds = {&out.bounds, 1};
  to.depths = {&out.depth, 1};
  to.perspectives = {&out.perspective, 1};
  return detail::store_splat(to, 0, camera, p, axes, mean_x, mean_y);
}

__device__ void write_record(const BatchArgs& a, std::uint32_t slot, const BatchInstance& instance, float key,
                             std::size_t row, const Splat& s, const SplatColor<float>& c) {
  const SplatGeometry<float>& g = s.geometry;
  const auto pack = [](std::uint32_t low, std::uint32_t high) { return low | high << 16; };
  const std::uint32_t x = pack(static_cast<std::uint32_t>(s.bounds.x0), static_cast<std::uint32_t>(s.bounds.x1));
  const std::uint32_t y = pack(static_cast<std::uint32_t>(s.bounds.y0), static_cast<std::uint32_t>(s.bounds.y1));
  a.records[slot] = {pack(static_cast<std::uint32_t>(g.ref_x), static_cast<std::uint32_t>(g.ref_y)),
                     g.a, g.k, g.b, g.w1, g.w2, g.log2_opacity, c.r, c.g, c.b, x, y};
  a.entries[slot] = {instance.args.camera.key_code(key), x, y, instance.camera};
  a.sources[slot] = instance.args.first_rank + static_cast<std::uint32_t>(row);
  if (a.depths != nullptr) a.depths[slot] = s.depth;
  if (a.perspectives != nullptr) a.perspectives[slot] = s.perspective;
}

__device__ SplatColor<float> color_of(const ProjectArgs<float>& args, std::size_t row, const Vec3<float>& mean,
                                      std::size_t origin) {
  if (!args.color) return {};
  return gaussian_color<float>(args.gaussians, args.sh_degree, row, detail::camera_delta(args, mean, origin));
}

__device__ float key_of(const ProjectArgs<float>& args, float z, const Vec3<float>& mean, std::size_t origin) {
  return args.camera.sort_order == SortOrder::z_depth
             ? z
             : distance_key(args.camera.key_scale, mean, args.offsets_f[origin]);
}

/// Slots that a warp holds; what it has not used when it ends is marked.
class WarpSlots {
 public:
  explicit __device__ WarpSlots(const BatchArgs& a) : a_(a), lane_(threadIdx.x % 32) {}

  /// The slot of each lane that wants one; kNoSlot past the capacity. All lanes call it.
  __device__ std::uint32_t take(bool wanted) {
    const unsigned votes = __ballot_sync(kAll, wanted);
    if (votes == 0) return kNoSlot;
    const std::uint32_t count = static_cast<std::uint32_t>(__popc(votes));
    const std::uint32_t place = static_cast<std::uint32_t>(__popc(votes & ((1u << lane_) - 1)));
    std::uint64_t slot = next_ + place;
    if (count > left_) {
      unsigned long long slab = 0;
      if (lane_ == 0) slab = atomicAdd(&a_.counters->slots, static_cast<unsigned long long>(a_.slab));
      slab = __shfl_sync(kAll, slab, 0);
      if (place >= left_) slot = slab + place - left_;
      next_ = slab + count - left_;
      left_ = a_.slab - (count - left_);
    } else {
      next_ += count;
      left_ -= count;
    }
    return wanted && slot < a_.slot_capacity ? static_cast<std::uint32_t>(slot) : kNoSlot;
  }

  __device__ void finish() const {
    for (std::uint32_t i = lane_; i < left_; i += 32) {
      if (next_ + i < a_.slot_capacity) a_.entries[next_ + i].camera = kNoSlot;
    }
  }

 private:
  const BatchArgs& a_;
  std::uint64_t next_ = 0;
  std::uint32_t left_ = 0;
  unsigned lane_;
};

/// A warp an eighth of an item: Gaussians are read once and projected for each camera of the mask.
__global__ void __launch_bounds__(kThreads) project_kernel(const BatchArgs a) {
  const unsigned lane = threadIdx.x % 32;
  const std::uint32_t parts = a.counters->items * kWarpsPerChunk;
  WarpSlots slots(a);
  for (std::uint32_t part = blockIdx.x * kWarps + threadIdx.x / 32; part < parts; part += gridDim.x * kWarps) {
    const BatchItem item = a.items[part / kWarpsPerChunk];
    const GaussianView& gs = a.instances[item.first_instance].args.gaussians;
    const std::size_t row = item.chunk * kProjectChunk + part % kWarpsPerChunk * 32 + lane;
    const bool exists = row < gs.size;
    Vec3<float> mean;
    float opacity = 0;
    std::size_t origin = 0;
    if (exists) {
      mean = {gs.means[0][row], gs.means[1][row], gs.means[2][row]};
      opacity = gs.opacities[row];
      if (!gs.origin_ids.empty()) origin = gs.origin_ids[row];
    }
    for (std::uint32_t mask = item.mask; mask != 0; mask &= mask - 1) {
      const std::uint32_t index = item.first_instance + static_cast<std::uint32_t>(__ffs(mask)) - 1;
      const BatchInstance& instance = a.instances[index];
      const ProjectArgs<float>& args = instance.args;
      bool drawn = false, hard = false;
      float key = 0;
      Splat splat;
      const float z = depth_key(args.camera.key_rotation, args.camera.key_scale, mean, args.offsets_f[origin]);
      if (exists && z > args.camera.near_plane) {
        const SplatAxes<float> axes =
            detail::load_axes(gs, args.camera, detail::camera_delta(args, mean, origin), row);
        const Projected<float> p = project<float, float>(args.camera, axes, z, opacity);
        if (p.visible) {
          key = key_of(args, z, mean, origin);
          hard = detail::needs_double(args.camera, p);
          if (!hard) {
            double mean_x, mean_y;
            detail::project_mean(args.camera64, vec_cast<double>(mean) + args.offsets[origin], mean_x, mean_y);
            drawn = make_splat(args.camera, a.depths != nullptr, p, axes, mean_x, mean_y, splat);
          }
        }
      }
      const std::uint32_t slot = slots.take(drawn || hard);
      if (hard) {
        const unsigned long long at = atomicAdd(&a.counters->hard, 1ull);
        if (slot != kNoSlot) a.entries[slot].camera = kNoSlot;  // until it has a record
        if (at < a.hard_capacity) a.hard[at] = {slot, index, static_cast<std::uint32_t>(row)};
      } else if (slot != kNoSlot) {
        write_record(a, slot, instance, key, row, splat, color_of(args, row, mean, origin));
      }
    }
  }
  slots.finish();
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
    const float z = depth_key(args.camera.key_rotation, args.camera.key_scale, mean, args.offsets_f[origin]);
    const float key = key_of(args, z, mean, origin);
    SplatAxes<double> axes;
    const Projected<double> p = detail::project64(args, h.row, key, mean, origin, axes);
    Splat splat;
    if (make_splat(args.camera64, a.depths != nullptr, p, axes, p.mean_x, p.mean_y, splat)) {
      write_record(a, h.slot, instance, key, h.row, splat, color_of(args, h.row, mean, origin));
    }
  }
}

}  // namespace

void launch_projection(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = static_cast<unsigned>(multiprocessors) * 8;
  cull_kernel<<<blocks, kThreads, 0, stream>>>(args);
  project_kernel<<<blocks, kThreads, 0, stream>>>(args);
  project_hard_kernel<<<blocks, 128, 0, stream>>>(args);
}

}  // namespace gsnav::cuda
