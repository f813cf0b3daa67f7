// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/render/draw_frame.hpp"
#include "gsnav/detail/sim/semantic.hpp"

namespace gsnav {

/// Semantic image of one camera: which set of Gaussians or mesh covers most of each pixel.
struct SemanticFrame {
  /// Shape [height][width]. 0 if sets and meshes together cover less than half of the pixel. Otherwise
  /// the object that covers most of it: 1 + the index of the set, or 1 + the number of sets + the index
  /// of the mesh instance. The first of equal shares wins.
  std::vector<std::uint32_t> labels;
  std::vector<float> weights;  ///< Shape [height][width]. Fraction of the pixel that the object covers,
                               ///< 0 if the label is 0.
};

/// Renders semantic images of meshes among Gaussians. Each pass measures three sets: the first is drawn
/// in pure red, the second in green, the third in blue, and all others in black. Each colour channel of
/// the result is then the share of its set in a pixel, with the weights that the image blends by. Labels
/// are never interpolated.
template <class S, Backend B>
class SemanticFrames {
 public:
  explicit SemanticFrames(B& backend)
      : backend_(&backend),
        passes_(backend),
        workspace_(backend),
        rgb_(backend),
        alpha_(backend),
        instance_(backend) {}

  /// Renders the labels of one camera. Sets and meshes are those of draw_frame, with arrays in the
  /// backend's memory.
  /// @return the errors of draw_frame.
  Status render(std::span<const GaussianSet> sets, std::span<const MeshInstance> meshes,
                const Camera& camera, const RenderConfig& config, SemanticFrame& out) {
    if (Status s = validate(camera); !s) return s;
    if (Status s = validate(config); !s) return s;
    if (Status s = reserve(sets, camera, out); !s) return s;
    if (Status s = blacken(meshes); !s) return s;
    if (Status s = find_nearest_meshes(camera, config); !s) return s;
    const std::size_t passes = SemanticPasses<B>::count(sets.size() + through_.size());
    for (std::size_t pass = 0; pass < (passes > 0 ? passes : 1); ++pass) {
      if (Status s = draw_pass(sets, camera, config, pass); !s) return s;
      take_pass(sets.size(), pass, out);
    }
    take_nearest_meshes(sets.size(), out);
    return {};
  }

 private:
  static constexpr std::size_t kChannels = SemanticPasses<B>::kChannels;

  Status reserve(std::span<const GaussianSet> sets, const Camera& camera, SemanticFrame& out) {
    pixels_ = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    std::size_t most = 0;
    for (const GaussianSet& set : sets) {
      if (Status s = validate(set); !s) return s;
      most = std::max(most, set.gaussians.size());
    }
    passes_.reserve(most);
    rgb_.resize_discard(3 * pixels_);
    alpha_.resize_discard(pixels_);
    host_alpha_.resize(pixels_);
    host_rgb_.resize(3 * pixels_);
    covered_.assign(pixels_, S(0));
    out.labels.assign(pixels_, 0);
    out.weights.assign(pixels_, 0.0f);
    return {};
  }

  /// Makes all meshes black and unlit. An opaque mesh gets the part of the pixel's alpha that the other
  /// objects leave. Transparent meshes are marked in passes, after the sets.
  Status blacken(std::span<const MeshInstance> meshes) {
    black_.assign(meshes.begin(), meshes.end());
    through_.clear();
    for (std::size_t i = 0; i < black_.size(); ++i) {
      if (Status s = validate(black_[i]); !s) return s;
      black_[i].id = static_cast<std::uint32_t>(i);
      black_[i].mesh.base_color_only = true;
      black_[i].mesh.base_color = {0, 0, 0};
      black_[i].mesh.unlit = true;
      if (black_[i].mesh.alpha_mode == MeshAlpha::blend) through_.push_back(i);
    }
    return {};
  }

  Status find_nearest_meshes(const Camera& camera, const RenderConfig& config) {
    host_instance_.assign(pixels_, kNoInstance);
    if (black_.empty()) return {};
    instance_.resize_discard(pixels_);
    const int tile_size = tile_size_of<B>(config, camera.width, camera.height);
    if (Status s = draw_meshes<S>(*backend_, workspace_.mesh, black_, camera, {}, tile_size, false,
                                  {nullptr, nullptr, instance_.data(), nullptr});
        !s) {
      return s;
    }
    if (Status s = backend_->synchronize(); !s) return s;
    instance_.download(host_instance_.data(), pixels_);
    return {};
  }

  /// Renders with the objects of pass `pass` marked, on a black background.
  Status draw_pass(std::span<const GaussianSet> sets, const Camera& camera, const RenderConfig& config,
                   std::size_t pass) {
    RenderConfig plain = config;
    plain.background = {};
    const std::vector<GaussianSet> colored = passes_.recolored(sets, pass);
    for (std::size_t i = 0; i < through_.size(); ++i) {
      const std::size_t thing = sets.size() + i;
      Vec3f& color = black_[through_[i]].mesh.base_color;
      color = {};
      if (thing / kChannels == pass) color[static_cast<int>(thing % kChannels)] = 1;
    }
    FrameImages<S> images;
    images.rgb = rgb_.data();
    images.alpha = alpha_.data();
    if (Status s = draw_frame<S>(*backend_, workspace_, std::span<const GaussianSet>(colored),
                                 {black_, {}}, camera, plain, images);
        !s) {
      return s;
    }
    if (Status s = backend_->synchronize(); !s) return s;
    rgb_.download(host_rgb_.data(), 3 * pixels_);
    alpha_.download(host_alpha_.data(), pixels_);
    return {};
  }

  void take_pass(std::size_t sets, std::size_t pass, SemanticFrame& out) {
    const std::size_t first = pass * kChannels, things = sets + through_.size();
    for (std::size_t p = 0; p < pixels_; ++p) {
      for (std::size_t k = 0; k < kChannels && first + k < things; ++k) {
        const std::size_t thing = first + k;
        take(out, p, 1 + (thing < sets ? thing : sets + through_[thing - sets]), host_rgb_[3 * p + k]);
      }
    }
  }

  /// Adds opaque meshes. An opaque mesh closes its pixels, so their alpha is 1.
  void take_nearest_meshes(std::size_t sets, SemanticFrame& out) {
    for (std::size_t p = 0; p < pixels_; ++p) {
      const S rest = host_alpha_[p] - covered_[p];
      if (host_instance_[p] != kNoInstance && rest > S(0))
        take(out, p, 1 + sets + host_instance_[p], rest);
      if (covered_[p] < S(0.5)) out.labels[p] = 0, out.weights[p] = 0.0f;
    }
  }

  void take(SemanticFrame& out, std::size_t pixel, std::size_t label, S weight) {
    covered_[pixel] += weight;
    if (!(static_cast<float>(weight) > out.weights[pixel])) return;
    out.weights[pixel] = static_cast<float>(weight);
    out.labels[pixel] = static_cast<std::uint32_t>(label);
  }

  B* backend_;
  SemanticPasses<B> passes_;
  RenderWorkspace<S, B> workspace_;
  Buffer<S, B> rgb_, alpha_;
  Buffer<std::uint32_t, B> instance_;
  std::size_t pixels_ = 0;
  std::vector<MeshInstance> black_;
  std::vector<std::size_t> through_;  ///< Indices of transparent meshes.
  std::vector<std::uint32_t> host_instance_;
  std::vector<S> host_rgb_, host_alpha_, covered_;
};

}  // namespace gsnav
