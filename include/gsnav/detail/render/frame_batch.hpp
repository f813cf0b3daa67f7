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
#include "gsnav/detail/core/guarded.hpp"
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

/// Renderers that count the work of the last call that `finish` completed.
template <class R>
concept CountsWork = requires(const R& batch) {
  { batch.stats().tile_intersections } -> std::convertible_to<std::uint64_t>;
  { batch.stats().scratch_bytes } -> std::convertible_to<std::uint64_t>;
  { batch.stats().meshes } -> std::convertible_to<MeshStats>;
};

/// Backends with a BatchRenderer as their `batch_renderer`.
template <class B>
concept BatchBackend = Backend<B> && !is_host_backend<B> && BatchRenderer<typename B::batch_renderer, B>;

/// Draws independent frames with a backend's batched renderer. All frames of one size, configuration and
/// kind of images are drawn by one call, or by the fewest calls that its capacity allows. One frame is a
/// batch of one. Images have the same bits as those of draw_frame.
template <BatchBackend B>
class FrameBatch {
 public:
  explicit FrameBatch(B& backend) : backend_(&backend), scratch_(backend) {}

  /// Whether `render` can draw a frame whose configuration and camera are valid. Other frames are left
  /// to draw_frame.
  static bool supports(const FrameJob<float>& job) {
    return Batch::supports(*job.config, job.sets, job.meshes).ok();
  }

  /// Draws the frames jobs[j] for each j in `which`, all of which must be supported. Waits for the
  /// backend.
  /// @param stats elements of `which` are filled. Counts of splats and triangles are 0 for frames that
  ///   shared a call with others, and `visible` always.
  /// @param to whether images are in host memory or in backend memory
  /// @param idle Called before each wait for a call, if given.
  /// @return the errors of rendering, out_of_memory among them.
  Status render(std::span<const FrameJob<float>> jobs, std::span<const std::size_t> which,
                std::span<RenderStats> stats, CopyKind to, const std::function<void()>& idle = {}) {
    ++calls_;
    for (Known& k : known_) k.jobs.clear();
    for (const std::size_t j : which) group(kind_of(jobs[j])).jobs.push_back(j);
    for (Known& k : known_) {
      if (k.jobs.empty()) continue;
      k.last_call = calls_;
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
      if (Status s = list_sets(k.jobs, jobs); !s) return s;
      for (std::size_t begin = 0, count = 0; begin < k.jobs.size(); begin += count) {
        count = cameras_of_call(k, begin, to);
        if (Status s = draw_what_fits(k, begin, count, jobs, stats, to, idle); !s) return s;
      }
    }
    std::erase_if(known_, [this](const Known& k) { return calls_ - k.last_call >= kForgotten; });
    return backend_->synchronize();
  }

  /// Bytes of scratch memory, as far as it is known.
  std::size_t capacity_bytes() const noexcept {
    std::size_t sum = scratch_.capacity_bytes();
    if constexpr (CountsWork<Batch>) {
      for (const Known& k : known_) sum += static_cast<std::size_t>(k.batch->stats().scratch_bytes);
    }
    return sum;
  }

 private:
  using Batch = typename B::batch_renderer;
  /// Images that are copied to the host take at most this much backend memory at a time.
  static constexpr std::size_t kMostImageBytes = std::size_t{1} << 30;
  /// Calls after which the memory of a kind of frame is freed if none of them had one.
  static constexpr std::uint64_t kForgotten = 16;

  /// Properties that are equal for all frames of one call.
  struct Kind {
    RenderConfig config;
    int width = 0, height = 0;
    unsigned images = 0;  // Output
    bool meshes = false;  // with meshes, `fast` uses the exponential of `exact`
    bool operator==(const Kind&) const = default;
    std::size_t pixels() const noexcept {
      return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    }
  };
  struct Known {
    Kind kind;
    std::unique_ptr<Batch> batch;
    std::vector<std::size_t> jobs;  // of the current call
    std::uint64_t last_call = 0;    // that had such frames
  };

  static std::size_t channels_of(unsigned images) noexcept {
    std::size_t n = 0;
    for (const ImageKind<float>& i : kImages<float>) n += (images & i.output) != 0 ? i.channels : 0;
    return n;
  }

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

  /// Number of frames from `begin` on that one call should draw.
  std::size_t cameras_of_call(const Known& known, std::size_t begin, CopyKind to) const {
    const std::size_t left = known.jobs.size() - begin;
    std::size_t most = known.batch->capacity(
        sets_, std::span<const typename Batch::camera_type>(cameras_).subspan(begin));
    if (to == CopyKind::device_to_host) {
      const std::size_t bytes = sizeof(float) * known.kind.pixels() * channels_of(known.kind.images);
      most = std::min(most, kMostImageBytes / std::max(bytes, std::size_t{1}));
    }
    return std::clamp(most, std::size_t{1}, left);
  }

  /// Draws up to `count` frames from `begin` on: half of them, and so on, if there is not enough memory.
  /// Sets `count` to their number.
  Status draw_what_fits(Known& known, std::size_t begin, std::size_t& count,
                        std::span<const FrameJob<float>> jobs, std::span<RenderStats> stats, CopyKind to,
                        const std::function<void()>& idle) {
    while (true) {
      Status s = draw(known, begin, count, jobs, to, idle);
      if (s.ok()) break;
      if (s.code() != Errc::out_of_memory || count == 1) return s;
      known.batch = std::make_unique<Batch>(*backend_, known.kind.config);  // frees its arrays
      count = (count + 1) / 2;
    }
    for (const std::size_t j : std::span(known.jobs).subspan(begin, count)) {
      stats[j] = {};
      for (const GaussianSet& set : jobs[j].sets) stats[j].gaussians += set.gaussians.size();
      if constexpr (CountsWork<Batch>) {
        if (count != 1) continue;
        stats[j].tile_intersections = known.batch->stats().tile_intersections;
        stats[j].meshes = known.batch->stats().meshes;
      }
    }
    return {};
  }

  /// Draws the frames [begin, begin + count) of a group by one call. Call list_sets() first, which lists
  /// the group's sets and cameras.
  Status draw(Known& known, std::size_t begin, std::size_t count, std::span<const FrameJob<float>> jobs,
              CopyKind to, const std::function<void()>& idle) {
    const std::span<const std::size_t> which = std::span(known.jobs).subspan(begin, count);
    const std::size_t pixels = known.kind.pixels();
    const bool in_place = to == CopyKind::device_to_device && in_rows(which, jobs, pixels);
    typename Batch::images_type images;
    images.floats = jobs[which.front()].images;
    const auto hand_out = [&] {
      if (in_place) return;
      for (const ImageKind<float>& k : kImages<float>) {
        if (images.floats.*k.image != nullptr) copy(k, images.floats.*k.image, which, jobs, pixels, to);
      }
    };
    Status s = detail::guarded([&] {
      if (!in_place) {
        scratch_.resize_discard(channel_count(images.floats) * pixels * which.size());
        images.floats = images_in(scratch_.data(), images.floats, pixels * which.size());
      }
      return known.batch->render(sets_, std::span(cameras_).subspan(begin, count), images);
    });
    if (!s) return s;
    // Before the copies: those to memory that is not page-locked wait for the images.
    if (idle) idle();
    return detail::guarded([&]() -> Status {
      // The copies are enqueued before finish(), so that the device does not wait for the host. If
      // scratch had to grow, finish() has drawn the images again, and they are copied again.
      if constexpr (CountsReruns<Batch>) hand_out();
      if (Status finished = known.batch->finish(); !finished) return finished;
      if constexpr (CountsReruns<Batch>) {
        if (known.batch->stats().reruns == 0) return {};
      }
      hand_out();
      return {};
    });
  }

  /// Fills sets_ and cameras_ and the lists that the cameras refer to. A set that several frames share
  /// is listed once, and checked once.
  Status list_sets(std::span<const std::size_t> which, std::span<const FrameJob<float>> jobs) {
    sets_.clear();
    places_.clear();
    lists_.clear();
    seen_.clear();
    cameras_.clear();
    for (const std::size_t j : which) {
      for (const GaussianSet& set : jobs[j].sets) {
        if (set.gaussians.size() != 0 && !list(set)) continue;
        if (Status s = validate(set); !s) return s;
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
    return {};
  }
  std::size_t first_of(std::size_t camera) const noexcept { return camera == 0 ? 0 : ends_[camera - 1]; }

  /// Appends a set to the list of the last camera. The visible rows of a set are kept per camera, so
  /// that cameras can share the set. Returns whether no camera before had it.
  bool list(GaussianSet set) {
    const std::size_t before = sets_.size();
    seen_.push_back(set.selection.seen);
    set.selection.seen = {};
    lists_.push_back(place_of(set));
    return sets_.size() != before;
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
    const std::span of_camera = std::span(lists_).subspan(first_of(cameras_.size()));
    for (; at != end; ++at) {  // A camera that sees a set twice needs it twice.
      if (same(sets_[at->second], set) && std::ranges::find(of_camera, at->second) == of_camera.end())
        return at->second;
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
  std::uint64_t calls_ = 0;
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
