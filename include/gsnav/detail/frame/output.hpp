// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <iterator>
#include <utility>

#include "gsnav/frame/rules.hpp"

// What images of a frame have in common. A new image needs:
// - a bit of Output and a pointer in FrameImages (frame/rules.hpp), and a row of kImages here;
// - its value in pixel_value (detail/frame/blend.hpp), and the state for it in BlendState
//   (detail/frame/blend_splat.hpp);
// - a vector in Frames, and in kVectors in the order of kImages (render/frames.hpp);
// - if a pixel's value is known before the last Gaussian: the transmittance at which it is, in
//   blend_rules (detail/render/rules.hpp);
// - if it is not a depth: its rule in HardDepthPixel (detail/frame/composite.hpp);
// - for tests, its definition in the oracles (detail/eval/oracle_config.hpp, oracle_blend.hpp), and how
//   rays are joined into pixels (detail/eval/oracle_photo.hpp); the lists of images in tests/support
//   (frame_images.hpp, image_hashes.hpp, oracle.hpp) and tests/ops/cuda_batch_images.hpp;
// - for users: its array in bindings/python/src (frames.{hpp,cpp}, render_settings.cpp, eval.cpp), and
//   its file in tools/render/{options,main}.cpp.

namespace gsnav {

template <class S>
using ImagePointer = S* FrameImages<S>::*;

/// Description of one image: its bit, values per pixel, the DepthMode that it needs, and its member of
/// FrameImages. `sums` is true for a sum over all Gaussians of a pixel, which is complete only after the
/// last one.
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
    {kExpectedDepth, 1, DepthMode::all, true, &FrameImages<S>::expected_depth},
    {kAccumulatedDepth, 1, DepthMode::all, true, &FrameImages<S>::accumulated_depth},
    {kFirstHitDepth, 1, DepthMode::all, false, &FrameImages<S>::first_hit_depth},
};
inline constexpr std::size_t kImageCount = std::size(kImages<float>);
inline constexpr unsigned kAllOutputs = (1u << kImageCount) - 1;
inline constexpr unsigned kAnyDepth = kMedianDepth | kExpectedDepth | kAccumulatedDepth | kFirstHitDepth;

constexpr std::size_t channels_of(Output output) noexcept {
  std::size_t i = 0;
  while (kImages<float>[i].output != output) ++i;
  return kImages<float>[i].channels;
}

/// Number of values per pixel of all requested images.
template <class S>
std::size_t channel_count(const FrameImages<S>& images) noexcept {
  std::size_t n = 0;
  for (const ImageKind<S>& k : kImages<S>) n += images.*k.image != nullptr ? k.channels : 0;
  return n;
}

/// Images like those requested in `like`, stored one after the other from `memory` on, with `pixels`
/// pixels each.
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

/// Calls f.operator()<Output>(image) for each image that a blending state of mode D has values for.
/// `image` is null if it is not requested.
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
