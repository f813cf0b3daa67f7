// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <span>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/status.hpp"
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
               const VisibleSettings& settings)
      : backend_(backend),
        host_(host),
        viewpoints_(viewpoints),
        settings_(settings),
        arrays_(backend, cloud),
        set_(arrays_.set(world_from_asset)),
        renderer_(backend, config_of(cloud)),
        most_(backend),
        rows_(at_once(), std::vector<RowBits>(set_.gaussians.chunk_count())) {
    most_.resize_discard(at_once() * rows());
    most_here_.resize(most_.size());
  }

  /// As many viewpoints as need 256 MB for their shares of light, but at most 16.
  std::size_t at_once() const noexcept {
    constexpr std::size_t kMost = 16, kShares = std::size_t{1} << 26;
    return std::clamp<std::size_t>(kShares / std::max<std::size_t>(rows(), 1), 1, kMost);
  }

  Status look(std::span<const std::size_t> which) {
    if (rows() == 0) return {};
    for (std::size_t done = 0; done < which.size();) {
      const auto some = which.subspan(done, std::min(capacity(), which.size() - done));
      if (Status s = weigh(some, most_.data() + done * rows()); !s) return s;
      done += some.size();
    }
    backend_.copy(most_here_.data(), most_.data(), which.size() * rows() * sizeof(float),
                  CopyKind::device_to_host);
    if (Status s = backend_.synchronize(); !s) return s;
    const std::size_t chunks = rows_[0].size();
    host_.parallel_for(which.size() * chunks, [&](std::size_t i) {
      const std::size_t k = i / chunks, chunk = i % chunks;
      const std::span<const float> most(most_here_.data() + k * rows(), rows());
      rows_[k][chunk] = seen_rows(most, chunk, settings_.rows, settings_.min_weight);
    });
    return {};
  }
  std::span<const RowBits> rows(std::size_t k) const noexcept { return rows_[k]; }

 private:
  using Renderer = typename B::batch_renderer;

  static RenderConfig config_of(const GaussianCloud& cloud) {
    RenderConfig config = weighing_config();
    config.blend_space = cloud.set().color_space;  // no colour is read
    return config;
  }
  std::size_t rows() const noexcept { return set_.gaussians.size(); }

  std::vector<typename Renderer::camera_type> cameras_of(std::span<const std::size_t> which) const {
    std::vector<typename Renderer::camera_type> out;
    for (const std::size_t v : which) {
      for (const Camera& camera :
           cube_cameras(viewpoints_[v], v, settings_.face, settings_.near_plane, settings_.near_sigma))
        out.push_back({camera, {}});
    }
    return out;
  }
  /// Number of viewpoints of a call for which there is memory. The first call has one.
  std::size_t capacity() const {
    if (!measured_) return 1;
    const std::vector<std::size_t> first(at_once(), 0);
    return std::max<std::size_t>(1, renderer_.capacity(std::span(&set_, 1), cameras_of(first)) / kFaces);
  }
  Status weigh(std::span<const std::size_t> which, float* most) {
    if (Status s = renderer_.weigh(set_, cameras_of(which), kFaces, most); !s) return s;
    measured_ = true;
    return renderer_.finish();
  }

  static constexpr std::size_t kFaces = 6;
  B& backend_;
  PoolBackend& host_;
  std::span<const Vec3d> viewpoints_;
  const VisibleSettings& settings_;
  GaussianArrays<B> arrays_;
  GaussianSet set_;
  Renderer renderer_;
  Buffer<float, B> most_;                   // [viewpoints][rows]
  HostArray<float, B> most_here_;           // [viewpoints][rows]
  std::vector<std::vector<RowBits>> rows_;  // [viewpoints][chunks]
  bool measured_ = false;
};

}  // namespace gsnav::detail
