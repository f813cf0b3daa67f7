// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>

#include "gsnav/kernels/lanes/isa.hpp"
#include "gsnav/kernels/projection.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// ProjectChunk<float> with kWidth Gaussians side by side; the same bits.
inline void project_chunk(const ProjectArgs<float>& args, std::size_t c) noexcept {
  const GaussianView& gs = args.gaussians;
  const ProjectionCamera<float>& camera = args.camera;
  const std::size_t begin = c * kProjectChunk;
  const std::size_t end = begin + kProjectChunk < gs.size ? begin + kProjectChunk : gs.size;
  const std::size_t base = (args.first_chunk + c) * kProjectChunk;
  const std::size_t step = static_cast<std::size_t>(kWidth);
  std::uint32_t written = 0;
  for (std::size_t i = begin; i < end; i += step) {
    const std::size_t count = end - i < step ? end - i : step;
    float tail[step];
    // The last pack of a set repeats its last Gaussian; those lanes are masked below.
    const auto load = [&](const View<const float>& plane) noexcept {
      if (count == step) return F::load(plane.data + i);
      for (std::size_t k = 0; k < step; ++k) tail[k] = plane[i + (k < count ? k : count - 1)];
      return F::load(tail);
    };
    Vec3<F> offset;
    if (gs.origin_ids.empty()) {
      const Vec3<float>& o = args.offsets_f[0];
      offset = {F(o.x), F(o.y), F(o.z)};
    } else {
      float planes[3][step];
      for (std::size_t k = 0; k < step; ++k) {
        const Vec3<float>& o = args.offsets_f[gs.origin_ids[i + (k < count ? k : count - 1)]];
        planes[0][k] = o.x;
        planes[1][k] = o.y;
        planes[2][k] = o.z;
      }
      offset = {F::load(planes[0]), F::load(planes[1]), F::load(planes[2])};
    }
    const Vec3<F> mean{load(gs.means[0]), load(gs.means[1]), load(gs.means[2])};
    const F z = depth_key(camera.key_rotation, camera.key_scale, mean, offset);
    if (!any(z > F(camera.near_plane))) continue;
    const Vec3<F> delta = mean + offset;
    const Quat<F> quat{load(gs.quats[0]), load(gs.quats[1]), load(gs.quats[2]), load(gs.quats[3])};
    const Vec3<F> scales{load(gs.scales[0]), load(gs.scales[1]), load(gs.scales[2])};
    CameraAxes<F> frame;
    const Projected<F> p = project<F, F>(camera, delta, z, quat, scales, load(gs.opacities), frame);
    std::uint32_t bits = lane_bits(p.visible) & ((1u << count) - 1u);
    if (bits == 0) continue;
    const F key = camera.sort_order == SortOrder::z_depth
                      ? z
                      : distance_key(camera.key_scale, mean, offset);
    for (; bits != 0; bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      const SplatGeometry<F>& g = p.geometry;
      Projected<float> one;
      one.visible = true;
      one.geometry = {g.mean_x[lane], g.mean_y[lane], g.a[lane],     g.k[lane],
                      g.b[lane],      g.s_max[lane],  g.log2_opacity[lane], g.z[lane]};
      one.half_width = p.half_width[lane];
      one.half_height = p.half_height[lane];
      CameraAxes<float> axes;
      if (args.depth) {
        for (int r = 0; r < 3; ++r) {
          axes.axes.row[r] = {frame.axes.row[r].x[lane], frame.axes.row[r].y[lane],
                              frame.axes.row[r].z[lane]};
        }
        axes.position = {frame.position.x[lane], frame.position.y[lane], frame.position.z[lane]};
        axes.scales = {scales.x[lane], scales.y[lane], scales.z[lane]};
      }
      const Vec3<float> d{delta.x[lane], delta.y[lane], delta.z[lane]};
      if (write_splat(args, base + written, i + static_cast<std::size_t>(lane), key[lane], one, axes, d)) {
        ++written;
      }
    }
  }
  args.counts[args.first_chunk + c] = written;
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
