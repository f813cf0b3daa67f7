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
    const F z = depth_key(camera.key_rotation, camera.key_scale, mean, offset);
    if (!any(z > F(camera.near_plane))) continue;
    const Vec3<F> delta = mean + offset;
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
    const F key = camera.sort_order == SortOrder::z_depth ? z : distance_key(camera.key_scale, mean, offset);
    written += write_splats(args, base, written, {i, mean, delta, key, axes, splat}, bits, survivors);
  }
  if (args.color) {
    color_survivors(gs, gs.degree_of(begin, args.sh_degree), survivors, written, args.colors.data + base);
  }
  args.counts[args.first_chunk + c] = written;
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
