// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/render/thread_frames.hpp"
#include "gsnav/render/config.hpp"

namespace gsnav {

/// A renderer that draws many cameras in one call, each with its own sets, into images in the backend's
/// memory. `supports` says whether it can draw a frame, `capacity` how many cameras one call can draw.
/// Both are asked before `render`, so an error of `render` is a failure. CudaBatchRenderer documents the
/// members.
template <class R, class B>
concept BatchRenderer = std::constructible_from<R, B&, const RenderConfig&> &&
    std::default_initializable<typename R::images_type> &&
    requires(R& batch, const R& asked, const FrameJob<float>& job, std::span<const GaussianSet> sets,
             std::span<const typename R::camera_type> cameras, typename R::camera_type& camera,
             typename R::images_type& images) {
  { R::supports(*job.config, sets, job.meshes) } -> std::same_as<Status>;
  { asked.capacity(sets, cameras) } -> std::same_as<std::size_t>;
  { batch.render(sets, cameras, std::as_const(images)) } -> std::same_as<Status>;
  { batch.finish() } -> std::same_as<Status>;
  camera = {*job.camera, camera.sets, job.meshes};
  camera.sets = std::span<const std::uint32_t>();
  camera.seen = std::span<const View<const std::uint32_t>>();
  images.floats = FrameImages<float>();
};

/// Renderers that count how often `finish` drew the last call again. The images of other renderers are
/// complete only after `finish`.
template <class R>
concept CountsReruns = requires(const R& batch) {
  { batch.stats().reruns } -> std::convertible_to<int>;
};

/// Backends with a BatchRenderer as their `batch_renderer`.
template <class B>
concept BatchBackend = Backend<B> && !is_host_backend<B> && BatchRenderer<typename B::batch_renderer, B>;

/// Draws independent frames with a backend's batched renderer. All frames of one size, configuration and
/// kind of images are drawn by one call, or by the fewest calls that its capacity allows. Images have
/// the same bits as those of BasicRenderer.
template <BatchBackend B>
class FrameBatch {
 public:
  explicit FrameBatch(B& backend) : backend_(&backend), scratch_(backend) {}

  /// Whether `render` can draw a frame.
  static bool supports(const FrameJob<float>& job) {
    return Batch::supports(*job.config, job.sets, job.meshes).ok();
  }

  /// Draws frames, all of which must be supported. `to` says whether their images are in host memory or
  /// in backend memory. Waits for the backend, and calls `idle` before each wait while it draws, if
  /// given. Errors: those of rendering. Throws gsnav::Error (out_of_memory).
  Status render(std::span<const FrameJob<float>> jobs, CopyKind to,
                const std::function<void()>& idle = {}) {
    for (Known& k : known_) k.jobs.clear();
    for (std::size_t j = 0; j < jobs.size(); ++j) group(kind_of(jobs[j])).jobs.push_back(j);
    for (Known& k : known_) {
      // Sorted by the addresses of their images, so that neighbours can be drawn in place or copied
      // together.
      const auto first = [&](std::size_t j) {
        for (const ImageKind<float>& image : kImages<float>) {
          if (float* const p = jobs[j].images.*image.image; p != nullptr) return p;
        }
        return static_cast<float*>(nullptr);
      };
      std::sort(k.jobs.begin(), k.jobs.end(),
                [&](std::size_t a, std::size_t b) { return std::less<>()(first(a), first(b)); });
      list_sets(k.jobs, jobs);
      const std::span<const typename Batch::camera_type> cameras(cameras_);
      for (std::size_t begin = 0, count = 0; begin < k.jobs.size(); begin += count) {
        count = k.batch->capacity(sets_, cameras.subspan(begin));
        count = std::clamp(count, std::size_t{1}, k.jobs.size() - begin);
        if (Status s = draw(k, begin, count, jobs, to, idle); !s) return s;
      }
    }
    return backend_->synchronize();
  }

 private:
  using Batch = typename B::batch_renderer;

  /// Properties that are equal for all frames of one call.
  struct Kind {
    RenderConfig config;
    int width = 0, height = 0;
    unsigned images = 0;  // Output
    bool meshes = false;  // with meshes, `fast` uses the exponential of `exact`
    bool operator==(const Kind&) const = default;
  };
  struct Known {
    Kind kind;
    std::unique_ptr<Batch> batch;
    std::vector<std::size_t> jobs;  // of the current call
  };

  static Kind kind_of(const FrameJob<float>& job) noexcept {
    Kind k{*job.config, job.camera->width, job.camera->height, 0, !job.meshes.instances.empty()};
    k.config.outputs = kRgb;  // so that it compares equal; `images` has the outputs
    for (const ImageKind<float>& i : kImages<float>) {
      k.images |= job.images.*i.image != nullptr ? i.output : 0u;
    }
    return k;
  }

  Known& group(const Kind& kind) {
    for (Known& k : known_) {
      if (k.kind == kind) return k;
    }
    return known_.emplace_back(Known{kind, std::make_unique<Batch>(*backend_, kind.config), {}});
  }

  /// Draws the frames [begin, begin + count) of a group by one call. Call list_sets() first, which lists
  /// the group's sets and cameras.
  Status draw(Known& known, std::size_t begin, std::size_t count, std::span<const FrameJob<float>> jobs,
              CopyKind to, const std::function<void()>& idle) {
    const std::span<const std::size_t> which = std::span(known.jobs).subspan(begin, count);
    const std::size_t pixels =
        static_cast<std::size_t>(known.kind.width) * static_cast<std::size_t>(known.kind.height);
    const bool in_place = to == CopyKind::device_to_device && in_rows(which, jobs, pixels);
    typename Batch::images_type images;
    images.floats = jobs[which.front()].images;
    if (!in_place) {
      scratch_.resize_discard(channel_count(images.floats) * pixels * which.size());
      images.floats = images_in(scratch_.data(), images.floats, pixels * which.size());
    }
    if (Status s = known.batch->render(sets_, std::span(cameras_).subspan(begin, count), images); !s)
      return s;
    // Before the copies: those to memory that is not page-locked wait for the images.
    if (idle) idle();
    const auto hand_out = [&] {
      if (in_place) return;
      for (const ImageKind<float>& k : kImages<float>) {
        if (images.floats.*k.image != nullptr) copy(k, images.floats.*k.image, which, jobs, pixels, to);
      }
    };
    // The copies are enqueued before finish(), so that the device does not wait for the host. If scratch
    // had to grow, finish() has drawn the images again, and they are copied again.
    if constexpr (CountsReruns<Batch>) hand_out();
    if (Status s = known.batch->finish(); !s) return s;
    if constexpr (CountsReruns<Batch>) {
      if (known.batch->stats().reruns == 0) return {};
    }
    hand_out();
    return {};
  }

  /// Fills sets_ and cameras_ and the lists that the cameras refer to. A set that several frames share
  /// is listed once.
  void list_sets(std::span<const std::size_t> which, std::span<const FrameJob<float>> jobs) {
    sets_.clear();
    places_.clear();
    lists_.clear();
    seen_.clear();
    cameras_.clear();
    for (const std::size_t j : which) {
      for (const GaussianSet& set : jobs[j].sets) {
        if (set.gaussians.size() != 0) list(set);
      }
      // An empty list would mean all sets, so that a frame without sets gets one empty set.
      if (lists_.size() == first_of(cameras_.size())) list({});
      cameras_.push_back({*jobs[j].camera, {}, jobs[j].meshes});
      ends_.resize(cameras_.size());
      ends_.back() = lists_.size();
    }
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      cameras_[c].sets = std::span(lists_).subspan(first_of(c), ends_[c] - first_of(c));
      cameras_[c].seen = std::span(seen_).subspan(first_of(c), ends_[c] - first_of(c));
    }
  }
  std::size_t first_of(std::size_t camera) const noexcept { return camera == 0 ? 0 : ends_[camera - 1]; }

  /// Appends a set to the list of the last camera. The visible rows of a set are kept per camera, so
  /// that cameras can share the set.
  void list(GaussianSet set) {
    seen_.push_back(set.selection.seen);
    set.selection.seen = {};
    lists_.push_back(place_of(set));
  }
  std::uint32_t place_of(const GaussianSet& set) {
    // Compares all bytes. A set whose padding differs is listed twice, which changes no image.
    const auto same = [](const GaussianSet& a, const GaussianSet& b) {
      return std::memcmp(&a, &b, sizeof a) == 0;
    };
    // Sets of one cloud differ in their chunks, so that few sets have equal hashes.
    const std::hash<const void*> of;
    const std::size_t hash =
        31 * of(set.gaussians.shape.means.data[0]) + of(set.selection.drawn_chunks.data);
    auto [at, end] = places_.equal_range(hash);
    for (; at != end; ++at) {
      if (same(sets_[at->second], set)) return at->second;
    }
    const auto place = static_cast<std::uint32_t>(sets_.size());
    sets_.push_back(set);
    places_.emplace(hash, place);
    return place;
  }

  /// Whether the images of all frames are contiguous in memory, so that a batch can be drawn in place.
  static bool in_rows(std::span<const std::size_t> which, std::span<const FrameJob<float>> jobs,
                      std::size_t pixels) {
    const FrameImages<float>& first = jobs[which.front()].images;
    for (std::size_t c = 1; c < which.size(); ++c) {
      for (const ImageKind<float>& k : kImages<float>) {
        const float* const here = jobs[which[c]].images.*k.image;
        if (first.*k.image != nullptr && here != first.*k.image + c * pixels * k.channels) return false;
      }
    }
    return true;
  }

  void copy(const ImageKind<float>& image, const float* from, std::span<const std::size_t> which,
            std::span<const FrameJob<float>> jobs, std::size_t pixels, CopyKind kind) {
    const std::size_t size = pixels * image.channels;
    const auto target = [&](std::size_t c) { return jobs[which[c]].images.*image.image; };
    for (std::size_t begin = 0, end = 0; begin < which.size(); begin = end) {
      for (end = begin + 1; end < which.size() && target(end) == target(begin) + (end - begin) * size;)
        ++end;
      backend_->copy(target(begin), from + begin * size, (end - begin) * size * sizeof(float), kind);
    }
  }

  B* backend_;
  std::vector<Known> known_;
  Buffer<float, B> scratch_;
  // Data of the current group:
  std::vector<GaussianSet> sets_;
  std::unordered_multimap<std::size_t, std::uint32_t> places_;  // index in sets_ by hash of addresses
  std::vector<std::uint32_t> lists_;
  std::vector<View<const std::uint32_t>> seen_;  // visible rows of each entry of lists_
  std::vector<std::size_t> ends_;
  std::vector<typename Batch::camera_type> cameras_;
};

}  // namespace gsnav
