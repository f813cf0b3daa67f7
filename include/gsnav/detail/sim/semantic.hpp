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

namespace gsnav {

/// Which set of Gaussians, or which of a scene's meshes, a pixel shows: each is rendered white in one
/// channel, three to a render, and black in the others, so that a channel is how much of the pixel it
/// is. Exact: the same list, order and alphas as in colour. Meshes are numbered behind the sets, by
/// MeshInstance::id.
template <Backend B>
class SemanticPasses {
 public:
  static constexpr std::size_t kChannels = 3;

  explicit SemanticPasses(B& backend)
      : shades_{Floats(backend), Floats(backend), Floats(backend), Floats(backend)} {}

  /// Passes for so many sets and meshes.
  static std::size_t count(std::size_t things) noexcept { return (things + kChannels - 1) / kChannels; }

  /// Makes room for sets of so many Gaussians; what recolored() returned before is then void.
  void reserve(std::size_t gaussians) {
    if (gaussians <= size_) return;
    size_ = gaussians;
    std::vector<float> host(kChannels * size_);
    for (std::size_t shade = 0; shade <= kChannels; ++shade) {
      for (std::size_t i = 0; i < host.size(); ++i) host[i] = i % kChannels == shade ? kWhite : -kWhite;
      shades_[shade].upload(host.data(), host.size());
    }
  }

  /// The sets as pass `pass` draws them; they point into this object.
  std::vector<GaussianSet> recolored(std::span<const GaussianSet> sets, std::size_t pass) const {
    std::vector<GaussianSet> out(sets.begin(), sets.end());
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t channel = i / kChannels == pass ? i % kChannels : kChannels;
      GaussianRows& g = out[i].gaussians;
      g.color = {};
      // 0 and 1 are the same in every colour space.
      g.color.sh0 = {shades_[channel].data(), kChannels * g.size()};
    }
    return out;
  }

  /// The meshes as pass `pass` draws them, where there are so many sets.
  static std::vector<MeshInstance> recolored(std::span<const MeshInstance> meshes, std::size_t sets,
                                             std::size_t pass) {
    std::vector<MeshInstance> out(meshes.begin(), meshes.end());
    for (MeshInstance& m : out) {
      const std::size_t thing = sets + m.id,
                        channel = thing / kChannels == pass ? thing % kChannels : kChannels;
      m.mesh.base_color_only = true;  // holes and what is seen through stay
      m.mesh.unlit = true;
      m.mesh.base_color = {channel == 0 ? 1.0f : 0.0f, channel == 1 ? 1.0f : 0.0f,
                           channel == 2 ? 1.0f : 0.0f};
    }
    return out;
  }

 private:
  using Floats = Buffer<float, B>;
  static constexpr float kWhite =
      0.5f / 0.28209479177387814f;            // the coefficient whose colour is 1; its negative, 0
  std::array<Floats, kChannels + 1> shades_;  // red, green, blue, black
  std::size_t size_ = 0;
};

/// One plus the set or mesh with the largest share in each pixel, 0 where all together cover less than
/// half of it. `shares[p]` is pass p's image, [pixels][3]; of equal sets the first counts.
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
