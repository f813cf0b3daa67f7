// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <concepts>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/ops/render.hpp"

namespace gsnav {

/// Backends whose batches may be cut by camera: each thread renders whole frames.
template <class B>
concept LaneBackend = Backend<B> && is_host_backend<B> && requires(const B& b) {
  { b.one_thread() } -> std::same_as<B>;
};

/// Renders batches with one lane a thread: no thread waits for another within a frame, and the cameras of a
/// lane share what the projection reads. Scratch grows with threads, not with cameras, and is the same for all
/// lanes, so that a batch like one before it allocates nothing, whichever lane takes which camera.
template <class S, LaneBackend B>
class FrameLanes {
 public:
  /// Whether a batch keeps all threads busy for long enough that lanes pay.
  static bool worth_it(const B& backend, std::size_t cameras) noexcept {
    return cameras > 1 && cameras >= 2 * concurrency_of(backend);
  }

  /// render_cameras() for any number of cameras; images_of(c) gives the FrameImages of camera c. The first
  /// camera's error, by number, is returned; out_of_memory too.
  template <class ImagesOf>
  Status render(B& backend, std::span<const GaussianSet> sets, std::span<const Camera> cameras,
                const RenderConfig& config, const ImagesOf& images_of, std::span<RenderStats> stats) {
    while (lanes_.size() < concurrency_of(backend)) lanes_.push_back(std::make_unique<Lane>(backend));
    // Fewer at a time where threads would be left over.
    const std::size_t share = std::max<std::size_t>(1, cameras.size() / (2 * concurrency_of(backend)));
    const std::size_t together = std::min(kTogether, share);
    const std::size_t groups = (cameras.size() + together - 1) / together;
    std::mutex mutex;
    std::size_t failed = groups;
    Status result;
    backend.parallel_for(groups, [&](std::size_t g) {
      const std::size_t first = g * together, n = std::min(together, cameras.size() - first);
      std::array<FrameImages<S>, kTogether> images;
      for (std::size_t c = 0; c < n; ++c) images[c] = images_of(first + c);
      Lane& lane = take();
      Status s = guarded([&] {
        return render_cameras<S, B>(lane.backend, std::span(lane.workspaces).first(n), sets,
                                    cameras.subspan(first, n), config,
                                    std::span<const FrameImages<S>>(images).first(n), stats.subspan(first, n));
      });
      lane.taken.store(false, std::memory_order_release);
      if (s.ok()) return;
      const std::lock_guard lock(mutex);
      if (g < failed) {
        failed = g;
        result = std::move(s);
      }
    });
    if (!result) return result;
    return guarded([&] { return even_out(); });
  }

  std::size_t bytes() const noexcept {
    std::size_t sum = 0;
    for (const auto& lane : lanes_) {
      for (const auto& w : lane->workspaces) sum += w.bytes();
    }
    return sum;
  }

 private:
  /// More share more of what is read, but have to lie in the caches together.
#if defined(TOGETHER)
  static constexpr std::size_t kTogether = TOGETHER;
#else
  static constexpr std::size_t kTogether = 2;
#endif

  struct Lane {
    explicit Lane(const B& b) : backend(b.one_thread()) {
      for (std::size_t c = 0; c < kTogether; ++c) workspaces.emplace_back(backend);
    }
    B backend;
    std::vector<RenderWorkspace<S, B>> workspaces;
    std::atomic<bool> taken{false};
  };

  /// A lane that nobody is in: there are as many as threads.
  Lane& take() noexcept {
    while (true) {
      for (const auto& lane : lanes_) {
        if (!lane->taken.exchange(true, std::memory_order_acquire)) return *lane;
      }
      std::this_thread::yield();
    }
  }

  Status even_out() {
    RenderWorkspace<S, B>& most = lanes_.front()->workspaces.front();
    for (int turn = 0; turn < 2; ++turn) {
      for (const auto& lane : lanes_) {
        for (auto& w : lane->workspaces) turn == 0 ? most.grow_to(w) : w.grow_to(most);
      }
    }
    return {};
  }

  /// No exception may leave a parallel region.
  template <class Run>
  static Status guarded(const Run& run) noexcept {
#if defined(__cpp_exceptions)
    try {
      return run();
    } catch (const Error& e) {
      return {e.code(), e.what()};
    } catch (const std::exception& e) {
      return {Errc::out_of_memory, e.what()};
    }
#else
    return run();
#endif
  }

  std::vector<std::unique_ptr<Lane>> lanes_;
};

}  // namespace gsnav
