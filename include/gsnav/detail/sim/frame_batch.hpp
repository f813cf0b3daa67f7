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

/// Draws many cameras in one call, each with sets of its own, into images in the backend's memory
/// (CudaBatchRenderer says what each member does). It is asked before a call what it supports and how
/// many cameras one call can draw, so that an error of `render` is one.
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

/// Those that say how often `finish` drew the last call again; images of the others are whole only after
/// `finish`.
template <class R>
concept CountsReruns = requires(const R& batch) {
  { batch.stats().reruns } -> std::convertible_to<int>;
};

/// Backends that have such a renderer.
template <class B>
concept BatchBackend = Backend<B> && !is_host_backend<B> && BatchRenderer<typename B::batch_renderer, B>;

/// Draws frames that share nothing by a backend's batched renderer: all frames of one size, rules and
/// images by one call, or by as few as it has the capacity for. The bits are those of BasicRenderer.
template <BatchBackend B>
class FrameBatch {
 public:
  explicit FrameBatch(B& backend) : backend_(&backend), scratch_(backend) {}

  /// Whether `render` can draw a frame.
  static bool supports(const FrameJob<float>& job) {
    return Batch::supports(*job.config, job.sets, job.meshes).ok();
  }

  /// Draws frames that are all supported; their images are in host memory or the backend's, as `to` has
  /// it. Errors: what rendering reports. Throws gsnav::Error (out_of_memory).
  Status render(std::span<const FrameJob<float>> jobs, CopyKind to) {
    for (Known& k : known_) k.jobs.clear();
    for (std::size_t j = 0; j < jobs.size(); ++j) group(kind_of(jobs[j])).jobs.push_back(j);
    for (Known& k : known_) {
      // By where images go, so that they can be drawn there, or copied, together.
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
        if (Status s = draw(k, begin, count, jobs, to); !s) return s;
      }
    }
    return backend_->synchronize();
  }

 private:
  using Batch = typename B::batch_renderer;

  /// What frames of one call have in common.
  struct Kind {
    RenderConfig config;
    int width = 0, height = 0;
    unsigned images = 0;  // Output
    bool meshes = false;  // among which `fast` has the exponential of `exact`
    bool operator==(const Kind&) const = default;
  };
  struct Known {
    Kind kind;
    std::unique_ptr<Batch> batch;
    std::vector<std::size_t> jobs;  // of the present call
  };

  static Kind kind_of(const FrameJob<float>& job) noexcept {
    Kind k{*job.config, job.camera->width, job.camera->height, 0, !job.meshes.instances.empty()};
    k.config.outputs = kRgb;  // pointers say which images
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

  /// Draws frames [begin, begin + count) of a group, whose sets and cameras are listed, by one call.
  Status draw(Known& known, std::size_t begin, std::size_t count, std::span<const FrameJob<float>> jobs,
              CopyKind to) {
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
    const auto hand_out = [&] {
      if (in_place) return;
      for (const ImageKind<float>& k : kImages<float>) {
        if (images.floats.*k.image != nullptr) copy(k, images.floats.*k.image, which, jobs, pixels, to);
      }
    };
    // At once, so that nothing waits for the host in between; once more where scratch had to grow.
    if constexpr (CountsReruns<Batch>) hand_out();
    if (Status s = known.batch->finish(); !s) return s;
    if constexpr (CountsReruns<Batch>) {
      if (known.batch->stats().reruns == 0) return {};
    }
    hand_out();
    return {};
  }

  /// Fills sets_ and cameras_. A set that many look at, a scene's, is listed once.
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
      // A list of no sets stands for all of them.
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

  /// Appends to a camera's list: what it sees of the set is its own, the set is all cameras'.
  void list(GaussianSet set) {
    seen_.push_back(set.selection.seen);
    set.selection.seen = {};
    lists_.push_back(place_of(set));
  }
  std::uint32_t place_of(const GaussianSet& set) {
    // All of it, bit for bit: where padding differs a set is listed twice, and no image changes.
    const auto same = [](const GaussianSet& a, const GaussianSet& b) {
      return std::memcmp(&a, &b, sizeof a) == 0;
    };
    auto [at, end] = places_.equal_range(set.gaussians.shape.means.data[0]);
    for (; at != end; ++at) {
      if (same(sets_[at->second], set)) return at->second;
    }
    const auto place = static_cast<std::uint32_t>(sets_.size());
    sets_.push_back(set);
    places_.emplace(set.gaussians.shape.means.data[0], place);
    return place;
  }

  /// Whether all images lie one behind the other, so that a batch may be drawn where they are.
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
  // Of the present group.
  std::vector<GaussianSet> sets_;
  std::unordered_multimap<const float*, std::uint32_t> places_;  // in sets_, by their means
  std::vector<std::uint32_t> lists_;
  std::vector<View<const std::uint32_t>> seen_;  // of each in these lists
  std::vector<std::size_t> ends_;
  std::vector<typename Batch::camera_type> cameras_;
};

}  // namespace gsnav
