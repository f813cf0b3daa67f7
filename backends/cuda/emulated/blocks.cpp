// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "fiber.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav_emulated_device.hpp"
#include "settings.hpp"

// Each thread of a block is a fiber that yields where it waits: at a barrier of the block or at an
// operation of its warp. One thread of the host runs all fibers.

namespace gsnav::emulated {

namespace {

constexpr unsigned kMostThreads = 1024, kWarp = 32;
/// How often paused threads are woken while no other thread makes progress.
constexpr unsigned kMostInVain = 10000;

struct Thread {
  unsigned mask = 0;
  std::uint64_t value = 0;
  const char* what = nullptr;
  Gathered* gathered = nullptr;
  dim3 index;
  Fiber fiber;
  std::vector<std::pair<void*, std::vector<char>>> copies;  ///< Started, but not yet waited for.
};

/// Sets of a warp's threads, one bit per thread.
struct Warp {
  unsigned there = 0, ready = 0, at_warp = 0, at_block = 0, paused = 0, done = 0;
  std::array<Gathered, kWarp> gathered;
};

/// Index of the lowest set bit.
unsigned first_of(unsigned bits) { return static_cast<unsigned>(__builtin_ctz(bits)); }

/// The function that every thread of a grid runs, and its name.
struct Kernel {
  const char* name = "";
  void (*thread)(const void* arguments) = nullptr;
  const void* arguments = nullptr;
};

class Block {
 public:
  Block() : scheduler_(Fiber::of_this_thread()), threads_(kMostThreads), warps_(kMostThreads / kWarp) {
    for (Warp& w : warps_) {
      for (Gathered& g : w.gathered) g.readers = 0;
    }
  }

  void run(const Launch& launch, const dim3& at, const Kernel& kernel);
  Gathered& gather(unsigned mask, std::uint64_t value, const char* what);
  int barrier(int number);
  void interleave();
  void pause();
  unsigned current() const { return current_; }
  Thread& self() { return threads_[current_]; }
  void* shared() { return shared_.data(); }

 private:
  struct alignas(16) Line {
    unsigned char bytes[16];
  };

  static void main();
  /// Puts all threads at the start of the kernel.
  void start(const Launch& launch);
  /// Runs the threads of a warp that can run. Returns false if there are none.
  bool run_warp(unsigned index);
  void enter(unsigned index);
  void resume(unsigned index);
  void leave();
  void release_barrier();
  bool wake_paused();
  std::string who_waits() const;
  Warp& warp() { return warps_[current_ / kWarp]; }
  unsigned warp_count() const { return (size_ + kWarp - 1) / kWarp; }
  unsigned bit() const { return 1u << current_ % kWarp; }
  [[noreturn]] void fail(const std::string& why) const;

  Fiber scheduler_;
  std::vector<Thread> threads_;
  std::vector<Warp> warps_;
  std::vector<Line> shared_;
  unsigned size_ = 0, current_ = 0, alive_ = 0, waiting_ = 0;
  int sum_ = 0, result_ = 0;
  unsigned in_vain_ = 0;               ///< Number of times that paused threads were woken since the last
                                       ///< progress.
  const std::uint64_t seed_ = seed();  ///< GSNAV_EMULATED_SEED.
  Rng random_;
  Kernel kernel_;
  dim3 at_;
};

Block& block() {
  static thread_local Block b;
  return b;
}

void Block::fail(const std::string& why) const {
  std::fprintf(stderr, "emulated device: %s, block (%u, %u, %u), thread %u: %s\n", kernel_.name, at_.x,
               at_.y, at_.z, current_, why.c_str());
  std::abort();
}

/// Main function of a fiber. A fiber has one thread index and runs that thread of one block after the
/// other.
void Block::main() {
  Block& b = block();
  Fiber::began();
  for (;;) {
    b.kernel_.thread(b.kernel_.arguments);
    if (!b.self().copies.empty()) b.fail("ended before its copies into shared memory were waited for");
    b.warp().done |= b.bit();
    b.in_vain_ = 0;
    --b.alive_;
    if (b.alive_ != 0 && b.waiting_ == b.alive_) b.release_barrier();
    b.leave();
  }
}

void Block::enter(unsigned index) {
  current_ = index;
  threadIdx = threads_[index].index;
}

void Block::resume(unsigned index) {
  enter(index);
  Fiber::change(scheduler_, self().fiber);
}

void Block::leave() {
  Fiber& own = self().fiber;
  Warp& w = warp();
  if (seed_ != 0 || w.ready == 0) return Fiber::change(own, scheduler_);
  // Switch directly to the next thread of the warp, without the scheduler.
  const unsigned next = current_ / kWarp * kWarp + first_of(w.ready);
  w.ready &= w.ready - 1;
  if (next == current_) return;
  enter(next);
  Fiber::change(own, self().fiber);
}

Gathered& Block::gather(unsigned mask, std::uint64_t value, const char* what) {
  Warp& w = warp();
  in_vain_ = 0;
  if ((mask & bit()) == 0) fail(std::string(what) + " with a mask that it is not of");
  if ((mask & ~w.there) != 0) fail(std::string(what) + " waits for threads that the block has not");
  if ((mask & w.done) != 0) {
    fail(std::string(what) + " waits for thread " +
         std::to_string(current_ / kWarp * kWarp + first_of(mask & w.done)) + ", which has ended");
  }
  Thread* const lanes = &threads_[current_ / kWarp * kWarp];
  Thread& t = self();
  t.mask = mask;
  t.value = value;
  t.what = what;
  w.at_warp |= bit();
  bool complete = (mask & w.at_warp) == mask;
  for (unsigned left = complete ? mask : 0; left != 0; left &= left - 1) {
    const Thread& other = lanes[first_of(left)];
    complete = complete && other.mask == mask && other.what == what;
  }
  if (!complete) {
    leave();
    return *t.gathered;
  }
  Gathered* g = w.gathered.begin();
  while (g != w.gathered.end() && g->readers != 0) ++g;
  if (g == w.gathered.end()) fail("more operations of a warp at once than it has threads");
  for (unsigned left = mask; left != 0; left &= left - 1) {
    Thread& other = lanes[first_of(left)];
    g->value[first_of(left)] = other.value;
    other.gathered = g;
    ++g->readers;
  }
  w.at_warp &= ~mask;
  w.ready |= mask & ~bit();
  return *g;
}

void Block::release_barrier() {
  result_ = sum_;
  sum_ = 0;
  waiting_ = 0;
  for (Warp& w : warps_) w.ready |= std::exchange(w.at_block, 0u);
}

int Block::barrier(int number) {
  in_vain_ = 0;
  sum_ += number;
  if (++waiting_ == alive_) {
    release_barrier();
  } else {
    warp().at_block |= bit();
    leave();
  }
  return result_;
}

void Block::interleave() {
  in_vain_ = 0;
  if (seed_ == 0 || random_.below(8) != 0) return;
  warp().ready |= bit();
  leave();
}

void Block::pause() {
  warp().paused |= bit();
  leave();
}

bool Block::wake_paused() {
  bool any = false;
  for (Warp& w : warps_) {
    any = any || w.paused != 0;
    w.ready |= std::exchange(w.paused, 0u);
  }
  return any && ++in_vain_ < kMostInVain;
}

void Block::start(const Launch& launch) {
  size_ = alive_ = launch.block.x * launch.block.y * launch.block.z;
  waiting_ = 0;
  in_vain_ = 0;
  sum_ = 0;
  random_ = Rng(seed_ ^ (std::uint64_t{at_.y} << 32 | at_.x));
  shared_.assign((launch.shared + sizeof(Line) - 1) / sizeof(Line), Line{});
  if (!shared_.empty()) std::memset(shared_.data(), 0xd7, shared_.size() * sizeof(Line));
  for (unsigned i = 0; i < size_; ++i) {
    Thread& t = threads_[i];
    if (!t.fiber.start(&Block::main)) fail("no memory for its stack");
    t.index = dim3(i % launch.block.x, i / launch.block.x % launch.block.y,
                   i / launch.block.x / launch.block.y);
  }
  for (unsigned i = 0; i < warp_count(); ++i) {
    Warp& w = warps_[i];
    w.there = w.ready = size_ - i * kWarp >= kWarp ? ~0u : (1u << size_ % kWarp) - 1;
    w.at_warp = w.at_block = w.paused = w.done = 0;
  }
}

bool Block::run_warp(unsigned index) {
  Warp& w = warps_[index];
  bool any = false;
  // Run until all threads of the warp wait. With a seed, another warp may be chosen earlier.
  while (w.ready != 0 && (seed_ == 0 || random_.below(64) != 0)) {
    any = true;
    const unsigned turn = seed_ == 0 ? 0 : static_cast<unsigned>(random_.below(kWarp));
    const unsigned above = w.ready & ~0u << turn, lane = first_of(above != 0 ? above : w.ready);
    w.ready &= ~(1u << lane);
    resume(index * kWarp + lane);
  }
  return any || w.ready != 0;
}

void Block::run(const Launch& launch, const dim3& at, const Kernel& kernel) {
  kernel_ = kernel;
  blockIdx = at_ = at;
  blockDim = launch.block;
  gridDim = launch.grid;
  start(launch);
  while (alive_ != 0) {
    bool any = false;
    const unsigned count = warp_count();
    const unsigned first = seed_ == 0 ? 0 : static_cast<unsigned>(random_.below(count));
    for (unsigned i = 0; i < count; ++i) any = run_warp((first + i) % count) || any;
    if (!any && alive_ != 0 && !wake_paused()) fail("threads wait for one another:" + who_waits());
  }
}

std::string Block::who_waits() const {
  std::string text;
  for (unsigned i = 0; i < size_ && text.size() < 600; ++i) {
    const Warp& w = warps_[i / kWarp];
    const unsigned mine = 1u << i % kWarp;
    if (((w.paused | w.ready) & mine) != 0) text += " " + std::to_string(i) + " in a loop;";
    if ((w.at_block & mine) != 0) text += " " + std::to_string(i) + " at __syncthreads;";
    if ((w.at_warp & mine) != 0) {
      char mask[16];
      std::snprintf(mask, sizeof mask, "%08x", threads_[i].mask);
      text += " " + std::to_string(i) + " at " + threads_[i].what + "(" + mask + ");";
    }
  }
  return text;
}

}  // namespace

Gathered& gather(unsigned mask, std::uint64_t value, const char* what) {
  return block().gather(mask, value, what);
}
int block_barrier(int number) { return block().barrier(number); }
void interleave() { block().interleave(); }
void pause() { block().pause(); }
unsigned lane() { return block().current() % kWarp; }
unsigned thread_rank() { return block().current(); }
void* dynamic_shared() { return block().shared(); }

void copy_later(void* to, const void* from, std::size_t bytes) {
  const char* const first = static_cast<const char*>(from);
  block().self().copies.emplace_back(to, std::vector<char>(first, first + bytes));
}
void finish_copies() {
  auto& copies = block().self().copies;
  for (const auto& [to, bytes] : copies) std::memcpy(to, bytes.data(), bytes.size());
  copies.clear();
}

void run_grid(const Launch& launch, const char* name, void (*thread)(const void*),
              const void* arguments) {
  const dim3& g = launch.grid;
  const std::uint64_t blocks = std::uint64_t{g.x} * g.y * g.z;
  // A step that is coprime to the number of blocks visits each block once.
  std::uint64_t step = 1, at = 0;
  if (seed() != 0 && blocks > 2) {
    Rng rng(seed());
    do {
      step = rng.below(blocks);
    } while (std::gcd(step, blocks) != 1);
    at = rng.below(blocks);
  }
  for (std::uint64_t i = 0; i < blocks; ++i, at = (at + step) % blocks) {
    const dim3 index(static_cast<unsigned>(at % g.x), static_cast<unsigned>(at / g.x % g.y),
                     static_cast<unsigned>(at / g.x / g.y));
    block().run(launch, index, {name, thread, arguments});
  }
}

}  // namespace gsnav::emulated
