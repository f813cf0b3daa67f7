// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/tiles.hpp"
#include "gsnav/detail/image/mesh_layer.hpp"

// Composites Gaussians and meshes (docs/reference/composition.md). Frames without a mesh do not run this
// code.

namespace gsnav {

/// The exponential of frames with meshes and of the Gaussians before fragments: never the cubic one.
inline constexpr Exp2 kMeshExp2 = Exp2::degree5;

/// Returns alpha where a splat lies in front of the mesh at depth `mesh`, and 0 where it lies behind.
/// The exact depth is computed only if the splat's reach spans the mesh: its depth along any ray is
/// within the reach, rounding included.
template <class L, class S>
GSNAV_HD L alpha_before_mesh(L alpha, const SplatDepth<S>& depth, L mesh, L px, L py) noexcept {
  const auto unsure = may_reach_behind(L(farthest_depth(depth)), mesh);
  if (!any(unsure)) return alpha;
  return select(unsure && behind(ray_depth(depth, px, py), mesh), L(S(0)), alpha);
}

/// Blends a mesh surface at depth z metres, also where the pixel is closed for Gaussians. Alpha 0 means
/// no surface, and z must still be finite. With alpha 1 the transmittance becomes 0.
template <bool Color, class L, DepthMode D, class S>
GSNAV_HD void blend_surface(BlendState<L, D>& state, const BlendRules<S>& rules, L alpha, L z,
                            const Vec3<L>& color) noexcept {
  const L before = abs(state.transmittance), weight = alpha * before, after = before - weight;
  state.template accumulate<Color>(
      TransmittanceStep<L>{before, after, weight}, rules.first_hit_tau,
      [&]() GSNAV_INLINED { return color; }, [&]() GSNAV_INLINED { return z; });
  state.transmittance = select(state.transmittance < L(S(0)), -after, after);
}

/// Blends the opaque mesh with the remaining transmittance.
template <bool Color, class L, DepthMode D, class S>
GSNAV_HD void close_by_mesh(BlendState<L, D>& state, const BlendRules<S>& rules, L depth,
                            const Vec3<L>& color) noexcept {
  const auto covered = has_mesh(depth);
  const L zero(S(0));
  blend_surface<Color>(state, rules, select(covered, L(S(1)), zero), select(covered, depth, zero),
                       color);
}

/// Blends the opaque mesh with the layer's depth and colour at a pixel.
template <bool Color, DepthMode D, class S>
GSNAV_HD void close_by_mesh(BlendState<S, D>& state, const BlendRules<S>& rules,
                            const MeshLayer<S>& mesh, std::size_t pixel) noexcept {
  Vec3<S> color{};
  if constexpr (Color) {
    const S* const from = mesh.color + 3 * pixel;
    color = {from[0], from[1], from[2]};
  }
  close_by_mesh<Color>(state, rules, mesh.depth[pixel], color);
}

/// blend_splat in front of a mesh at depth `mesh`.
template <bool Color, DepthMode D, Exp2 M, bool General, class S>
GSNAV_HD void composite_splat(BlendState<S, D>& state, const BlendRules<S>& rules,
                              const SplatRecords<S>& splat, S mesh, S px, S py) noexcept {
  blend_splat<Color, D, M, General>(state, rules, splat, px, py, [&](S alpha) GSNAV_INLINED {
    return alpha_before_mesh(alpha, *splat.depth, mesh, px, py);
  });
}

/// Kernel that blends one pixel of a frame with a mesh. Equals RasterizePixel, except that the mesh
/// hides the splats behind it.
template <class S, bool Color, DepthMode D, bool General>
struct CompositePixel {
  RasterArgs<S> args;

  GSNAV_HD void operator()(std::size_t pixel) const noexcept {
    const PixelWalk<S> walk(args, pixel);
    const S mesh = args.mesh.depth[pixel];
    BlendState<S, D> state;
    walk.for_each_splat(args, state, [&](const SplatRecords<S>& splat) GSNAV_INLINED {
      composite_splat<Color, D, kMeshExp2, General>(state, args.rules, splat, mesh, walk.px, walk.py);
    });
    close_by_mesh<Color>(state, args.rules, args.mesh, pixel);
    write_pixel(args, pixel, state);
  }
};

/// Kernel that blends a pixel with fragments. The fragments divide its ray into intervals of depth. For
/// each interval the tile's list is walked once, as if a mesh lay at the far end of the interval. Splats
/// with a depth in the interval are blended.
template <class S, bool Color, DepthMode D, bool General>
struct FragmentPixel {
  RasterArgs<S> args;

  GSNAV_HD void operator()(std::size_t pixel) const noexcept {
    const FragmentRange range = args.mesh.ranges[pixel];
    if (range.count == 0) return;
    const PixelWalk<S> walk(args, pixel);
    BlendState<S, D> state;
    S near = S(-3.4e38);
    for (std::uint32_t k = 0;; ++k) {
      const MeshFragment<S>* const f =
          k < range.count ? args.mesh.fragments.data + range.begin + k : nullptr;
      const S far = f != nullptr ? f->depth : args.mesh.depth[pixel];
      // Also in the last interval: splats were binned against the opaque mesh.
      walk.for_each_splat(args, state, [&](const SplatRecords<S>& splat) GSNAV_INLINED {
        blend_within(state, splat, near, far, walk.px, walk.py);
      });
      if (f == nullptr) break;
      blend_surface<Color>(state, args.rules, f->alpha, f->depth, Vec3<S>{f->r, f->g, f->b});
      near = far;
    }
    close_by_mesh<Color>(state, args.rules, args.mesh, pixel);
    write_pixel(args, pixel, state);
  }

 private:
  /// Blends a splat where its depth is in (near, far].
  GSNAV_HD void blend_within(BlendState<S, D>& state, const SplatRecords<S>& splat, S near, S far, S px,
                             S py) const noexcept {
    const SplatDepth<S>& depth = *splat.depth;
    if (behind(depth, far) || !may_reach_behind(farthest_depth(depth), near)) return;
    blend_splat<Color, D, kMeshExp2, General>(state, args.rules, splat, px, py,
                                              [&](S alpha) GSNAV_INLINED {
                                                const S z = ray_depth(depth, px, py);
                                                return behind(z, far) || !behind(z, near) ? S(0) : alpha;
                                              });
  }
};

/// dispatch_raster for frames with a mesh: calls f with the compile-time arguments <Color, DepthMode,
/// General>. These frames never use the cubic exp2.
template <class S, class F>
void dispatch_composite(const RasterArgs<S>& args, const F& f) {
  dispatch_images(args, [&]<bool C, DepthMode D>() {
    args.general() ? f.template operator()<C, D, true>() : f.template operator()<C, D, false>();
  });
}

/// The images of the Gaussians alone that Composite::hard_depth reads: those of the caller, and where it
/// asks for no alpha or no expected depth, planes of `scratch`.
/// @param scratch [2 * pixels]
template <class S>
FrameImages<S> images_before_mesh(FrameImages<S> images, S* scratch, std::size_t pixels) noexcept {
  if (images.alpha == nullptr) images.alpha = scratch;
  if (images.expected_depth == nullptr) images.expected_depth = scratch + pixels;
  return images;
}

/// Kernel of Composite::hard_depth. Converts the images of the Gaussians alone, rendered over black, to
/// the images of the frame.
template <class S>
struct HardDepthPixel {
  FrameImages<S> images;     ///< requested images, filled with the Gaussians
  const S* alpha = nullptr;  ///< alpha of the Gaussians
  const S* expected = nullptr;
  MeshLayer<S> mesh;
  Vec3<S> background{};

  GSNAV_HD void operator()(std::size_t pixel) const noexcept {
    const S a = alpha[pixel], z = mesh.depth[pixel], d = expected[pixel];
    const bool covered = has_mesh(z), dropped = !(a > S(kHabitatReturnAlpha)),
               lost = dropped || (covered && d > z);
    const S t = lost ? S(1) : S(1) - a;
    for_each_image<DepthMode::all>(images, [&]<Output O>(S* image) GSNAV_INLINED {
      if (image == nullptr) return;
      if constexpr (O == kRgb) {
        const S* const k = mesh.color + 3 * pixel;
        S* const c = image + 3 * pixel;
        const Vec3<S> under = covered ? Vec3<S>{k[0], k[1], k[2]} : background;
        for (int i = 0; i < 3; ++i) c[i] = fma(t, under[i], lost ? S(0) : c[i]);
      } else if constexpr (O == kAlpha) {
        image[pixel] = covered ? S(1) : (lost ? S(0) : a);
      } else {
        // hard_depth has one depth per pixel, which goes to all depth images.
        static_assert((O & kAnyDepth) != 0, "a new image needs a rule here");
        image[pixel] = lost ? (covered ? z : S(0)) : d;
      }
    });
  }
};

}  // namespace gsnav
