// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <iterator>
#include <utility>

#include "gsnav/math/functions.hpp"

// The images of a frame. A new one is
// - here: a bit of Output, a pointer in FrameImages and a row of kImages;
// - its value in pixel_value (detail/frame/blend.hpp), and what that needs in BlendState
//   (detail/frame/blend_splat.hpp);
// - a vector in Frames, in kVectors too, in the order of kImages (render/frames.hpp);
// - where a pixel has it before the last Gaussian: the transmittance at which, in blend_rules
//   (detail/render/rules.hpp);
// - where it is no depth: its rule in HardDepthPixel (detail/frame/composite.hpp);
// - for tests, its truth in the oracles (detail/eval/oracle_config.hpp, oracle_blend.hpp).

namespace gsnav {

/// Images a render may produce; combine with |. Nothing that is not asked for is computed.
enum Output : unsigned {
  kRgb = 1u << 0,               ///< [H][W][3], unclamped, over the background
  kAlpha = 1u << 1,             ///< [H][W], 1 - transmittance
  kMedianDepth = 1u << 2,       ///< [H][W] metres, where transmittance crosses 1/2; 0: no return
  kExpectedDepth = 1u << 3,     ///< [H][W] metres, sum(w z) / sum(w); 0 where sum(w) = 0
  kAccumulatedDepth = 1u << 4,  ///< [H][W] metres, sum(w z)
  kFirstHitDepth = 1u << 5,     ///< [H][W] metres, where alpha first reaches first_hit_tau; 0: never
};

/// What a compiled blend loop keeps of depth; less is cheaper.
enum class DepthMode { none, median, any };

/// Images of one camera; a null pointer is an image not asked for.
template <class S>
struct FrameImages {
  S* rgb = nullptr;
  S* alpha = nullptr;
  S* median_depth = nullptr;
  S* expected_depth = nullptr;
  S* accumulated_depth = nullptr;
  S* first_hit_depth = nullptr;

  GSNAV_HD DepthMode depth_mode() const noexcept;
  bool operator==(const FrameImages&) const = default;
};

template <class S>
using ImagePointer = S* FrameImages<S>::*;

/// One image: values a pixel, the mode that a blend loop needs for it, and whether it is a sum over all
/// Gaussians of a pixel, so that the pixel is not done before the last of them.
template <class S>
struct ImageKind {
  Output output;
  std::size_t channels;
  DepthMode mode;
  bool sums;
  ImagePointer<S> image;
};
template <class S>
inline constexpr ImageKind<S> kImages[] = {
    {kRgb, 3, DepthMode::none, true, &FrameImages<S>::rgb},
    {kAlpha, 1, DepthMode::none, true, &FrameImages<S>::alpha},
    {kMedianDepth, 1, DepthMode::median, false, &FrameImages<S>::median_depth},
    {kExpectedDepth, 1, DepthMode::any, true, &FrameImages<S>::expected_depth},
    {kAccumulatedDepth, 1, DepthMode::any, true, &FrameImages<S>::accumulated_depth},
    {kFirstHitDepth, 1, DepthMode::any, false, &FrameImages<S>::first_hit_depth},
};
inline constexpr std::size_t kImageCount = std::size(kImages<float>);
inline constexpr unsigned kAllOutputs = (1u << kImageCount) - 1;
inline constexpr unsigned kAnyDepth = kAllOutputs & ~(kRgb | kAlpha);

constexpr std::size_t channels_of(Output output) noexcept {
  std::size_t i = 0;
  while (kImages<float>[i].output != output) ++i;
  return kImages<float>[i].channels;
}

/// Values a pixel of all images that there are.
template <class S>
std::size_t channel_count(const FrameImages<S>& images) noexcept {
  std::size_t n = 0;
  for (const ImageKind<S>& k : kImages<S>) n += images.*k.image != nullptr ? k.channels : 0;
  return n;
}

/// The same images as `like` has, one behind the other from `memory` on, of `pixels` pixels each.
template <class S>
FrameImages<S> images_in(S* memory, const FrameImages<S>& like, std::size_t pixels) noexcept {
  FrameImages<S> images;
  for (const ImageKind<S>& k : kImages<S>) {
    if (like.*k.image == nullptr) continue;
    images.*k.image = memory;
    memory += k.channels * pixels;
  }
  return images;
}

/// Calls f.operator()<Output>(image) for each image that a state of mode D has values for: null where it
/// was not asked for.
template <DepthMode D, class S, class F>
GSNAV_HD void for_each_image(const FrameImages<S>& images, const F& f) noexcept {
  const auto call = [&]<std::size_t I>() GSNAV_INLINED {
    constexpr ImageKind<S> kKind = kImages<S>[I];
    if constexpr (kKind.mode <= D) f.template operator()<kKind.output>(images.*kKind.image);
  };
  const auto call_all = [&]<std::size_t... I>(std::index_sequence<I...>) GSNAV_INLINED {
    (call.template operator()<I>(), ...);
  };
  call_all(std::make_index_sequence<kImageCount>());
}

template <class S>
GSNAV_HD DepthMode FrameImages<S>::depth_mode() const noexcept {
  DepthMode mode = DepthMode::none;
  const auto take = [&]<std::size_t I>() GSNAV_INLINED {
    constexpr ImageKind<S> kKind = kImages<S>[I];
    if (this->*kKind.image != nullptr && mode < kKind.mode) mode = kKind.mode;
  };
  [&]<std::size_t... I>(std::index_sequence<I...>) GSNAV_INLINED {
    (take.template operator()<I>(), ...);
  }
  (std::make_index_sequence<kImageCount>());
  return mode;
}

}  // namespace gsnav
