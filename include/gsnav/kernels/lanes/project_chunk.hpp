// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>

#include "gsnav/kernels/lanes/isa.hpp"
#include "gsnav/kernels/project_chunk.hpp"

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
  const bool candidate = chunk_is_candidate(args, c);
  for (std::size_t i = begin; i < end && candidate; i += step) {
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
    SplatAxes<F> axes;
    if (gs.axes[0].empty()) {
      const Quat<F> quat{load(gs.quats[0]), load(gs.quats[1]), load(gs.quats[2]), load(gs.quats[3])};
      axes = splat_axes(camera.rotation, delta, quat,
                        Vec3<F>{load(gs.scales[0]), load(gs.scales[1]), load(gs.scales[2])});
    } else {
      Mat3<F> factor;
      for (int r = 0; r < 3; ++r) {
        factor.row[r] = {load(gs.axes[3 * r]), load(gs.axes[3 * r + 1]), load(gs.axes[3 * r + 2])};
      }
      axes = splat_axes(camera.rotation, delta, factor);
    }
    const Projected<F> p = project<F, F>(camera, axes, z, load(gs.opacities));
    std::uint32_t bits = lane_bits(p.visible) & ((1u << count) - 1u);
    if (bits == 0) continue;
    const F key = camera.sort_order == SortOrder::z_depth
                      ? z
                      : distance_key(camera.key_scale, mean, offset);
    for (; bits != 0; bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      Projected<float> one;
      one.visible = true;
      one.mean_x = p.mean_x[lane];
      one.mean_y = p.mean_y[lane];
      one.a = p.a[lane];
      one.k = p.k[lane];
      one.b = p.b[lane];
      one.log2_opacity = p.log2_opacity[lane];
      one.s_max = p.s_max[lane];
      one.variance_x = p.variance_x[lane];
      one.variance_y = p.variance_y[lane];
      one.center_x = p.center_x[lane];
      one.center_y = p.center_y[lane];
      one.half_width = p.half_width[lane];
      one.half_height = p.half_height[lane];
      if (camera.response != Response::ewa) {
        one.slope_x = p.slope_x[lane];
        one.slope_y = p.slope_y[lane];
        one.bend = p.bend[lane];
      }
      SplatAxes<float> own;
      if (args.depth) {
        for (int r = 0; r < 3; ++r) {
          const Vec3<F>& f = axes.factor.row[r];
          const Vec3<F>& q = axes.cofactors.row[r];
          own.factor.row[r] = {f.x[lane], f.y[lane], f.z[lane]};
          own.cofactors.row[r] = {q.x[lane], q.y[lane], q.z[lane]};
        }
        own.position = {axes.position.x[lane], axes.position.y[lane], axes.position.z[lane]};
      }
      const std::size_t row = i + static_cast<std::size_t>(lane);
      const std::size_t origin = gs.origin_ids.empty() ? 0 : gs.origin_ids[row];
      if (write_splat(args, base + written, row, key[lane], {mean.x[lane], mean.y[lane], mean.z[lane]},
                      origin, one, own)) {
        ++written;
      }
    }
  }
  args.counts[args.first_chunk + c] = written;
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
