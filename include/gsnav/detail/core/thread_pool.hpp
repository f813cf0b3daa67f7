// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <thread>
#include <utility>
#include <vector>

#include "gsnav/config.hpp"

#if __has_include(<unistd.h>)
#include <unistd.h>
#endif

namespace gsnav {

/// Thread pool that distributes the pieces of one job at a time.
///
/// The caller works too, and never waits for a thread that has not started a piece. On a busy machine it
/// does the whole job itself. Idle threads spin for a bounded time and then sleep.
///
/// Any thread may call run(), also from within a piece and several at once. A call that finds the pool
/// busy runs its job on the calling thread alone. The first job starts the threads; the destructor joins
/// them. In the child of a fork no threads are left, and the caller does all the work. Repeated jobs
/// allocate nothing.
class ThreadPool {
 public:
  /// @param threads number of threads including the caller
  explicit ThreadPool(int threads) noexcept : threads_(threads) {}
  ~ThreadPool() {
    if (workers_.empty()) return;
    if (process_ != this_process()) {
      // In the child of a fork the threads do not exist and cannot be joined. Leak their handles.
      new std::vector<std::thread>(std::move(workers_));
      return;
    }
    stop_.store(true, std::memory_order_relaxed);
    announce(epoch_.load(std::memory_order_relaxed) + 1);
    for (std::thread& t : workers_) t.join();
  }
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  /// Calls f(p) once for each p in [0, pieces), in any order. Memory that the pieces wrote is visible on
  /// return. An exception that leaves f terminates the process.
  template <class F>
  void run(std::uint32_t pieces, const F& f) noexcept {
    if (pieces < 2 || threads_ < 2 || taken_.exchange(true, std::memory_order_acquire)) {
      for (std::uint32_t p = 0; p < pieces; ++p) f(p);
      return;
    }
    if (!started_) start();
    // Invalidate the ticket before writing the job. A thread still late from the last job that reads the
    // new fields then finds its claim void.
    const std::uint64_t epoch = (ticket_.load(std::memory_order_relaxed) & ~(kEpoch - 1)) + kEpoch;
    ticket_.store(epoch - 1, std::memory_order_relaxed);
    call_.store([](const void* g, std::uint32_t p) noexcept { (*static_cast<const F*>(g))(p); },
                std::memory_order_release);
    context_.store(&f, std::memory_order_release);
    pieces_.store(pieces, std::memory_order_release);
    done_.store(0, std::memory_order_relaxed);
    ticket_.store(epoch, std::memory_order_release);
    announce(static_cast<std::uint32_t>(epoch / kEpoch));
    const std::uint32_t others = pieces - take_pieces();
    await(done_, [others](std::uint32_t done) { return done == others; });
    taken_.store(false, std::memory_order_release);
  }

 private:
  static constexpr std::uint64_t kEpoch = std::uint64_t{1} << 32;
  /// Spinning time. Longer than the pause between two jobs of a frame and than most pieces, but far
  /// shorter than a time slice of the scheduler.
  static constexpr std::chrono::microseconds kSpin{50};
  static constexpr std::size_t kLine = 128;  ///< two cache lines, because processors prefetch pairs

  static void pause() noexcept {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();  // as _mm_pause, without its large header
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
  }
  static long this_process() noexcept {
#if __has_include(<unistd.h>)
    return static_cast<long>(getpid());
#else
    return 0;
#endif
  }

  void start() noexcept {
    started_ = true;
    process_ = this_process();
    const unsigned cores = std::thread::hardware_concurrency();
    crowded_ = cores != 0 && static_cast<unsigned>(threads_) > cores;
    const std::uint32_t seen = epoch_.load(std::memory_order_relaxed);
#if defined(__cpp_exceptions)
    try {
#endif
      workers_.reserve(static_cast<std::size_t>(threads_ - 1));
      for (int i = 1; i < threads_; ++i) workers_.emplace_back([this, seen] { work(seen); });
#if defined(__cpp_exceptions)
    } catch (const std::exception&) {  // continue with the threads that the system gave
    }
#endif
  }

  /// Waits until a value satisfies `enough` and returns it: spins, then sleeps. With more threads than
  /// cores it sleeps at once, because a spinning thread would keep others from working.
  template <class Enough>
  std::uint32_t await(const std::atomic<std::uint32_t>& value, const Enough& enough) const noexcept {
    std::uint32_t v = value.load(std::memory_order_acquire);
    if (enough(v)) return v;
    if (!crowded_) {
      const auto end = std::chrono::steady_clock::now() + kSpin;
      do {
        for (int i = 0; i < 16; ++i) {
          pause();
          v = value.load(std::memory_order_acquire);
          if (enough(v)) return v;
        }
      } while (std::chrono::steady_clock::now() < end);
    }
    while (!enough(v)) {
      value.wait(v, std::memory_order_acquire);
      v = value.load(std::memory_order_acquire);
    }
    return v;
  }

  void announce(std::uint32_t epoch) noexcept {
    epoch_.store(epoch, std::memory_order_seq_cst);
    epoch_.notify_all();  // makes a system call only if a thread sleeps
  }

  /// Runs pieces of the current job until none is left. Returns the number of pieces run.
  std::uint32_t take_pieces() noexcept {
    std::uint64_t t = ticket_.load(std::memory_order_acquire);
    const std::uint64_t epoch = t / kEpoch;
    const auto call = call_.load(std::memory_order_acquire);
    const void* const context = context_.load(std::memory_order_acquire);
    const std::uint32_t pieces = pieces_.load(std::memory_order_acquire);
    std::uint32_t taken = 0;
    while (t / kEpoch == epoch && static_cast<std::uint32_t>(t) < pieces) {
      if (!ticket_.compare_exchange_weak(t, t + 1, std::memory_order_acq_rel,
                                         std::memory_order_acquire)) {
        continue;
      }
      call(context, static_cast<std::uint32_t>(t));
      ++taken;
      t = ticket_.load(std::memory_order_acquire);
    }
    return taken;
  }

  void work(std::uint32_t seen) noexcept {
    while (true) {
      seen = await(epoch_, [seen](std::uint32_t epoch) { return epoch != seen; });
      if (stop_.load(std::memory_order_relaxed)) return;
      const std::uint32_t taken = take_pieces();
      if (taken == 0) continue;
      done_.fetch_add(taken, std::memory_order_seq_cst);
      done_.notify_one();
    }
  }

  /// epoch of the job (upper half) and next piece (lower half)
  alignas(kLine) std::atomic<std::uint64_t> ticket_{0};
  alignas(kLine) std::atomic<std::uint32_t> done_{0};   ///< pieces done by threads other than the caller
  alignas(kLine) std::atomic<std::uint32_t> epoch_{0};  ///< epoch of the last announced job
  alignas(kLine) std::atomic<void (*)(const void*, std::uint32_t) noexcept> call_{nullptr};
  std::atomic<const void*> context_{nullptr};
  std::atomic<std::uint32_t> pieces_{0};
  std::atomic<bool> stop_{false};
  alignas(kLine) std::atomic<bool> taken_{false};
  // Owned by the thread that has taken the pool. Workers read only values that were written before they
  // started.
  const int threads_;
  bool started_ = false, crowded_ = false;
  long process_ = 0;
  std::vector<std::thread> workers_;
};

}  // namespace gsnav
