// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <cstddef>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/render/draw_frame.hpp"
#include "gsnav/detail/render/thread_frames.hpp"
#include "gsnav/detail/scene/gaussian_arrays.hpp"
#include "gsnav/render/frames.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/packed_cloud.hpp"

namespace gsnav {

/// The renderer over a scalar and a backend of your choice; Renderer takes a Device. Keeps its scratch
/// between calls: a steady frame allocates nothing but what its caller's vectors need. `S` is the scalar
/// of all arithmetic; sort keys are float32 for every S. The backend must outlive it. One that was moved
/// from has its settings, no meshes and no scratch, and may render on. Floating point must round to
/// nearest (fegetround() == FE_TONEAREST, as a program starts): in other modes images have other bits.
/// Flushing denormals to zero changes none.
///
///     gsnav::SerialBackend backend;
///     gsnav::BasicRenderer renderer(backend);   // BasicRenderer<float, gsnav::SerialBackend>
///     auto frames = renderer.render(cloud.set(), camera).value();   // frames.rgb, ...
///
/// It keeps a pointer to the backend and views of the meshes; sets and cameras are read during a call
/// only (docs/ownership.md).
template <class S, Backend B>
class BasicRenderer {
 public:
  /// A renderer without a scene. The backend must outlive it.
  explicit BasicRenderer(B& backend, const RenderConfig& config = {})
      : backend_(&backend), config_(config), workspace_(backend), device_images_(backend) {}

  /// The settings.
  const RenderConfig& config() const noexcept { return config_; }
  /// Changes the settings from the next frame on.
  void set_config(const RenderConfig& config) { config_ = config; }

  /// Meshes that the frames from now on show among the Gaussians (docs/composition.md); none: an empty
  /// span. Their arrays are in the backend's memory, and must stay there. To move one, set them again:
  /// nothing is copied but views.
  void set_meshes(std::span<const MeshInstance> meshes, const MeshLight& light = {}) {
    meshes_.assign(meshes.begin(), meshes.end());
    light_ = light;
  }

  /// Renders all sets, as one sorted list, from each camera; all cameras have one size. `sets` hold
  /// arrays in the backend's memory. Errors: invalid_argument (names the field; no camera; cameras of
  /// several sizes); unsupported (2^32 Gaussians or triangles in a frame; meshes on a backend that knows
  /// none, or with MeshAlpha::blend under Composite::hard_depth); backend_failure; out_of_memory, with
  /// the frames, their size and their Gaussians, where images or scratch cannot be allocated, and before
  /// trying where images are larger than the machine's memory. Throws nothing.
  Result<Frames<S>> render(std::span<const GaussianSet> sets, std::span<const Camera> cameras) {
    Frames<S> frames;
    if (Status s = render(sets, cameras, frames); !s) return s;
    return frames;
  }
  Result<Frames<S>> render(const GaussianSet& set, const Camera& camera) {
    return render(std::span(&set, 1), std::span(&camera, 1));
  }

  /// The same into images that are used again.
  Status render(std::span<const GaussianSet> sets, std::span<const Camera> cameras, Frames<S>& out) {
    if (Status s = size_frames(cameras, config_.outputs, out); !s) return s;
    const auto job_of = [&](std::size_t c) {
      return FrameJob<S>{sets, &cameras[c], &config_, images_of(out, c), mesh_frame()};
    };
    return render_jobs(cameras.size(), job_of, out.stats);
  }

  /// Renders frames that share nothing: each sees its own sets and goes to images in host memory, of its
  /// camera's size, that its caller has (a null pointer: not made). The same bits as one at a time.
  /// `stats` [jobs]. Errors: as of render above, of the first job that fails.
  Status render(std::span<const FrameJob<S>> jobs, std::span<RenderStats> stats) {
    if (stats.size() < jobs.size()) {
      return {Errc::invalid_argument, "stats has room for " + std::to_string(stats.size()) + " of " +
                                          std::to_string(jobs.size()) + " frames"};
    }
    if ((jobs.data() == nullptr || stats.data() == nullptr) && !jobs.empty()) {
      return {Errc::invalid_argument, "jobs or stats: a null pointer with a size"};
    }
    for (const FrameJob<S>& job : jobs) {
      if (job.camera == nullptr || job.config == nullptr) {
        return {Errc::invalid_argument, "FrameJob: camera and config must not be null"};
      }
      if (Status s = validate(*job.camera); !s) return s;  // scratch is sized by it
    }
    return render_jobs(
        jobs.size(), [&](std::size_t c) { return jobs[c]; }, stats);
  }

  /// One frame into images in the backend's memory, which are there once the backend has been
  /// synchronised. Errors: as of render above; what fails on a device after the call is for
  /// `synchronize()` to report.
  Status render_on_backend(const FrameJob<S>& job, RenderStats& stats) {
    if (job.camera == nullptr || job.config == nullptr) {
      return {Errc::invalid_argument, "FrameJob: camera and config must not be null"};
    }
    return with_sizes(1, job, [&] { return draw(job, stats); });
  }

  /// Makes room in `out` for the images `outputs` of these cameras. Errors: as of render above.
  static Status size_frames(std::span<const Camera> cameras, unsigned outputs, Frames<S>& out) {
    if (cameras.empty()) return {Errc::invalid_argument, "no camera to render from"};
    if (cameras.data() == nullptr)
      return {Errc::invalid_argument, "cameras: a null pointer with a size"};
    for (const Camera& c : cameras) {
      if (Status s = validate(c); !s) return s;
      if (c.width != cameras[0].width || c.height != cameras[0].height) {
        return {Errc::invalid_argument, "cameras of one batch must have one size"};
      }
    }
    out.cameras = cameras.size();
    out.width = static_cast<std::size_t>(cameras[0].width);
    out.height = static_cast<std::size_t>(cameras[0].height);
    return size_images(out, outputs);
  }
  /// Where the images of camera c lie in `out`.
  static FrameImages<S> images_of(Frames<S>& out, std::size_t c) noexcept {
    FrameImages<S> images;
    const std::size_t pixels = out.width * out.height;
    for (std::size_t i = 0; i < kImageCount; ++i) {
      static_assert(std::size(Frames<S>::kVectors) == kImageCount);
      std::vector<S>& values = out.*Frames<S>::kVectors[i];
      if (!values.empty())
        images.*kImages<S>[i].image = values.data() + c * pixels * kImages<S>[i].channels;
    }
    return images;
  }

  /// Bytes of scratch held.
  std::size_t scratch_bytes() const noexcept {
    std::size_t sum = workspace_.bytes();
    if constexpr (ThreadFramesBackend<B>) sum += thread_frames_.bytes();
    return sum;
  }

 private:
  struct NoThreadFrames {};
  template <class T>
  struct ThreadFramesOf {
    using type = NoThreadFrames;
  };
  template <ThreadFramesBackend T>
  struct ThreadFramesOf<T> {
    using type = ThreadFrames<S, T>;
  };

  /// Makes `out`'s images as large as its size says.
  static Status size_images(Frames<S>& out, unsigned outputs) {
    const std::size_t cameras = out.cameras, pixels = out.width * out.height;
    std::size_t channels = 0;
    for (const ImageKind<S>& k : kImages<S>) channels += (outputs & k.output) != 0 ? k.channels : 0;
    const std::size_t bytes = pixels * channels * sizeof(S);  // of a camera: at most 2^34
    const auto refused = [&](const std::string& why) {
      return Status(Errc::out_of_memory, "Renderer: the images of " + std::to_string(cameras) +
                                             " cameras of " + std::to_string(out.width) + " x " +
                                             std::to_string(out.height) + ", " + std::to_string(bytes) +
                                             " bytes each, " + why);
    };
    constexpr std::size_t kSmall = std::size_t{1} << 30;
    if (bytes != 0 && cameras > kSmall / bytes) {
      const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
      const std::size_t memory = pages > 0 && page > 0
                                     ? static_cast<std::size_t>(pages) * static_cast<std::size_t>(page)
                                     : std::numeric_limits<std::size_t>::max() / 2;
      if (cameras > memory / bytes)
        return refused("are more than the machine's memory: render fewer at a time");
    }
    Status s = detail::guarded([&] {
      for (std::size_t i = 0; i < kImageCount; ++i) {
        const ImageKind<S>& k = kImages<S>[i];
        (out.*Frames<S>::kVectors[i])
            .resize((outputs & k.output) != 0 ? cameras * pixels * k.channels : 0);
      }
      out.stats.assign(cameras, {});
      return Status();
    });
    return s.ok() ? s : refused("cannot be allocated: render fewer at a time");
  }

  Status draw(const FrameJob<S>& job, RenderStats& stats) {
    return draw_frame<S>(*backend_, workspace_, job.sets, job.meshes, *job.camera, *job.config,
                         job.images, &stats);
  }

  /// Runs what may throw; where memory was missing the error says for what.
  template <class Run>
  static Status with_sizes(std::size_t frames, const FrameJob<S>& first, const Run& run) {
    if (first.sets.data() == nullptr && !first.sets.empty()) {
      return {Errc::invalid_argument, "sets: a null pointer with a size"};
    }
    Status s = detail::guarded(run);
    if (s.code() != Errc::out_of_memory) return s;
    std::size_t gaussians = 0;
    for (const GaussianSet& set : first.sets) gaussians += set.gaussians.size();
    return {Errc::out_of_memory, "Renderer: not enough memory to draw " + std::to_string(frames) +
                                     " frames of " + std::to_string(first.camera->width) + " x " +
                                     std::to_string(first.camera->height) + " with " +
                                     std::to_string(gaussians) + " Gaussians: " + s.message()};
  }

  template <class JobOf>
  Status render_jobs(std::size_t count, const JobOf& job_of, std::span<RenderStats> stats) {
    if (count == 0) return backend_->synchronize();
    return with_sizes(count, job_of(0), [&] { return draw_jobs(count, job_of, stats); });
  }
  template <class JobOf>
  Status draw_jobs(std::size_t count, const JobOf& job_of, std::span<RenderStats> stats) {
    if constexpr (ThreadFramesBackend<B>) {
      if (ThreadFrames<S, B>::worth_it(*backend_, count)) {
        if (Status s = thread_frames_.render(*backend_, count, job_of, stats); !s) return s;
        return backend_->synchronize();
      }
    }
    for (std::size_t c = 0; c < count; ++c) {
      if (Status s = render_job(job_of(c), stats[c]); !s) return s;
    }
    return backend_->synchronize();
  }
  Status render_job(const FrameJob<S>& job, RenderStats& stats) {
    if constexpr (is_host_backend<B>) {
      return draw(job, stats);
    } else {
      const std::size_t pixels =
          static_cast<std::size_t>(job.camera->width) * static_cast<std::size_t>(job.camera->height);
      FrameImages<S> images = device_images(job.images, pixels);
      FrameJob<S> there = job;
      there.images = images;
      if (Status s = draw(there, stats); !s) return s;
      for (const ImageKind<S>& k : kImages<S>) {
        if (job.images.*k.image == nullptr) continue;
        backend_->copy(job.images.*k.image, images.*k.image, pixels * k.channels * sizeof(S),
                       CopyKind::device_to_host);
      }
      return {};
    }
  }
  MeshFrame mesh_frame() const noexcept { return {meshes_, light_}; }

  /// Room in the backend's memory for the images that `host` has.
  FrameImages<S> device_images(const FrameImages<S>& host, std::size_t pixels) {
    device_images_.resize_discard(channel_count(host) * pixels);
    return images_in(device_images_.data(), host, pixels);
  }

  B* backend_;
  RenderConfig config_;
  std::vector<MeshInstance> meshes_;
  MeshLight light_;
  RenderWorkspace<S, B> workspace_;
  Buffer<S, B> device_images_;
  [[no_unique_address]] typename ThreadFramesOf<B>::type thread_frames_;
};

/// Renders in float32 unless another scalar is named.
template <Backend B>
explicit BasicRenderer(B&, const RenderConfig& = {}) -> BasicRenderer<float, B>;

}  // namespace gsnav
