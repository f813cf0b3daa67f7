// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/frame/project_chunk.hpp"
#include "gsnav/detail/frame/set_rows.hpp"
#include "gsnav/detail/lanes/isa.hpp"
#include "gsnav/detail/lanes/write_splats.hpp"

namespace gsnav::lanes {
inline namespace GSNAV_LANES_TAG {

/// Offsets of the rows row(0), ..., row(kWidth - 1), each that of its origin.
template <class Row>
GSNAV_HD Vec3<doubles_of<F>> offsets_of(const ShapeRows& shape, const View<const Vec3d>& offsets,
                                        const Row& row) noexcept {
  using D = doubles_of<F>;
  const auto all = [](const Vec3d& o) noexcept { return Vec3<D>{D(o.x), D(o.y), D(o.z)}; };
  if (shape.origin_ids.empty()) return all(offsets[0]);
  // Neighbours mostly have one origin.
  const std::uint32_t first = shape.origin_ids[row(0)];
  std::uint32_t others = 0;
  for (std::size_t k = 1; k < static_cast<std::size_t>(kWidth); ++k)
    others |= shape.origin_ids[row(k)] ^ first;
  if (others == 0) return all(offsets[first]);
  double planes[3][kWidth];
  for (std::size_t k = 0; k < static_cast<std::size_t>(kWidth); ++k) {
    const Vec3d& o = offsets[shape.origin_ids[row(k)]];
    planes[0][k] = o.x;
    planes[1][k] = o.y;
    planes[2][k] = o.z;
  }
  return {D::load(planes[0]), D::load(planes[1]), D::load(planes[2])};
}

/// Reads kWidth rows of a set from row i on, one per lane, for SetRows. The last pack of a set may have
/// fewer rows (`count`). Its other lanes repeat the last row, and callers mask them.
struct PackOfRows {
  using lane = F;
  static constexpr std::size_t kStep = static_cast<std::size_t>(kWidth);
  const ShapeRows& shape;
  const PackedChunk* packed;  ///< null if shapes are floats
  std::size_t i, count;

  GSNAV_HD ShapeEncoding encoding() const noexcept { return shape.encoding(); }
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
    return offsets_of(shape, offsets, [this](std::size_t k) GSNAV_INLINED { return row(k); });
  }
};

/// PackOfRows for kWidth rows of ShapeEncoding::ellipsoids, as nearly all packs are. Code without the
/// other cases is much shorter.
struct FloatRows {
  using lane = F;
  const ShapeRows& shape;
  std::size_t i;

  GSNAV_HD static bool fit(const ShapeRows& shape) noexcept {
    return shape.encoding() == ShapeEncoding::ellipsoids;
  }
  GSNAV_HD static constexpr ShapeEncoding encoding() noexcept { return ShapeEncoding::ellipsoids; }
  GSNAV_HD static constexpr const PackedChunk* chunk() noexcept { return nullptr; }
  GSNAV_HD F floats(const View<const float>& plane) const noexcept { return F::load(plane.data + i); }
  GSNAV_HD static F codes(int) noexcept { return {}; }
  GSNAV_HD Vec3<doubles_of<F>> offset(const View<const Vec3d>& offsets) const noexcept {
    return offsets_of(shape, offsets, [this](std::size_t k) GSNAV_INLINED { return i + k; });
  }
};

/// Where a pack of rows is written: after the `written` splats that its chunk has, from slot `base` on.
struct PackPlace {
  std::size_t first;     ///< row of the first lane
  std::uint32_t wanted;  ///< bits of the lanes to project
  std::size_t base;
  std::uint32_t written;
};

/// Projects a pack of rows and writes those that are visible. Returns their number.
template <class Rows>
GSNAV_STAGE std::uint32_t project_pack(const ViewedSet<float>& args, const ProjectOutputs<float>& out,
                                       const Rows& pack, const PackPlace& place,
                                       Survivors& survivors) noexcept {
  const ProjectionCamera<float>& camera = args.camera;
  const ViewedRows<Rows> rows(pack, args.offsets);
  const RowKey<F> key = row_key<F>(args.camera64, rows);
  if (!any(beyond_near_plane(camera.near_plane, key.z))) return 0;
  if (camera.response != Response::ewa) __builtin_unreachable();  // project_chunk has seen to it
  const ProjectedRow<F> projected(camera, rows, key);
  const std::uint32_t bits = lane_bits(projected.splat.visible) & place.wanted;
  if (bits == 0) return 0;
  return write_splats(args, out, place.base, place.written, {place.first, key, projected}, bits,
                      survivors);
}

/// Projects a chunk with the serial kernel, for rules that have no SIMD form.
GSNAV_STAGE void project_chunk_alone(const ViewedSet<float>& args, const ProjectOutputs<float>& out,
                                     std::size_t c) noexcept {
  ProjectChunk<float>{args, out}(c);
}

/// Computes ProjectChunk<float>, kWidth Gaussians at a time. The bits equal those of the scalar kernel.
inline void project_chunk(const ViewedSet<float>& args, const ProjectOutputs<float>& out,
                          std::size_t c) noexcept {
  const ShapeRows& shape = args.gaussians.shape;
  if (args.camera.response != Response::ewa || args.camera.compat != Compat::none) {
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
  const bool plain = FloatRows::fit(shape);
  std::uint32_t written = 0;
  Survivors survivors;
  static_assert(kChunkPart % step == 0 && 32 % step == 0);
  for (std::size_t i = begin; i < end; i += step) {
    if ((parts >> ((i - begin) / kChunkPart) & 1u) == 0) continue;
    const std::size_t count = end - i < step ? end - i : step;
    const std::uint32_t wanted =
        may_be_seen.word((i - begin) / 32) >> ((i - begin) % 32) & ((1u << count) - 1u);
    if (wanted == 0) continue;
    const PackPlace place{i, wanted, base, written};
    written += plain && count == step
                   ? project_pack(args, out, FloatRows{shape, i}, place, survivors)
                   : project_pack(args, out, PackOfRows{shape, packed, i, count}, place, survivors);
  }
  if (!out.colors.empty()) {
    const ColorRows& sh = args.gaussians.color;
    color_survivors(sh, sh.degree_of(begin, args.sh_degree), survivors, written, out.colors.data + base);
  }
  out.counts[args.first_chunk + c] = written;
}

}  // namespace GSNAV_LANES_TAG
}  // namespace gsnav::lanes
