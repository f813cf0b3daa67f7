// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
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

constexpr unsigned kMostThreads = 1024, kWarp = 32;

/// Values of the threads of a warp, after all threads of the mask have arrived.
struct Gathered {
  std::uint64_t value[kWarp];
  unsigned not_zero;  ///< The threads whose value is not 0, one bit per thread.
  int readers = 0;
};

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
  Gathered gathered[kWarp];
};

/// Index of the lowest set bit.
GSNAV_UNCHECKED inline unsigned first_of(unsigned bits) {
  return static_cast<unsigned>(__builtin_ctz(bits));
}

/// The function that every thread of a grid runs, and its name.
struct Kernel {
  const char* name = "";
  void (*thread)(const void* arguments) = nullptr;
  const void* arguments = nullptr;
};

class Block {
 public:
  Block()
      : scheduler_(Fiber::of_this_thread()),
        all_threads_(kMostThreads),
        all_warps_(kMostThreads / kWarp),
        threads_(all_threads_.data()),
        warps_(all_warps_.data()) {}

  void run(const Launch& launch, const dim3& at, const Kernel& kernel);
  GSNAV_UNCHECKED Gathered& gather(unsigned mask, std::uint64_t value, const char* what);
  GSNAV_UNCHECKED int barrier(int number);
  GSNAV_UNCHECKED void interleave();
  void pause();
  GSNAV_UNCHECKED unsigned current() const { return current_; }
  GSNAV_UNCHECKED Thread& self() { return threads_[current_]; }
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
  GSNAV_UNCHECKED void enter(unsigned index);
  GSNAV_UNCHECKED void resume(unsigned index);
  GSNAV_UNCHECKED void leave();
  GSNAV_UNCHECKED void release_barrier();
  bool wake_paused();
  std::string who_waits() const;
  /// Ends the program if the thread must not, or cannot, wait for those of the mask.
  GSNAV_UNCHECKED void check_mask(unsigned mask, const char* what) const;
  void refuse_mask(unsigned mask, const char* what) const;
  GSNAV_UNCHECKED Warp& warp() const { return warps_[current_ / kWarp]; }
  GSNAV_UNCHECKED unsigned warp_count() const { return (size_ + kWarp - 1) / kWarp; }
  GSNAV_UNCHECKED unsigned bit() const { return 1u << current_ % kWarp; }
  [[noreturn]] void fail(const std::string& why) const;

  Fiber scheduler_;
  std::vector<Thread> all_threads_;
  std::vector<Warp> all_warps_;
  Thread* const threads_;
  Warp* const warps_;
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

/// The block of threads that this thread of the host runs.
GSNAV_UNCHECKED Block& block();

}  // namespace gsnav::emulated
