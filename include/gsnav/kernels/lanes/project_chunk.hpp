// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>

#include "gsnav/kernels/lanes/isa.hpp"
#include "gsnav/kernels/lanes/write_splats.hpp"
#include "gsnav/kernels/packed_gaussians.hpp"
#include "gsnav/kernels/project_chunk.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// ProjectChunk<float> with kWidth Gaussians side by side; the same bits.
inline void project_chunk(const ProjectArgs<float>& args, std::size_t c) noexcept {
  const GaussianView& gs = args.gaussians;
  const ProjectionCamera<float>& camera = args.camera;
  if (camera.response != Response::ewa || camera.compat != Compat::none) {
    ProjectChunk<float>{args}(c);  // not worth lanes of its own
    return;
  }
  const std::size_t begin = gs.chunk_id(c) * kProjectChunk;
  const std::size_t end = begin + kProjectChunk < gs.size ? begin + kProjectChunk : gs.size;
  const std::size_t base = (args.first_chunk + c) * kProjectChunk;
  const std::size_t step = static_cast<std::size_t>(kWidth);
  const std::uint32_t parts = candidate_parts(args, c);
  if (parts == 0) {
    args.counts[args.first_chunk + c] = 0;
    return;
  }
  const SeenRows seen = gs.seen_rows(gs.chunk_id(c));
  const bool packed = is_packed(gs);
  const PackedChunk* const chunk = packed ? &gs.packed.chunks[gs.chunk_id(c)] : nullptr;
  std::uint32_t written = 0;
  Survivors survivors;
  static_assert(kChunkPart % step == 0 && 32 % step == 0);
  for (std::size_t i = begin; i < end; i += step) {
    if ((parts >> ((i - begin) / kChunkPart) & 1u) == 0) continue;
    const std::uint32_t wanted = seen.word((i - begin) / 32) >> ((i - begin) % 32);
    if ((wanted & ((1u << step) - 1u)) == 0) continue;
    const std::size_t count = end - i < step ? end - i : step;
    float tail[step];
    // The last pack of a set repeats its last Gaussian; those lanes are masked below.
    const auto load = [&](const View<const float>& plane) noexcept {
      if (count == step) return F::load(plane.data + i);
      for (std::size_t k = 0; k < step; ++k) tail[k] = plane[i + (k < count ? k : count - 1)];
      return F::load(tail);
    };
    // origin - camera, of the lower and of the upper half of the lanes.
    Vec3<D> offset[2];
    if (gs.origin_ids.empty()) {
      const Vec3d& o = args.offsets[0];
      offset[0] = offset[1] = {D(o.x), D(o.y), D(o.z)};
    } else {
      double planes[3][step];
      for (std::size_t k = 0; k < step; ++k) {
        const Vec3d& o = args.offsets[gs.origin_ids[i + (k < count ? k : count - 1)]];
        planes[0][k] = o.x;
        planes[1][k] = o.y;
        planes[2][k] = o.z;
      }
      for (std::size_t h = 0; h < 2; ++h) {
        const std::size_t at = h * step / 2;
        offset[h] = {D::load(planes[0] + at), D::load(planes[1] + at), D::load(planes[2] + at)};
      }
    }
    const auto codes = [&](int plane) noexcept {
      const std::uint16_t* from = gs.packed.codes.data + static_cast<std::size_t>(plane) * gs.size + i;
      for (std::size_t k = 0; k < step && count == step; ++k) tail[k] = static_cast<float>(from[k]);
      for (std::size_t k = 0; k < step && count != step; ++k)
        tail[k] = static_cast<float>(from[k < count ? k : count - 1]);
      return F::load(tail);
    };
    const auto codes3 = [&](int plane) noexcept { return Vec3<F>{codes(plane), codes(plane + 1), codes(plane + 2)}; };
    const Vec3<F> mean = packed && gs.means[0].empty()
                             ? unpack_mean(*chunk, codes3(PackedRows::kMeans))
                             : Vec3<F>{load(gs.means[0]), load(gs.means[1]), load(gs.means[2])};
    const Vec3<D> delta64[2] = {
        Vec3<D>{widened<0>(mean.x), widened<0>(mean.y), widened<0>(mean.z)} + offset[0],
        Vec3<D>{widened<1>(mean.x), widened<1>(mean.y), widened<1>(mean.z)} + offset[1]};
    const F z = rounded(depth_key(args.camera64, delta64[0]), depth_key(args.camera64, delta64[1]));
    if (!any(z > F(camera.near_plane))) continue;
    const Vec3<F> delta = mean + Vec3<F>{rounded(offset[0].x, offset[1].x), rounded(offset[0].y, offset[1].y),
                                         rounded(offset[0].z, offset[1].z)};
    SplatAxes<F> axes;
    if (packed) {
      axes = splat_axes(camera.rotation, delta, unpack_quat(codes3(PackedRows::kQuats)),
                        unpack_scales(*chunk, codes3(PackedRows::kScales)));
    } else if (gs.axes[0].empty()) {
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
    const F opacity = packed ? unpack_opacity(codes(PackedRows::kOpacity)) : load(gs.opacities);
    const Projected<F> splat = project<F, F>(camera, axes, z, opacity);
    const std::uint32_t bits = lane_bits(splat.visible) & wanted & ((1u << count) - 1u);
    if (bits == 0) continue;
    const F key = camera.sort_order == SortOrder::z_depth
                      ? z
                      : rounded(distance_key(args.camera64, delta64[0]), distance_key(args.camera64, delta64[1]));
    written += write_splats(args, base, written, {i, delta, delta64, key, axes, splat}, bits, survivors);
  }
  if (args.color) {
    color_survivors(gs, gs.degree_of(begin, args.sh_degree), survivors, written, args.colors.data + base);
  }
  args.counts[args.first_chunk + c] = written;
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
