// SPDX-License-Identifier: Apache-2.0
// Device code on the host (GSNAV_CUDA=EMULATED): what warps, blocks, streams and graphs promise, against
// loops over what their threads were given; and that code which a device would hang on, or read nonsense
// in, is named.
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cub/block/block_radix_sort.cuh>
#include <cub/block/block_reduce.cuh>
#include <cub/block/block_scan.cuh>
#include <string>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "support/files.hpp"

namespace {

using gsnav::Rng;
using gsnav_test::contains;

/// Device memory that a test fills and reads.
template <class T>
class OnDevice {
 public:
  explicit OnDevice(const std::vector<T>& values) : size_(values.size()) {
    REQUIRE(cudaMalloc(&p_, size_ * sizeof(T)) == cudaSuccess);
    REQUIRE(cudaMemcpy(p_, values.data(), size_ * sizeof(T), cudaMemcpyHostToDevice) == cudaSuccess);
  }
  explicit OnDevice(std::size_t size) : OnDevice(std::vector<T>(size)) {}
  ~OnDevice() { cudaFree(p_); }
  OnDevice(const OnDevice&) = delete;
  OnDevice& operator=(const OnDevice&) = delete;
  T* data() { return p_; }
  std::vector<T> fetched() const {
    std::vector<T> out(size_);
    REQUIRE(cudaMemcpy(out.data(), p_, size_ * sizeof(T), cudaMemcpyDeviceToHost) == cudaSuccess);
    return out;
  }

 private:
  T* p_ = nullptr;
  std::size_t size_;
};

std::vector<unsigned> random_numbers(std::size_t count, std::uint64_t seed, unsigned below = ~0u) {
  Rng rng(seed);
  std::vector<unsigned> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(static_cast<unsigned>(rng.uniform(0, below)));
  return out;
}

constexpr unsigned kOperations = 9;

/// Eight threads of each warp leave before; the rest in two groups, each with its own masks and numbers
/// of rounds.
__global__ void warp_kernel(const unsigned* in, const int* by, unsigned* out) {
  const unsigned at = blockIdx.x * blockDim.x + threadIdx.x, lane = threadIdx.x % 32;
  if (lane >= 24) return;
  const unsigned mask = lane % 3 == 0 ? 0x00249249u : 0x00db6db6u;
  for (int round = 0; round < (lane % 3 == 0 ? 3 : 2); ++round) {
    unsigned* o = out + (at * 3 + static_cast<unsigned>(round)) * kOperations;
    const unsigned v = in[at] + static_cast<unsigned>(round);
    o[0] = __shfl_sync(mask, v, by[at]);
    o[1] = __shfl_up_sync(mask, v, 3u);
    o[2] = __shfl_down_sync(mask, v, 3u);
    o[3] = __shfl_xor_sync(mask, v, 3);
    o[4] = __ballot_sync(mask, v % 2 == 0);
    o[5] = static_cast<unsigned>(__any_sync(mask, v % 64 == 0));
    o[6] = static_cast<unsigned>(__all_sync(mask, v % 4 != 0));
    o[7] = __match_any_sync(mask, v % 5);
    o[8] = __shfl_sync(mask, v, by[at], 8);
  }
}

constexpr unsigned kMostThreads = 96;

/// Half of the threads have left before the last barrier.
__global__ void barrier_kernel(const unsigned* in, unsigned* out) {
  extern __shared__ unsigned sums[];
  __shared__ unsigned several;
  const unsigned t = threadIdx.x + blockDim.x * threadIdx.y, threads = blockDim.x * blockDim.y;
  if (t == 0) several = 0;
  sums[t] = in[t];
  const int odd = __syncthreads_count(in[t] % 2 != 0);
  for (unsigned step = 1; step < threads; step *= 2) {
    const unsigned from = t >= step ? sums[t - step] : 0;
    __syncthreads();
    sums[t] += from;
    __syncthreads();
  }
  atomicAdd(&several, in[t]);
  if (t % 2 == 1) return;
  __syncthreads();
  out[2 * t] = sums[t];
  out[2 * t + 1] = several + static_cast<unsigned>(odd);
}

template <int Threads>
__global__ void cub_kernel(const unsigned* in, unsigned* out) {
  __shared__ typename cub::BlockScan<unsigned, Threads>::TempStorage scan;
  __shared__ typename cub::BlockReduce<unsigned, Threads>::TempStorage reduce;
  using Sort = cub::BlockRadixSort<unsigned, Threads, 3, unsigned>;
  __shared__ typename Sort::TempStorage sort;
  const unsigned t = threadIdx.x;
  unsigned before, total;
  cub::BlockScan<unsigned, Threads>(scan).ExclusiveSum(in[t], before, total);
  const unsigned sum = cub::BlockReduce<unsigned, Threads>(reduce).Sum(in[t]);
  unsigned keys[3], values[3];
  for (unsigned i = 0; i < 3; ++i) {
    values[i] = 3 * t + i;
    keys[i] = in[values[i]];
  }
  Sort(sort).Sort(keys, values, 4, 12);
  out[0 * Threads + t] = before;
  out[1 * Threads + t] = t == 0 ? sum : total;
  for (unsigned i = 0; i < 3; ++i) out[2 * Threads + 3 * t + i] = values[i];
}

__global__ void add_kernel(unsigned* to, unsigned factor, unsigned term) {
  to[threadIdx.x] = to[threadIdx.x] * factor + term;
}

__global__ void every_kernel(unsigned* seen) {
  atomicAdd(&seen[(blockIdx.z * gridDim.y + blockIdx.y) * gridDim.x + blockIdx.x], 1 + threadIdx.x);
}

/// Each but one waits, in a loop, for the number that the next one writes.
__global__ void relay_kernel(unsigned* out) {
  const unsigned t = threadIdx.x, next = (t + 1) % blockDim.x;
  volatile unsigned* const mine = out + t;
  if (t == 5) {
    *mine = 100;
    return;
  }
  while (static_cast<volatile unsigned*>(out)[next] == 0) __nanosleep(20);
  *mine = out[next] + 1;
}

// What must not be done.
__global__ void left_behind_kernel(unsigned* out) {
  if (threadIdx.x == 7) return;
  out[threadIdx.x] = __ballot_sync(~0u, 1);
}
__global__ void crossed_kernel(unsigned* out) {
  if (threadIdx.x % 2 == 0) {
    out[threadIdx.x] = __ballot_sync(~0u, 1);
  } else {
    __syncthreads();
  }
}
__global__ void not_of_mask_kernel(unsigned* out) { out[threadIdx.x] = __ballot_sync(0xffffu, 1); }
__global__ void nobody_writes_kernel(unsigned* out) {
  if (threadIdx.x == 0) return;
  while (*static_cast<volatile unsigned*>(out) == 0) __nanosleep(20);
}
__global__ void absent_kernel(unsigned* out) { out[threadIdx.x] = __ballot_sync(~0u, 1); }

/// What a child process that runs `f` says before it ends by itself; empty where it does not.
template <class F>
std::string last_words(F f) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  std::fflush(nullptr);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::signal(SIGABRT, SIG_DFL);
    dup2(ends[1], 2);
    f();
    _exit(0);
  }
  close(ends[1]);
  std::string text;
  char part[512];
  for (ssize_t n = 0; (n = read(ends[0], part, sizeof part)) > 0;)
    text.append(part, static_cast<std::size_t>(n));
  close(ends[0]);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT ? text : std::string();
}

}  // namespace

TEST_CASE(
    "emulated: operations of a warp are what their definitions say, in groups that go their own ways") {
  constexpr unsigned kThreads = 64, kBlocks = 5, kAll = kThreads * kBlocks;
  std::vector<unsigned> in = random_numbers(kAll, 1, 1000);
  Rng rng(2);
  std::vector<int> by;
  for (unsigned i = 0; i < kAll; ++i) by.push_back(static_cast<int>(rng.uniform(0, 24)));
  OnDevice<unsigned> numbers(in), out(std::size_t{kAll} * 3 * kOperations);
  OnDevice<int> from(by);
  warp_kernel<<<kBlocks, kThreads>>>(numbers.data(), from.data(), out.data());
  const std::vector<unsigned> got = out.fetched();
  std::size_t wrong = 0, compared = 0;
  for (unsigned at = 0; at < kAll; ++at) {
    const unsigned lane = at % 32, warp = at - lane;
    if (lane >= 24) continue;
    const auto with_me = [&](unsigned other) {
      return other < 24 && (other % 3 == 0) == (lane % 3 == 0);
    };
    for (unsigned round = 0; round < (lane % 3 == 0 ? 3u : 2u); ++round) {
      const unsigned* o = &got[(at * 3 + round) * kOperations];
      const auto value = [&](unsigned other) { return in[warp + other] + round; };
      // Only what a thread of the mask gave is defined.
      const auto is = [&](unsigned result, unsigned other) {
        if (!with_me(other)) return;
        ++compared;
        wrong += result == value(other) ? 0 : 1;
      };
      const auto wanted = static_cast<unsigned>(by[at]);
      is(o[0], wanted);
      is(o[1], lane >= 3 ? lane - 3 : lane);
      is(o[2], lane + 3);
      is(o[3], lane ^ 3u);
      is(o[8], lane / 8 * 8 + wanted % 8);
      unsigned even = 0, same = 0;
      bool any = false, all = true;
      for (unsigned other = 0; other < 24; ++other) {
        if (!with_me(other)) continue;
        even |= (value(other) % 2 == 0 ? 1u : 0u) << other;
        same |= (value(other) % 5 == value(lane) % 5 ? 1u : 0u) << other;
        any = any || value(other) % 64 == 0;
        all = all && value(other) % 4 != 0;
      }
      wrong += (o[4] == even && o[5] == unsigned{any} && o[6] == unsigned{all} && o[7] == same) ? 0 : 1;
    }
  }
  CHECK(wrong == 0);
  CHECK(compared > 1000);
}

TEST_CASE("emulated: barriers wait for all that are left, whatever their number") {
  for (const dim3 size : {dim3(1), dim3(7, 3), dim3(32), dim3(33), dim3(48, 2)}) {
    const unsigned threads = size.x * size.y;
    CAPTURE(threads);
    const std::vector<unsigned> in = random_numbers(kMostThreads, 3, 1000);
    OnDevice<unsigned> numbers(in), out(2 * kMostThreads);
    barrier_kernel<<<1, size, threads * sizeof(unsigned)>>>(numbers.data(), out.data());
    const std::vector<unsigned> got = out.fetched();
    unsigned sum = 0, odd = 0;
    for (unsigned t = 0; t < threads; ++t) {
      sum += in[t];
      odd += in[t] % 2;
    }
    unsigned before = 0;
    for (unsigned t = 0; t < threads; ++t) {
      before += in[t];
      if (t % 2 == 1) continue;
      CHECK(got[2 * t] == before);
      CHECK(got[2 * t + 1] == sum + odd);
    }
  }
}

TEST_CASE("emulated: who waits in a loop lets others go on") {
  constexpr unsigned kThreads = 70;
  OnDevice<unsigned> out(kThreads);
  relay_kernel<<<1, kThreads>>>(out.data());
  const std::vector<unsigned> got = out.fetched();
  for (unsigned t = 0; t < kThreads; ++t) CHECK(got[t] == 100 + (5 + kThreads - t) % kThreads);
}

TEST_CASE("emulated: sums and sorts of a block") {
  constexpr int kThreads = 64;
  const std::vector<unsigned> in = random_numbers(3 * kThreads, 4, 1u << 20);
  OnDevice<unsigned> numbers(in), out(5 * kThreads);
  cub_kernel<kThreads><<<1, kThreads>>>(numbers.data(), out.data());
  const std::vector<unsigned> got = out.fetched();
  unsigned before = 0;
  for (std::size_t t = 0; t < kThreads; ++t) {
    CHECK(got[t] == before);
    before += in[t];
  }
  for (std::size_t t = 0; t < kThreads; ++t) CHECK(got[kThreads + t] == before);
  const auto digit = [&](std::size_t i) { return in[got[2 * kThreads + i]] >> 4 & 0xffu; };
  std::vector<bool> there(in.size());
  for (std::size_t i = 0; i < in.size(); ++i) {
    there[got[2 * kThreads + i]] = true;
    if (i == 0) continue;
    CHECK(digit(i - 1) <= digit(i));
    if (digit(i - 1) == digit(i)) CHECK(got[2 * kThreads + i - 1] < got[2 * kThreads + i]);
  }
  CHECK(there == std::vector<bool>(in.size(), true));
}

TEST_CASE("emulated: every block of a grid runs once; what a device refuses is refused") {
  OnDevice<unsigned> seen(5 * 3 * 2);
  every_kernel<<<dim3(5, 3, 2), 4>>>(seen.data());
  CHECK(seen.fetched() == std::vector<unsigned>(5 * 3 * 2, 1 + 2 + 3 + 4));
  CHECK(cudaGetLastError() == cudaSuccess);
  every_kernel<<<0, 4>>>(seen.data());
  CHECK(cudaGetLastError() == cudaErrorInvalidConfiguration);
  every_kernel<<<1, 1025>>>(seen.data());
  CHECK(cudaGetLastError() == cudaErrorInvalidConfiguration);
  every_kernel<<<1, 4, 1 << 20>>>(seen.data());
  CHECK(cudaGetLastError() == cudaErrorInvalidConfiguration);
  CHECK(cudaGetLastError() == cudaSuccess);
  void* much = nullptr;
  CHECK(cudaMalloc(&much, std::size_t{1} << 50) == cudaErrorMemoryAllocation);
  unsigned here = 0;
  CHECK(cudaMemcpy(seen.data(), &here, 31 * sizeof(unsigned), cudaMemcpyHostToDevice) ==
        cudaErrorInvalidValue);
  CHECK(cudaMemcpyAsync(&here, &here, sizeof here, cudaMemcpyDeviceToHost, nullptr) ==
        cudaErrorInvalidValue);
  cudaGetLastError();
}

TEST_CASE(
    "emulated: streams go in order, wait for one another's events, and graphs do again what they "
    "recorded") {
  cudaStream_t a, b;
  cudaEvent_t event;
  REQUIRE(cudaStreamCreate(&a) == cudaSuccess);
  REQUIRE(cudaStreamCreate(&b) == cudaSuccess);
  REQUIRE(cudaEventCreate(&event) == cudaSuccess);
  OnDevice<unsigned> number(1);
  add_kernel<<<1, 1, 0, a>>>(number.data(), 2u, 5u);
  add_kernel<<<1, 1, 0, a>>>(number.data(), 3u, 1u);
  CHECK(cudaEventRecord(event, a) == cudaSuccess);
  add_kernel<<<1, 1, 0, a>>>(number.data(), 100u, 7u);  // behind the event
  CHECK(cudaStreamWaitEvent(b, event) == cudaSuccess);
  add_kernel<<<1, 1, 0, b>>>(number.data(), 2u, 0u);
  unsigned* pinned = nullptr;
  REQUIRE(cudaMallocHost(&pinned, sizeof(unsigned)) == cudaSuccess);
  *pinned = 0;
  CHECK(cudaMemcpyAsync(pinned, number.data(), sizeof(unsigned), cudaMemcpyDeviceToHost, b) ==
        cudaSuccess);
  CHECK(*pinned == 0);  // nobody has waited
  CHECK(cudaStreamSynchronize(b) == cudaSuccess);
  CHECK(*pinned == 2 * (3 * 5 + 1));
  CHECK(cudaDeviceSynchronize() == cudaSuccess);
  CHECK(number.fetched()[0] == 100 * 32 + 7);

  REQUIRE(cudaStreamBeginCapture(a, cudaStreamCaptureModeRelaxed) == cudaSuccess);
  add_kernel<<<1, 1, 0, a>>>(number.data(), 1u, 1u);
  add_kernel<<<1, 1, 0, a>>>(number.data(), 2u, 0u);
  CHECK(cudaStreamSynchronize(a) == cudaErrorStreamCaptureUnsupported);
  cudaGraph_t graph;
  cudaGraphExec_t exec;
  REQUIRE(cudaStreamEndCapture(a, &graph) == cudaSuccess);
  REQUIRE(cudaGraphInstantiate(&exec, graph) == cudaSuccess);
  CHECK(cudaStreamSynchronize(a) == cudaSuccess);
  CHECK(number.fetched()[0] == 3207);  // recorded, not done
  for (int i = 0; i < 2; ++i) CHECK(cudaGraphLaunch(exec, a) == cudaSuccess);
  CHECK(cudaStreamSynchronize(a) == cudaSuccess);
  CHECK(number.fetched()[0] == ((3207 + 1) * 2 + 1) * 2);
  cudaGraphExecDestroy(exec);
  cudaGraphDestroy(graph);
  cudaFreeHost(pinned);
  cudaEventDestroy(event);
  cudaStreamDestroy(a);
  cudaStreamDestroy(b);
  cudaGetLastError();
}

TEST_CASE(
    "emulated: threads that wait for ever, or for nobody, are named with kernel, block and thread") {
  OnDevice<unsigned> out(32);
  const auto words = [&](auto launch) {
    return last_words([&] {
      launch();
      cudaDeviceSynchronize();
    });
  };
  std::string text = words([&] { left_behind_kernel<<<1, 32>>>(out.data()); });
  CAPTURE(text);
  CHECK(contains(text, "left_behind_kernel, block (0, 0, 0), thread"));
  CHECK(contains(text, "thread 7, which has ended"));
  text = words([&] { crossed_kernel<<<1, 32>>>(out.data()); });
  CHECK(contains(text, "wait for one another"));
  CHECK(contains(text, "0 at __ballot_sync(ffffffff); 1 at __syncthreads;"));
  text = words([&] { not_of_mask_kernel<<<1, 32>>>(out.data()); });
  CHECK(contains(text, "with a mask that it is not of"));
  text = words([&] { nobody_writes_kernel<<<1, 4>>>(out.data()); });
  CHECK(contains(text, "1 in a loop; 2 in a loop; 3 in a loop;"));
  text = words([&] { absent_kernel<<<1, 24>>>(out.data()); });
  CHECK(contains(text, "threads that the block has not"));
}
