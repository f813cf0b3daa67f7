// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "block.hpp"

namespace gsnav::emulated {

namespace {

/// How often paused threads are woken while no other thread makes progress.
constexpr unsigned kMostInVain = 10000;

Block& first_block_of_this_thread() {
  static thread_local Block b;
  return b;
}

}  // namespace

GSNAV_UNCHECKED Block& block() {
  // `constinit`: reading it calls no function that initialises.
  static thread_local constinit Block* known = nullptr;
  if (known == nullptr) known = &first_block_of_this_thread();
  return *known;
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

void Block::release_barrier() {
  result_ = sum_;
  sum_ = 0;
  waiting_ = 0;
  for (unsigned i = 0; i < warp_count(); ++i) {
    warps_[i].ready |= warps_[i].at_block;
    warps_[i].at_block = 0;
  }
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
  for (Warp& w : all_warps_) {
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

GSNAV_UNCHECKED int block_barrier(int number) { return block().barrier(number); }
GSNAV_UNCHECKED void interleave() { block().interleave(); }
void pause() { block().pause(); }
GSNAV_UNCHECKED unsigned lane() { return block().current() % kWarp; }
GSNAV_UNCHECKED unsigned thread_rank() { return block().current(); }
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
