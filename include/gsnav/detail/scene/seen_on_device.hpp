// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/core/host_array.hpp"
#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/render/row_weights.hpp"
#include "gsnav/detail/scene/gaussian_arrays.hpp"
#include "gsnav/detail/scene/seen_cells.hpp"
#include "gsnav/detail/scene/visible_settings.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::detail {

/// Backends with a batch renderer that weighs the Gaussians of a set.
template <class B>
concept WeighsBatches =
    !is_host_backend<B> && requires(typename B::batch_renderer & r, const GaussianSet& set,
                                    std::span<const typename B::batch_renderer::camera_type> cameras,
                                    std::size_t n, float* most) {
  { r.weigh(set, cameras, n, most) } -> std::same_as<Status>;
};

/// SeenFromViewpoints on such a backend, with the same bits.
template <WeighsBatches B>
class SeenOnDevice {
 public:
  SeenOnDevice(B& backend, PoolBackend& host, const GaussianCloud& cloud,
               const Similarity& world_from_asset, std::span<const Vec3d> viewpoints,
               const VisibleSettings& settings) noexcept
      : backend_(backend),
        host_(host),
        cloud_(cloud),
        world_from_asset_(world_from_asset),
        viewpoints_(viewpoints),
        settings_(settings) {}

  /// Number of viewpoints per call of `look`: at most 16. Their shares of light take at most 256 MB,
  /// unless one viewpoint alone takes more.
  std::size_t at_once() const noexcept {
    constexpr std::size_t kMost = 16, kShares = std::size_t{1} << 26;
    return std::clamp<std::size_t>(kShares / std::max<std::size_t>(cloud_.size(), 1), 1, kMost);
  }

  Status look(std::span<const std::size_t> which) {
    return guarded([&]() -> Status {
      if (cloud_.size() == 0) return {};
      if (work_ == nullptr)
        work_ = std::make_unique<Work>(backend_, cloud_, world_from_asset_, at_once());
      for (std::size_t done = 0; done < which.size();) {
        const auto some = which.subspan(done, std::min(capacity(), which.size() - done));
        if (Status s = weigh(some, work_->most.data() + done * cloud_.size()); !s) return s;
        done += some.size();
      }
      return find_rows(which.size());
    });
  }
  std::span<const RowBits> rows(std::size_t k) const noexcept {
    return work_ == nullptr ? std::span<const RowBits>() : work_->rows[k];
  }

 private:
  using Batch = typename B::batch_renderer;

  /// Memory. The first look allocates it, and reports that there is none.
  struct Work {
    Work(B& backend, const GaussianCloud& cloud, const Similarity& world_from_asset, std::size_t at_once)
        : arrays(backend, cloud),
          set(arrays.set(world_from_asset)),
          renderer(backend, config_of(cloud)),
          most(backend),
          rows(at_once, std::vector<RowBits>(set.gaussians.chunk_count())) {
      most.resize_discard(at_once * cloud.size());
      most_here.resize(most.size());
    }
    static RenderConfig config_of(const GaussianCloud& cloud) {
      RenderConfig config = weighing_config();
      config.blend_space = cloud.set().color_space;  // no colour is read
      return config;
    }

    GaussianArrays<B> arrays;
    GaussianSet set;
    Batch renderer;
    Buffer<float, B> most;                   // [viewpoints][rows]
    HostArray<float, B> most_here;           // [viewpoints][rows]
    std::vector<std::vector<RowBits>> rows;  // [viewpoints][chunks]
    bool measured = false;                   // the renderer knows how much memory a viewpoint needs
  };

  std::vector<typename Batch::camera_type> cameras_of(std::span<const std::size_t> which) const {
    std::vector<typename Batch::camera_type> out;
    for (const std::size_t v : which) {
      for (const Camera& camera :
           cube_cameras(viewpoints_[v], v, settings_.face, settings_.near_plane, settings_.near_sigma))
        out.push_back({camera, {}});
    }
    return out;
  }
  /// Number of viewpoints of a call for which there is memory. The first call has one.
  std::size_t capacity() const {
    if (!work_->measured) return 1;
    const std::vector<std::size_t> first(at_once(), 0);
    const std::size_t cameras = work_->renderer.capacity(std::span(&work_->set, 1), cameras_of(first));
    return std::max<std::size_t>(1, cameras / kFaces);
  }
  Status weigh(std::span<const std::size_t> which, float* most) {
    if (Status s = work_->renderer.weigh(work_->set, cameras_of(which), kFaces, most); !s) return s;
    work_->measured = true;
    return work_->renderer.finish();
  }
  /// Finds the rows that the first `count` viewpoints see, by their shares of light.
  Status find_rows(std::size_t count) {
    Work& w = *work_;
    const std::size_t size = cloud_.size(), chunks = w.rows[0].size();
    w.most.download(w.most_here.data(), count * size);
    if (Status s = backend_.synchronize(); !s) return s;
    host_.parallel_for(count * chunks, [&](std::size_t i) {
      const std::size_t k = i / chunks, chunk = i % chunks;
      const std::span<const float> most(w.most_here.data() + k * size, size);
      w.rows[k][chunk] = seen_rows(most, chunk, settings_.rows, settings_.min_weight);
    });
    return {};
  }

  static constexpr std::size_t kFaces = 6;
  B& backend_;
  PoolBackend& host_;
  const GaussianCloud& cloud_;
  Similarity world_from_asset_;
  std::span<const Vec3d> viewpoints_;
  const VisibleSettings& settings_;
  std::unique_ptr<Work> work_;
};

}  // namespace gsnav::detail
