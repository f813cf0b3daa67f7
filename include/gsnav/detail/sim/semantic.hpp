// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/mesh/mesh.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/frame/sh.hpp"

namespace gsnav {

/// Render passes for a semantic image: each shows which sets and meshes cover a pixel. A pass draws
/// three of them white in one colour channel each, and everything else black. A channel then is the
/// fraction of the pixel that its object covers. It is exact, because sorting and alphas are those of
/// the colour image. Meshes are numbered after the sets, by MeshInstance::id.
template <Backend B>
class SemanticPasses {
 public:
  /// Objects per pass.
  static constexpr std::size_t kChannels = 3;

  explicit SemanticPasses(B& backend)
      : shades_{Floats(backend), Floats(backend), Floats(backend), Floats(backend)} {}

  /// Number of passes for a number of sets and meshes.
  static std::size_t count(std::size_t things) noexcept { return (things + kChannels - 1) / kChannels; }

  /// Allocates for sets of up to `gaussians` Gaussians. Invalidates earlier results of recolored().
  void reserve(std::size_t gaussians) {
    if (gaussians <= size_) return;
    size_ = gaussians;
    std::vector<float> host(kChannels * size_);
    for (std::size_t shade = 0; shade <= kChannels; ++shade) {
      for (std::size_t i = 0; i < host.size(); ++i) host[i] = i % kChannels == shade ? kWhite : -kWhite;
      shades_[shade].upload(host.data(), host.size());
    }
  }

  /// Copies of the sets in the colours of a pass: one red, one green, one blue, the others black. Their
  /// colours point into this object.
  std::vector<GaussianSet> recolored(std::span<const GaussianSet> sets, std::size_t pass) const {
    std::vector<GaussianSet> out(sets.begin(), sets.end());
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t channel = i / kChannels == pass ? i % kChannels : kChannels;
      GaussianRows& g = out[i].gaussians;
      g.color = {};
      // 0 and 1 have the same value in every colour space.
      g.color.sh0 = {shades_[channel].data(), kChannels * g.size()};
    }
    return out;
  }

  /// Copies of the meshes in the colours of a pass. A mesh with id m is coloured as set number `sets` +
  /// m would be.
  static std::vector<MeshInstance> recolored(std::span<const MeshInstance> meshes, std::size_t sets,
                                             std::size_t pass) {
    std::vector<MeshInstance> out(meshes.begin(), meshes.end());
    for (MeshInstance& m : out) {
      const std::size_t thing = sets + m.id,
                        channel = thing / kChannels == pass ? thing % kChannels : kChannels;
      m.mesh.base_color_only = true;  // Keep cut-outs and transparency.
      m.mesh.unlit = true;
      m.mesh.base_color = {channel == 0 ? 1.0f : 0.0f, channel == 1 ? 1.0f : 0.0f,
                           channel == 2 ? 1.0f : 0.0f};
    }
    return out;
  }

 private:
  using Floats = Buffer<float, B>;
  // SH coefficient of colour 1. Its negative gives 0.
  static constexpr float kWhite = 0.5f / static_cast<float>(kSh0);
  std::array<Floats, kChannels + 1> shades_;  // Red, green, blue, black.
  std::size_t size_ = 0;
};

/// Writes the label of each pixel: 1 + the index of the set or mesh that covers most of it, or 0 if all
/// together cover less than half. The first of equal shares wins.
/// @param shares shares[p] is the image of pass p, shape [pixels][3].
/// @param things Number of sets and meshes.
inline void label_pixels(std::span<const std::vector<float>> shares, std::size_t things,
                         std::span<float> labels) noexcept {
  for (std::size_t i = 0; i < labels.size(); ++i) {
    float sum = 0.0f, most = 0.0f;
    std::size_t best = 0;
    for (std::size_t s = 0; s < things; ++s) {
      const float share = shares[s / 3][3 * i + s % 3];
      sum += share;
      if (share > most) {
        most = share;
        best = s + 1;
      }
    }
    labels[i] = sum < 0.5f ? 0.0f : static_cast<float>(best);
  }
}

}  // namespace gsnav
