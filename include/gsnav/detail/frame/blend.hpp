// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/frame/blend_splat.hpp"
#include "gsnav/detail/frame/splat.hpp"
#include "gsnav/detail/image/mesh_layer.hpp"
#include "gsnav/detail/image/pixel_center.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// State of tiles that is kept between the slices of depth of one frame. A frame with meshes has one
/// slice.
template <class S>
struct TileProgress {
  View<std::uint64_t> open;  ///< [tiles], one bit per square of the tile in row order (OpenSquares), set
                             ///< if the square is open. 0 once the pixels are written. Empty: the frame
                             ///< has one slice.
  View<S> states;            ///< [tiles][blend_state_values * pixels of a tile]
  bool first = true, last = true;
};

/// Number of values per pixel that a slice passes to the next.
GSNAV_HD constexpr std::size_t blend_state_values(DepthMode mode) noexcept {
  const std::size_t bytes = mode == DepthMode::none     ? sizeof(BlendState<float, DepthMode::none>)
                            : mode == DepthMode::median ? sizeof(BlendState<float, DepthMode::median>)
                                                        : sizeof(BlendState<float, DepthMode::all>);
  return bytes / sizeof(float);
}

/// Range of a tile's splats in RasterArgs::tile_splats, front to back.
struct SplatRange {
  std::uint64_t begin, end;
};

/// Arguments of blending the tiles of one camera.
template <class S>
struct RasterArgs {
  TileGrid grid;
  View<const std::uint64_t> tile_offsets;  ///< [tiles + 1]
  View<const std::uint32_t> tile_splats;   ///< splats of each tile, front to back
  View<const SplatGeometry<S>> geometry;
  View<const SplatColor<S>> colors;              ///< empty: colour is not requested
  View<const SplatDepth<S>> depths;              ///< empty: no depth is requested
  View<const SplatPerspective<S>> perspectives;  ///< empty for Response::ewa
  BlendRules<S> rules;
  Vec3<S> background;
  Exp2 exp2_method = Exp2::degree5;
  FrameImages<S> images;
  TileProgress<S> progress;
  MeshLayer<S> mesh;  ///< Empty: no meshes. Frames with meshes are blended by
                      ///< detail/frame/composite.hpp.

  GSNAV_HD DepthMode depth_mode() const noexcept { return images.depth_mode(); }
  /// True if the response is not Response::ewa, or the stop is exclusive.
  bool general() const noexcept { return !perspectives.empty() || rules.exclusive_stop; }
  /// The splats of a tile. All walks over them start from it.
  GSNAV_HD SplatRange splats_of(std::size_t tile) const noexcept {
    return {tile_offsets[tile], tile_offsets[tile + 1]};
  }
  GSNAV_HD SplatRecords<S> records(std::size_t splat) const noexcept {
    return {geometry.data + splat, colors.empty() ? nullptr : colors.data + splat,
            depths.empty() ? nullptr : depths.data + splat,
            perspectives.empty() ? nullptr : perspectives.data + splat};
  }
};

/// Applies BlendRules::normalize_closed to a finished pixel, or to a pack of pixels: a closed pixel
/// becomes opaque, and its sums are divided by the alpha that it had.
template <class State, class S>
GSNAV_HD State finished(const BlendRules<S>& rules, State state) noexcept {
  if (!rules.normalize_closed) return state;
  using L = decltype(state.transmittance);
  const L one(S(1)), t = state.transmittance;
  const auto open = state.open(rules);
  const L scale = select(open, one, one / (one - t));
  state.r = state.r * scale;
  state.g = state.g * scale;
  state.b = state.b * scale;
  if constexpr (requires { state.accumulated; }) state.accumulated = state.accumulated * scale;
  state.transmittance = select(open, t, L(S(0)));
  return state;
}

/// Final colour of a pixel, or of a pack of pixels, over the background.
template <class S, class L>
GSNAV_HD Vec3<L> pixel_color(const RasterArgs<S>& args, const BlendColor<L>& state) noexcept {
  const L t = abs(state.transmittance);
  return {fma(t, L(args.background.x), state.r), fma(t, L(args.background.y), state.g),
          fma(t, L(args.background.z), state.b)};
}
template <class L>
GSNAV_HD L pixel_alpha(const BlendColor<L>& state) noexcept {
  return L(scalar_of<L>(1)) - abs(state.transmittance);
}
template <class S, class L>
GSNAV_HD L pixel_expected_depth(const RasterArgs<S>& args,
                                const BlendState<L, DepthMode::all>& state) noexcept {
  const L alpha = pixel_alpha(state), one(S(1)), zero(S(0));
  const auto returned = alpha > L(args.rules.return_alpha);
  return select(returned, state.accumulated / select(returned, alpha, one) + state.z_ref, zero);
}
template <class L>
GSNAV_HD L pixel_accumulated_depth(const BlendState<L, DepthMode::all>& state) noexcept {
  return fma(pixel_alpha(state), state.z_ref, state.accumulated);
}

/// Final value of a pixel, or of a pack of pixels, in the image O. A Vec3 for kRgb, else one number.
template <Output O, class S, class State>
GSNAV_HD auto pixel_value(const RasterArgs<S>& args, const State& state) noexcept {
  if constexpr (O == kRgb) {
    return pixel_color(args, state);
  } else if constexpr (O == kAlpha) {
    return pixel_alpha(state);
  } else if constexpr (O == kMedianDepth) {
    return state.median;
  } else if constexpr (O == kExpectedDepth) {
    return pixel_expected_depth(args, state);
  } else if constexpr (O == kAccumulatedDepth) {
    return pixel_accumulated_depth(state);
  } else {
    static_assert(O == kFirstHitDepth);
    return state.first_hit;
  }
}

/// Stores the colour of a pixel in an image with three values per pixel.
template <class S>
GSNAV_HD void store_color(S* image, std::size_t pixel, const Vec3<S>& value) noexcept {
  image[3 * pixel] = value.x;
  image[3 * pixel + 1] = value.y;
  image[3 * pixel + 2] = value.z;
}

/// Writes a finished pixel to all requested images.
/// @param store called with the colour, if it is requested, instead of store_color()
template <class S, DepthMode D, class Store>
GSNAV_HD void write_pixel(const RasterArgs<S>& args, std::size_t pixel, const BlendState<S, D>& blended,
                          const Store& store) noexcept {
  const BlendState<S, D> state = finished(args.rules, blended);
  for_each_image<D>(args.images, [&]<Output O>(S* image) GSNAV_INLINED {
    if (image == nullptr) return;
    if constexpr (O == kRgb) {
      store(pixel_value<O>(args, state));
    } else {
      image[pixel] = pixel_value<O>(args, state);
    }
  });
}
template <class S, DepthMode D>
GSNAV_HD void write_pixel(const RasterArgs<S>& args, std::size_t pixel,
                          const BlendState<S, D>& blended) noexcept {
  write_pixel(args, pixel, blended,
              [&](const Vec3<S>& color) GSNAV_INLINED { store_color(args.images.rgb, pixel, color); });
}

/// A pixel and the splats of its tile. Kernels with one work item per pixel start from it.
template <class S>
struct PixelWalk {
  S px, py;           ///< pixel centre
  SplatRange splats;  ///< of its tile

  GSNAV_HD PixelWalk(const RasterArgs<S>& args, std::size_t pixel) noexcept {
    const std::size_t width = static_cast<std::size_t>(args.grid.width);
    const int x = static_cast<int>(pixel % width), y = static_cast<int>(pixel / width);
    px = pixel_center<S>(x);
    py = pixel_center<S>(y);
    splats = args.splats_of(args.grid.tile_of(x, y));
  }

  /// Calls blend(records) for each splat of the list, front to back, until the pixel is closed.
  template <class State, class F>
  GSNAV_HD void for_each_splat(const RasterArgs<S>& args, const State& state,
                               const F& blend) const noexcept {
    for (std::uint64_t i = splats.begin; i < splats.end && state.open(args.rules); ++i) {
      blend(args.records(args.tile_splats[i]));
    }
  }
};

/// Generic kernel that blends one pixel per work item, on any backend and in any scalar.
template <class S, bool Color, DepthMode D, Exp2 M, bool General>
struct RasterizePixel {
  RasterArgs<S> args;

  GSNAV_HD void operator()(std::size_t pixel) const noexcept {
    const PixelWalk<S> walk(args, pixel);
    BlendState<S, D> state;
    walk.for_each_splat(args, state, [&](const SplatRecords<S>& splat) GSNAV_INLINED {
      blend_splat<Color, D, M, General>(state, args.rules, splat, walk.px, walk.py);
    });
    write_pixel(args, pixel, state);
  }
};

/// Calls f with the compile-time arguments <Color, DepthMode> that fit the images of `args`.
template <class S, class F>
void dispatch_images(const RasterArgs<S>& args, const F& f) {
  const auto with_depth = [&]<bool C>() {
    switch (args.depth_mode()) {
      case DepthMode::none:
        return f.template operator()<C, DepthMode::none>();
      case DepthMode::median:
        return f.template operator()<C, DepthMode::median>();
      case DepthMode::all:
        return f.template operator()<C, DepthMode::all>();
    }
  };
  args.images.rgb != nullptr ? with_depth.template operator()<true>()
                             : with_depth.template operator()<false>();
}

/// Calls f with the compile-time arguments <Color, DepthMode, Exp2, General> that fit `args`. General is
/// true for a response other than Response::ewa and for an exclusive stop. It excludes the cubic exp2.
template <class S, class F>
void dispatch_raster(const RasterArgs<S>& args, const F& f) {
  dispatch_images(args, [&]<bool C, DepthMode D>() {
    if (args.general()) {
      f.template operator()<C, D, Exp2::degree5, true>();
    } else if (std::is_same_v<S, float> && args.exp2_method == Exp2::degree3) {
      f.template operator()<C, D, Exp2::degree3, false>();
    } else {
      f.template operator()<C, D, Exp2::degree5, false>();
    }
  });
}

}  // namespace gsnav
