// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/render/render_composite.hpp"
#include "gsnav/detail/sim/semantic.hpp"

namespace gsnav {

/// What a pixel shows, by weight: a set of Gaussians or a mesh among them.
struct SemanticFrame {
  /// [H][W] of one camera: 0 where all together cover less than half of the pixel, else of what has most
  /// of it 1 + the index of the set, or 1 + the number of sets + the index of the mesh instance. Of
  /// equals the first counts.
  std::vector<std::uint32_t> labels;
  std::vector<float> weights;  ///< [H][W], how much of the pixel that is; 0 where the label is
};

/// Draws semantic ids of frames in which meshes stand among Gaussians: three sets to a render, all sets
/// and meshes at their places in each, so that the weights are those with which the colours of the same
/// frame were blended. Ids are never mixed.
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

  /// Sets and meshes as for render_composite, arrays in the backend's memory. Errors: those of
  /// render_composite.
  Status render(std::span<const GaussianSet> sets, std::span<const MeshInstance> meshes,
                const Camera& camera, const RenderConfig& config, SemanticFrame& out) {
    if (Status s = validate(camera); !s) return s;
    if (Status s = validate(config); !s) return s;
    const std::size_t pixels =
        static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    std::size_t most = 0;
    for (const GaussianSet& set : sets) {
      if (Status s = validate(set); !s) return s;
      most = std::max(most, set.gaussians.size());
    }
    passes_.reserve(most);
    rgb_.resize_discard(3 * pixels);
    alpha_.resize_discard(pixels);

    // Black and unlit: what an opaque mesh has of a pixel is what the others leave of its alpha. Those
    // that are seen through are passed like sets, behind them.
    std::vector<MeshInstance> black(meshes.begin(), meshes.end());
    for (std::size_t i = 0; i < black.size(); ++i) {
      if (Status s = validate(black[i]); !s) return s;
      black[i].id = static_cast<std::uint32_t>(i);
      black[i].mesh.base_color_only = true;
      black[i].mesh.base_color = {0, 0, 0};
      black[i].mesh.unlit = true;
    }
    host_instance_.assign(pixels, kNoInstance);
    if (!black.empty()) {
      instance_.resize_discard(pixels);
      const int tile_size = tile_size_of<B>(config, camera.width, camera.height);
      if (Status s = draw_meshes<S>(*backend_, workspace_.mesh, black, camera, {}, tile_size, false,
                                    {nullptr, nullptr, instance_.data(), nullptr});
          !s) {
        return s;
      }
      if (Status s = backend_->synchronize(); !s) return s;
      instance_.download(host_instance_.data(), pixels);
    }

    RenderConfig plain = config;
    plain.background = {};
    out.labels.assign(pixels, 0);
    out.weights.assign(pixels, 0.0f);
    covered_.assign(pixels, S(0));
    host_alpha_.resize(pixels);
    host_rgb_.resize(3 * pixels);
    std::vector<std::size_t> through;
    for (std::size_t i = 0; i < black.size(); ++i) {
      if (black[i].mesh.alpha_mode == MeshAlpha::blend) through.push_back(i);
    }
    const std::size_t things = sets.size() + through.size();
    const std::size_t passes = SemanticPasses<B>::count(things);
    for (std::size_t pass = 0; pass < (passes > 0 ? passes : 1); ++pass) {
      const std::vector<GaussianSet> colored = passes_.recolored(sets, pass);
      for (std::size_t i = 0; i < through.size(); ++i) {
        const std::size_t thing = sets.size() + i, channel = thing % kChannels;
        Vec3f& color = black[through[i]].mesh.base_color;
        color = {};
        if (thing / kChannels == pass) color[static_cast<int>(channel)] = 1;
      }
      FrameImages<S> images;
      images.rgb = rgb_.data();
      images.alpha = alpha_.data();
      if (Status s = render_composite<S>(*backend_, workspace_, std::span<const GaussianSet>(colored),
                                         {black, {}}, camera, plain, images);
          !s) {
        return s;
      }
      if (Status s = backend_->synchronize(); !s) return s;
      rgb_.download(host_rgb_.data(), 3 * pixels);
      alpha_.download(host_alpha_.data(), pixels);
      const std::size_t first = pass * kChannels;
      for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t k = 0; k < kChannels && first + k < things; ++k) {
          const std::size_t thing = first + k, n = sets.size();
          take(out, p, 1 + (thing < n ? thing : n + through[thing - n]), host_rgb_[3 * p + k]);
        }
      }
    }
    for (std::size_t p = 0; p < pixels; ++p) {
      // Alpha is 1 where there is a mesh: it closes the pixel.
      const S rest = host_alpha_[p] - covered_[p];
      if (host_instance_[p] != kNoInstance && rest > S(0))
        take(out, p, 1 + sets.size() + host_instance_[p], rest);
      if (covered_[p] < S(0.5)) out.labels[p] = 0, out.weights[p] = 0.0f;
    }
    return {};
  }

 private:
  static constexpr std::size_t kChannels = SemanticPasses<B>::kChannels;

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
  std::vector<std::uint32_t> host_instance_;
  std::vector<S> host_rgb_, host_alpha_, covered_;
};

}  // namespace gsnav
