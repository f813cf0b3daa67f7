// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/render/row_weights.hpp"
#include "gsnav/detail/render/thread_frames.hpp"
#include "gsnav/detail/scene/seen_cells.hpp"
#include "gsnav/detail/scene/visible_settings.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav::detail {

/// Finds the rows of a set that are seen from viewpoints. Each thread looks from viewpoints of its own,
/// so that no thread waits for another within an image.
template <Backend B>
class SeenFromViewpoints {
 public:
  SeenFromViewpoints(B& backend, const GaussianSet& set, std::span<const Vec3d> viewpoints,
                     const VisibleSettings& settings)
      : backend_(backend), set_(set), viewpoints_(viewpoints), settings_(settings) {
    const std::size_t count = worker_count(backend, set.gaussians.size());
    for (std::size_t w = 0; w < count; ++w)
      workers_.push_back(std::make_unique<Worker>(backend_of_worker(backend, count)));
  }

  /// Number of viewpoints per call of `look` that keeps all threads busy.
  std::size_t at_once() const noexcept { return workers_.size() == 1 ? 1 : 8 * workers_.size(); }

  /// Looks from the viewpoints with the given indices. The rows that viewpoint which[k] sees are then
  /// rows(k).
  /// @return the errors of rendering
  Status look(std::span<const std::size_t> which) {
    while (rows_.size() < which.size()) rows_.emplace_back(set_.gaussians.chunk_count());
    std::atomic<std::size_t> next{0};
    std::vector<Status> results(workers_.size());
    backend_.parallel_for(workers_.size(), [&](std::size_t w) {
      results[w] = guarded([&]() -> Status {
        for (std::size_t k; (k = next.fetch_add(1)) < which.size();) {
          if (Status s = look_from(*workers_[w], which[k], rows_[k]); !s) return s;
        }
        return {};
      });
    });
    for (Status& s : results) {
      if (!s) return std::move(s);
    }
    return {};
  }
  /// [chunks], the rows seen from viewpoint which[k] of the last call of `look`.
  std::span<const RowBits> rows(std::size_t k) const noexcept { return rows_[k]; }

 private:
  struct Worker {
    explicit Worker(const B& b) : backend(b), weights(backend) {}
    B backend;
    RowWeightsWorkspace<B> weights;
    std::vector<float> most;  // [rows]
  };

  /// Number of threads that work by themselves. Memory limits it: an image takes about 100 bytes per
  /// row.
  static std::size_t worker_count(const B& backend, std::size_t rows) noexcept {
    if constexpr (ThreadFramesBackend<B>) {
      constexpr std::size_t kMostBytes = std::size_t{4} << 30, kBytesPerRow = 100;
      const std::size_t fit = kMostBytes / kBytesPerRow / std::max<std::size_t>(rows, 1);
      return std::clamp<std::size_t>(fit, 1, concurrency_of(backend));
    }
    return 1;
  }
  static B backend_of_worker(const B& backend, std::size_t workers) {
    if constexpr (ThreadFramesBackend<B>) {
      if (workers > 1) return backend.one_thread();
    }
    return backend;
  }

  Status look_from(Worker& worker, std::size_t v, std::vector<RowBits>& rows) const {
    worker.most.assign(set_.gaussians.size(), 0.0f);
    for (const Camera& camera :
         cube_cameras(viewpoints_[v], v, settings_.face, settings_.near_plane, settings_.near_sigma)) {
      Status s = add_row_weights(worker.backend, worker.weights, set_, camera, worker.most);
      if (!s) return s;
    }
    worker.backend.parallel_for(rows.size(), [&](std::size_t i) {
      rows[i] = seen_rows(worker.most, i, settings_.rows, settings_.min_weight);
    });
    return {};
  }

  B& backend_;
  GaussianSet set_;
  std::span<const Vec3d> viewpoints_;
  const VisibleSettings& settings_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::vector<std::vector<RowBits>> rows_;
};

}  // namespace gsnav::detail
