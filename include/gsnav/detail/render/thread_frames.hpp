// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sched.h>

#include <atomic>
#include <concepts>
#include <cstddef>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/render/draw_frame.hpp"

namespace gsnav {

/// Host backends that can split a batch by camera, so that each thread renders whole frames.
template <class B>
concept ThreadFramesBackend = Backend<B> && is_host_backend<B> && requires(const B& b) {
  { b.one_thread() } -> std::same_as<B>;
};

/// One frame of a batch: sets, camera, settings, images and meshes.
template <class S>
struct FrameJob {
  std::span<const GaussianSet> sets;
  const Camera* camera = nullptr;
  const RenderConfig* config = nullptr;
  FrameImages<S> images;
  MeshFrame meshes{};
};

/// Renders batches of frames with one worker per thread, so that no thread waits for another within a
/// frame. Scratch memory grows with the number of threads, not of cameras. All workers have the same
/// capacity, so a batch like an earlier one allocates nothing, whichever worker takes which camera.
template <class S, ThreadFramesBackend B>
class ThreadFrames {
 public:
  /// True if a batch has enough cameras to keep all threads busy.
  static bool worth_it(const B& backend, std::size_t cameras) noexcept {
    return cameras > 1 && cameras >= 2 * concurrency_of(backend);
  }

  /// Calls draw_frame() for each of `count` frames. job_of(c) returns the FrameJob of frame c.
  /// @return the error of the first failing frame, by index; out_of_memory if scratch memory cannot be
  ///   allocated.
  template <class JobOf>
  Status render(B& backend, std::size_t count, const JobOf& job_of, std::span<RenderStats> stats) {
    while (workers_.size() < concurrency_of(backend))
      workers_.push_back(std::make_unique<Worker>(backend));
    std::mutex mutex;
    std::size_t failed = count;
    Status result;
    backend.parallel_for(count, [&](std::size_t c) {
      Worker& worker = take();
      Status s = detail::guarded([&] {
        const FrameJob<S> job = job_of(c);
        return draw_frame<S, B>(worker.backend, worker.workspace, job.sets, job.meshes, *job.camera,
                                *job.config, job.images, &stats[c]);
      });
      worker.taken.store(false, std::memory_order_release);
      if (s.ok()) return;
      const std::lock_guard lock(mutex);
      if (c < failed) {
        failed = c;
        result = std::move(s);
      }
    });
    if (!result) return result;
    return detail::guarded([&] { return even_out(); });
  }

  std::size_t capacity_bytes() const noexcept {
    std::size_t sum = 0;
    for (const auto& worker : workers_) sum += worker->workspace.capacity_bytes();
    return sum;
  }

 private:
  struct Worker {
    explicit Worker(const B& b) : backend(b.one_thread()), workspace(backend) {}
    B backend;
    RenderWorkspace<S, B> workspace;
    std::atomic<bool> taken{false};
  };

  /// Returns a free worker. There is one per thread, so one is free.
  Worker& take() noexcept {
    while (true) {
      for (const auto& worker : workers_) {
        if (!worker->taken.exchange(true, std::memory_order_acquire)) return *worker;
      }
      ::sched_yield();
    }
  }

  Status even_out() {
    RenderWorkspace<S, B>& most = workers_.front()->workspace;
    for (const auto& worker : workers_) most.grow_to(worker->workspace);
    for (const auto& worker : workers_) worker->workspace.grow_to(most);
    return {};
  }

  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace gsnav
