// SPDX-License-Identifier: Apache-2.0
// Small rules of the batched renderer that only device code has, each by itself, against a loop.
#include <doctest/doctest.h>

#include <cstdint>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "src/batch_args.cuh"

namespace {

using namespace gsnav;

/// For list l, which lies at [begins[l], begins[l + 1]) of `starts`: the last that is not above
/// `wanted`.
__global__ void search_kernel(const std::uint32_t* begins, const std::uint32_t* starts,
                              const std::uint32_t* wanted, std::uint32_t lists, std::uint32_t* found) {
  const std::uint32_t l = blockIdx.x * blockDim.x + threadIdx.x;
  if (l >= lists) return;
  found[l] = cuda::last_start(begins[l], begins[l + 1],
                              [&](std::uint32_t i) { return starts[i] <= wanted[l]; });
}

__global__ void rank_kernel(cuda::BatchArgs args, std::uint32_t camera, std::uint32_t slots,
                            std::uint32_t* ranks) {
  const std::uint32_t slot = blockIdx.x * blockDim.x + threadIdx.x;
  if (slot < slots) ranks[slot] = cuda::rank_of(args, camera, slot);
}

}  // namespace

TEST_CASE("last_start finds what a loop finds, in lists of 1 to 40 with ties") {
  Rng rng(5);
  std::vector<std::uint32_t> begins{3}, starts(3, 77), wanted, truth;
  for (int round = 0; round < 400; ++round) {
    const std::uint32_t first = begins.back(), count = 1 + static_cast<std::uint32_t>(round % 40);
    std::uint32_t value = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      starts.push_back(value);
      value += static_cast<std::uint32_t>(rng.below(3));
    }
    begins.push_back(first + count);
    wanted.push_back(static_cast<std::uint32_t>(rng.below(value + 2)));
    std::uint32_t last = first;
    for (std::uint32_t i = first; i < first + count; ++i) last = starts[i] <= wanted.back() ? i : last;
    truth.push_back(last);
  }
  const auto lists = static_cast<std::uint32_t>(wanted.size());
  std::vector<std::uint32_t> found(lists);
  search_kernel<<<(lists + 63) / 64, 64>>>(begins.data(), starts.data(), wanted.data(), lists,
                                           found.data());
  REQUIRE(cudaDeviceSynchronize() == cudaSuccess);
  CHECK(found == truth);
}

TEST_CASE("the rank of a slot is its set's first rank in that camera plus the row as it was read") {
  // Three sets of 7, 5 and 9 rows. Camera 0 sees the first and the third, camera 1 all of them; the rows
  // of the second were sorted.
  constexpr std::uint32_t kRows[] = {7, 5, 9};
  const std::vector<std::uint32_t> as_read{4, 2, 0, 3, 1};
  std::vector<cuda::BatchInstance> instances;
  const auto add = [&](std::uint32_t set, std::uint32_t camera, std::uint32_t first_rank) {
    cuda::BatchInstance& i = instances.emplace_back();
    i.args.gaussians.shape.size = kRows[set];
    if (set == 1) i.args.gaussians.row_ids = {as_read.data(), as_read.size()};
    i.args.first_rank = first_rank;
    i.camera = camera;
  };
  // Instances of a set are neighbours.
  add(0, 0, 0);
  add(0, 1, 0);
  add(1, 1, 7);
  add(2, 0, 7);
  add(2, 1, 12);
  const std::vector<std::uint32_t> camera_instances{0, 3, 1, 2, 4}, camera_first{0, 2, 5};
  const std::vector<std::vector<std::uint32_t>> sets_of{{0, 2}, {0, 1, 2}};
  for (std::uint32_t camera = 0; camera < 2; ++camera) {
    CAPTURE(camera);
    std::vector<std::uint32_t> sources, truth;
    std::uint32_t first = 0;
    for (const std::uint32_t set : sets_of[camera]) {
      for (std::uint32_t row = 0; row < kRows[set]; ++row) {
        sources.push_back(first + row);
        truth.push_back(first + (set == 1 ? as_read[row] : row));
      }
      first += kRows[set];
    }
    cuda::BatchArgs args{};
    args.instances = instances.data();
    args.camera_first = camera_first.data();
    args.camera_instances = camera_instances.data();
    args.sources = sources.data();
    const auto slots = static_cast<std::uint32_t>(sources.size());
    std::vector<std::uint32_t> ranks(slots);
    rank_kernel<<<1, 32>>>(args, camera, slots, ranks.data());
    REQUIRE(cudaDeviceSynchronize() == cudaSuccess);
    CHECK(ranks == truth);
  }
}
