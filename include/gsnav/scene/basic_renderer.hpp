// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <cstddef>
#include <functional>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/render/draw_frame.hpp"
#include "gsnav/detail/render/frame_batch.hpp"
#include "gsnav/detail/render/thread_frames.hpp"
#include "gsnav/detail/scene/gaussian_arrays.hpp"
#include "gsnav/render/frames.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/packed_cloud.hpp"

namespace gsnav {

/// Renders Gaussians and meshes with a scalar type and a backend that you choose at compile time.
/// `Renderer` is the same for a Device that is chosen at run time.
///
///     gsnav::SerialBackend backend;
///     gsnav::BasicRenderer renderer(backend);   // BasicRenderer<float, gsnav::SerialBackend>
///     auto frames = renderer.render(cloud.set(), camera).value();   // frames.rgb, ...
///
/// All arithmetic is done in `S`; sort keys are float32 for every `S`. Scratch memory is kept between
/// calls, so that a second frame of the same size allocates only what the caller's vectors need.
///
/// On a backend with a renderer of batches (CudaBackend) frames are drawn by it, in float: one frame is
/// a batch of one. The stages of draw_frame draw other frames, with the same bits.
///
/// The backend must outlive the renderer. So must the arrays of the meshes that are set; sets and
/// cameras are read during a call only (docs/reference/ownership.md). A moved-from renderer keeps its
/// settings, has no meshes and no scratch, and may render again.
///
/// Floating-point arithmetic must round to nearest (`fegetround() == FE_TONEAREST`, the default of a
/// program); other modes give other bits. Flushing denormals to zero changes none.
template <class S, Backend B>
class BasicRenderer {
 public:
  /// Keeps a pointer to `backend`, which must outlive the renderer.
  explicit BasicRenderer(B& backend, const RenderConfig& config = {})
      : backend_(&backend),
        config_(config),
        workspace_(backend),
        device_images_(backend),
        batches_(backend) {}

  /// Settings of the coming frames.
  const RenderConfig& config() const noexcept { return config_; }
  /// Replaces the settings. They are checked when a frame is rendered.
  void set_config(const RenderConfig& config) { config_ = config; }

  /// Sets the meshes that the coming frames draw among the Gaussians (docs/reference/composition.md),
  /// and their light. An empty span removes them. Only views are copied: the arrays must be in the
  /// backend's memory and stay valid while frames use them. To move a mesh, set all of them again.
  void set_meshes(std::span<const MeshInstance> meshes, const MeshLight& light = {}) {
    meshes_.assign(meshes.begin(), meshes.end());
    light_ = light;
  }

  /// Renders all sets, sorted together, once from each camera. All cameras have one size; the arrays of
  /// `sets` are in the backend's memory. Throws nothing.
  /// @return the frames, or an error:
  /// - invalid_argument: a field is out of range (the message names it), there is no camera, or cameras
  ///   differ in size.
  /// - unsupported: a frame has 2^32 Gaussians or triangles or more, or there are meshes with
  ///   MeshAlpha::blend and Composite::hard_depth.
  /// - backend_failure: the backend reports an error.
  /// - out_of_memory: images or scratch cannot be allocated. The message has the number and size of the
  ///   frames and their Gaussians. Images larger than the machine's memory are refused before anything
  ///   is allocated.
  Result<Frames<S>> render(std::span<const GaussianSet> sets, std::span<const Camera> cameras) {
    Frames<S> frames;
    if (Status s = render(sets, cameras, frames); !s) return s;
    return frames;
  }
  /// Renders one set from one camera. Errors: as above.
  Result<Frames<S>> render(const GaussianSet& set, const Camera& camera) {
    return render(std::span(&set, 1), std::span(&camera, 1));
  }

  /// Renders into `out`, whose vectors are resized and reused. Errors: as above.
  Status render(std::span<const GaussianSet> sets, std::span<const Camera> cameras, Frames<S>& out) {
    if (Status s = size_frames(cameras, config_.outputs, out); !s) return s;
    const auto job_of = [&](std::size_t c) {
      return FrameJob<S>{sets, &cameras[c], &config_, images_of(out, c), mesh_frame()};
    };
    return render_jobs(cameras.size(), job_of, out.stats);
  }

  /// Renders independent frames. Each job has its own sets and camera, and images in host memory of its
  /// camera's size; an image with a null pointer is not made. The bits are those of rendering one job at
  /// a time.
  /// @param stats one element for each job, at least jobs.size().
  /// @param idle Called before each wait for a batch of frames, if given.
  /// @return the error of the first job that fails, of those drawn in batches before others; errors are
  /// those of render above.
  Status render(std::span<const FrameJob<S>> jobs, std::span<RenderStats> stats,
                const std::function<void()>& idle = {}) {
    return check_and_render(jobs, stats, Images::host, idle);
  }

  /// Renders independent frames like `render`, with images in the backend's memory.
  Status render_on_backend(std::span<const FrameJob<S>> jobs, std::span<RenderStats> stats,
                           const std::function<void()>& idle = {}) {
    return check_and_render(jobs, stats, Images::on_backend, idle);
  }

  /// Sizes `out` for the images `outputs` (a bitmask of kRgb, ...) of these cameras. Errors: those of
  /// render above.
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
  /// Pointers to the images of camera `c` in `out`.
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

  /// Bytes of scratch memory that the renderer holds.
  std::size_t scratch_bytes() const noexcept {
    std::size_t sum = workspace_.capacity_bytes();
    if constexpr (ThreadFramesBackend<B>) sum += thread_frames_.capacity_bytes();
    if constexpr (kBatches) sum += batches_.capacity_bytes();
    return sum;
  }

 private:
  /// True if frames are drawn by the backend's renderer of batches where it supports them.
  static constexpr bool kBatches = std::is_same_v<S, float> && BatchBackend<B>;
  enum class Images { host, on_backend };  // where the images of jobs are

  struct NoBatches {
    explicit NoBatches(B&) {}
  };
  template <class T>
  struct BatchesOf {
    using type = NoBatches;
  };
  template <BatchBackend T>
  struct BatchesOf<T> {
    using type = std::conditional_t<kBatches, FrameBatch<T>, NoBatches>;
  };
  struct NoThreadFrames {};
  template <class T>
  struct ThreadFramesOf {
    using type = NoThreadFrames;
  };
  template <ThreadFramesBackend T>
  struct ThreadFramesOf<T> {
    using type = ThreadFrames<S, T>;
  };

  /// Resizes the images of `out` to its cameras, width and height.
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

  /// Calls `run`, which may throw. To an out_of_memory error it adds the size of the frames and their
  /// number of Gaussians.
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

  Status check_and_render(std::span<const FrameJob<S>> jobs, std::span<RenderStats> stats, Images where,
                          const std::function<void()>& idle) {
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
      if (Status s = validate(*job.camera); !s) return s;  // scratch is sized by the camera
    }
    return render_jobs(
        jobs.size(), [&](std::size_t c) { return jobs[c]; }, stats, where, idle);
  }
  template <class JobOf>
  Status render_jobs(std::size_t count, const JobOf& job_of, std::span<RenderStats> stats,
                     Images where = Images::host, const std::function<void()>& idle = {}) {
    if (count == 0) return backend_->synchronize();
    return with_sizes(count, job_of(0), [&] { return draw_jobs(count, job_of, stats, where, idle); });
  }
  /// Chooses how frames are drawn: by the backend's renderer of batches, by a thread each, or one by
  /// one.
  template <class JobOf>
  Status draw_jobs(std::size_t count, const JobOf& job_of, std::span<RenderStats> stats, Images where,
                   const std::function<void()>& idle) {
    if constexpr (kBatches) {
      jobs_.clear();
      together_.clear();
      alone_.clear();
      const RenderConfig* checked = nullptr;  // Neighbours often share one.
      bool valid = false;
      for (std::size_t c = 0; c < count; ++c) {
        const FrameJob<S>& job = jobs_.emplace_back(job_of(c));
        if (checked != job.config) valid = validate(*(checked = job.config)).ok();
        // draw_frame reports a configuration that is not valid.
        (valid && FrameBatch<B>::supports(job) ? together_ : alone_).push_back(c);
      }
      const CopyKind to = where == Images::host ? CopyKind::device_to_host : CopyKind::device_to_device;
      if (!together_.empty()) {
        if (Status s = batches_.render(jobs_, together_, stats, to, idle); !s) return s;
      }
      for (const std::size_t c : alone_) {
        if (Status s = draw_alone(jobs_[c], stats[c], where); !s) return s;
      }
      return backend_->synchronize();
    }
    if constexpr (ThreadFramesBackend<B>) {
      if (ThreadFrames<S, B>::worth_it(*backend_, count)) {
        if (Status s = thread_frames_.render(*backend_, count, job_of, stats); !s) return s;
        return backend_->synchronize();
      }
    }
    for (std::size_t c = 0; c < count; ++c) {
      if (Status s = draw_alone(job_of(c), stats[c], where); !s) return s;
    }
    return backend_->synchronize();
  }
  /// Draws a frame by the stages of draw_frame.
  Status draw_alone(const FrameJob<S>& job, RenderStats& stats, Images where) {
    const auto draw = [&](const FrameImages<S>& images) {
      return draw_frame<S>(*backend_, workspace_, job.sets, job.meshes, *job.camera, *job.config, images,
                           &stats);
    };
    if (is_host_backend<B> || where == Images::on_backend) return draw(job.images);
    const std::size_t pixels =
        static_cast<std::size_t>(job.camera->width) * static_cast<std::size_t>(job.camera->height);
    const FrameImages<S> images = device_images(job.images, pixels);
    if (Status s = draw(images); !s) return s;
    for (const ImageKind<S>& k : kImages<S>) {
      if (job.images.*k.image == nullptr) continue;
      backend_->copy(job.images.*k.image, images.*k.image, pixels * k.channels * sizeof(S),
                     CopyKind::device_to_host);
    }
    return {};
  }
  MeshFrame mesh_frame() const noexcept { return {meshes_, light_}; }

  /// Images in the backend's memory, for those outputs that `host` has.
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
  [[no_unique_address]] typename BatchesOf<B>::type batches_;
  // Frames of a call, where there are batches:
  std::vector<FrameJob<S>> jobs_;
  std::vector<std::size_t> together_, alone_;
};

/// Deduces float arithmetic.
template <Backend B>
explicit BasicRenderer(B&, const RenderConfig& = {}) -> BasicRenderer<float, B>;

}  // namespace gsnav
