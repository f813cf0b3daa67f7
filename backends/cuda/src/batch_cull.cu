// SPDX-License-Identifier: Apache-2.0
#include "batch_lists.cuh"
#include "search.cuh"

// Culling of a batch: finds the parts of chunks that may be visible to each instance.

namespace gsnav::cuda {

namespace {

constexpr unsigned kThreads = policy::Cull::kThreads, kWarps = kThreads / 32;

/// Whether part `part` of the chunk may have visible Gaussians, by the bounds of the part, or by those
/// of the chunk if parts have none.
__device__ bool part_is_candidate(const ViewedSet<float>& args, std::size_t chunk, unsigned part) {
  if (!part_has_rows(args, chunk, part)) return false;
  const GaussianRows& gs = args.gaussians;
  return gs.chunk_bounds.empty() || may_be_visible(args.camera64, bounds_of_part(gs, chunk, part));
}

/// Mask of the parts of a chunk that the lane's instance may see, one bit per part; 0 unless
/// `candidate`, which says whether it may see the chunk. If the chunk lies wholly in view or its parts
/// have no bounds, the mask has all parts with rows that may be seen. If it is at the edge of the view,
/// the lanes of the warp test its parts together, with kPartsPerChunk lanes for each such instance.
__device__ unsigned parts_in_view(const BatchInstance* instances, std::size_t chunk, bool candidate) {
  const unsigned lane = threadIdx.x % 32;
  const GaussianRows& gs = instances[0].args.gaussians;
  unsigned parts = candidate ? parts_with_rows(instances[lane].args, chunk) : 0;
  unsigned edges =
      __ballot_sync(kAll, candidate && !gs.part_bounds.empty() &&
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

/// Id of chunk c among the drawn chunks, which are the same for all instances of a set.
__device__ std::uint32_t chunk_of(const BatchInstance& instance, std::uint32_t c) {
  return static_cast<std::uint32_t>(instance.args.selection.chunk_id(c));
}

/// One warp per unit. The lanes are the instances of the unit; in a set with few instances, they are
/// pairs of a part and an instance.
__global__ void __launch_bounds__(kThreads) cull_kernel(const BatchArgs a) {
  const unsigned lane = threadIdx.x % 32;
  const std::uint64_t stride = std::uint64_t{gridDim.x} * kWarps;
  for (std::uint64_t unit = blockIdx.x * kWarps + threadIdx.x / 32; unit < a.units; unit += stride) {
    const BatchSet set = a.sets[last_start(
        0u, a.set_count, [&](std::uint32_t i) { return a.sets[i].first_unit <= unit; })];
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
      const bool candidate =
          index < set.instances && chunk_is_candidate(instances[lane].args, at % set.chunks);
      chunk = chunk_of(instances[0], at % set.chunks);
      const unsigned parts = parts_in_view(instances, chunk, candidate);
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

}  // namespace

void launch_culling(const BatchArgs& args, int multiprocessors, cudaStream_t stream) {
  cull_kernel<<<static_cast<unsigned>(multiprocessors) * policy::Cull::kBlocks, kThreads, 0, stream>>>(
      args);
}

}  // namespace gsnav::cuda
