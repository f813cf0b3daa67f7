// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/set_rows.hpp"
#include "gsnav/detail/lanes/isa.hpp"
#include "gsnav/detail/lanes/write_splats.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Reads kWidth rows of a set from row i on, one per lane, for SetRows. The last pack of a set may have
/// fewer rows (`count`). Its other lanes repeat the last row, and callers mask them.
struct PackOfRows {
  using lane = F;
  static constexpr std::size_t kStep = static_cast<std::size_t>(kWidth);
  const ShapeRows& shape;
  const PackedChunk* packed;  ///< null if shapes are floats
  std::size_t i, count;

  GSNAV_HD const PackedChunk* chunk() const noexcept { return packed; }
  GSNAV_HD std::size_t row(std::size_t k) const noexcept { return i + (k < count ? k : count - 1); }
  GSNAV_HD F floats(const View<const float>& plane) const noexcept {
    if (count == kStep) return F::load(plane.data + i);
    float tail[kStep];
    for (std::size_t k = 0; k < kStep; ++k) tail[k] = plane[row(k)];
    return F::load(tail);
  }
  GSNAV_HD F codes(int plane) const noexcept {
    const std::uint16_t* const from = shape.codes.data + static_cast<std::size_t>(plane) * shape.size;
    float values[kStep];
    if (count == kStep) {
      for (std::size_t k = 0; k < kStep; ++k) values[k] = static_cast<float>(from[i + k]);
    } else {
      for (std::size_t k = 0; k < kStep; ++k) values[k] = static_cast<float>(from[row(k)]);
    }
    return F::load(values);
  }
  GSNAV_HD Vec3<doubles_of<F>> offset(const View<const Vec3d>& offsets) const noexcept {
    using D = doubles_of<F>;
    if (shape.origin_ids.empty()) return {D(offsets[0].x), D(offsets[0].y), D(offsets[0].z)};
    double planes[3][kStep];
    for (std::size_t k = 0; k < kStep; ++k) {
      const Vec3d& o = offsets[shape.origin_ids[row(k)]];
      planes[0][k] = o.x;
      planes[1][k] = o.y;
      planes[2][k] = o.z;
    }
    return {D::load(planes[0]), D::load(planes[1]), D::load(planes[2])};
  }
};

/// Projects a chunk with the serial kernel, for rules that have no SIMD form.
GSNAV_STAGE void project_chunk_alone(const ViewedSet<float>& args, const ProjectOutputs<float>& out,
                                     std::size_t c) noexcept {
  ProjectChunk<float>{args, out}(c);
}

/// Computes ProjectChunk<float>, kWidth Gaussians at a time. The bits equal those of the scalar kernel.
inline void project_chunk(const ViewedSet<float>& args, const ProjectOutputs<float>& out,
                          std::size_t c) noexcept {
  const ShapeRows& shape = args.gaussians.shape;
  const ProjectionCamera<float>& camera = args.camera;
  if (camera.response != Response::ewa || camera.compat != Compat::none) {
    project_chunk_alone(args, out, c);
    return;
  }
  const std::size_t id = args.selection.chunk_id(c), begin = id * kProjectChunk;
  const std::size_t end = begin + kProjectChunk < shape.size ? begin + kProjectChunk : shape.size;
  const std::size_t base = (args.first_chunk + c) * kProjectChunk;
  constexpr std::size_t step = PackOfRows::kStep;
  const std::uint32_t parts = candidate_parts(args, c);
  if (parts == 0) {
    out.counts[args.first_chunk + c] = 0;
    return;
  }
  const SeenRows may_be_seen = args.seen_rows(id);
  const PackedChunk* const packed =
      shape.encoding() == ShapeEncoding::codes ? &shape.chunks[id] : nullptr;
  std::uint32_t written = 0;
  Survivors survivors;
  static_assert(kChunkPart % step == 0 && 32 % step == 0);
  for (std::size_t i = begin; i < end; i += step) {
    if ((parts >> ((i - begin) / kChunkPart) & 1u) == 0) continue;
    const std::uint32_t wanted = may_be_seen.word((i - begin) / 32) >> ((i - begin) % 32);
    if ((wanted & ((1u << step) - 1u)) == 0) continue;
    const std::size_t count = end - i < step ? end - i : step;
    const ViewedRows<PackOfRows> rows({shape, packed, i, count}, args.offsets);
    const RowKey<F> key = row_key<F>(args.camera64, rows);
    if (!any(beyond_near_plane(camera.near_plane, key.z))) continue;
    const ProjectedRow<F> projected(camera, rows, key);
    const std::uint32_t bits = lane_bits(projected.splat.visible) & wanted & ((1u << count) - 1u);
    if (bits != 0)
      written += write_splats(args, out, base, written, {i, key, projected}, bits, survivors);
  }
  if (!out.colors.empty()) {
    const ColorRows& sh = args.gaussians.color;
    color_survivors(sh, sh.degree_of(begin, args.sh_degree), survivors, written, out.colors.data + base);
  }
  out.counts[args.first_chunk + c] = written;
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
