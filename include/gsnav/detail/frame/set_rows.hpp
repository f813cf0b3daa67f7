// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/detail/math/half.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

// Reading the rows of a set as floats, from any of its encodings (SetRows). Every operation is rounded
// once, so packed rows (scene/packed_cloud.hpp) give the same bits in a pack and one at a time.

namespace gsnav {

/// Largest code of a quaternion component. Half of it encodes 0.
inline constexpr float kQuatCodes = 32766.0f;
inline constexpr float kRootHalf = 0.70710678118654752f;

/// Decodes the offset of a mean from its origin, metres. Codes are integers in [0, 65535].
template <class L>
GSNAV_HD Vec3<L> unpack_mean(const PackedChunk& chunk, const Vec3<L>& code) noexcept {
  return {fma(L(chunk.step.x), code.x, L(chunk.low.x)), fma(L(chunk.step.y), code.y, L(chunk.low.y)),
          fma(L(chunk.step.z), code.z, L(chunk.low.z))};
}

/// Decodes standard deviations, metres. Codes are steps of the square root, so that small deviations
/// keep their precision next to large ones.
template <class L>
GSNAV_HD Vec3<L> unpack_scales(const PackedChunk& chunk, const Vec3<L>& code) noexcept {
  const L step(chunk.scale_step);
  const Vec3<L> roots{code.x * step, code.y * step, code.z * step};
  return {roots.x * roots.x, roots.y * roots.y, roots.z * roots.z};
}

/// Decodes a unit quaternion from three components, each within +-sqrt(1/2). The fourth is the largest
/// and positive. The lowest bits of the first two codes are its index.
template <class L>
GSNAV_HD Quat<L> unpack_quat(const Vec3<L>& code) noexcept {
  const L half(0.5f), two(2.0f), zero(0.0f), middle(kQuatCodes / 2), step(kRootHalf / (kQuatCodes / 2));
  const L first = truncated(code.x * half), second = truncated(code.y * half),
          third = truncated(code.z * half);
  const L missing = fma(two, code.y - two * second, code.x - two * first);
  const L a = (first - middle) * step, b = (second - middle) * step, c = (third - middle) * step;
  const L d = sqrt(max(fma(-a, a, fma(-b, b, fma(-c, c, L(1.0f)))), zero));
  const auto w = missing < half, x = missing < L(1.5f), y = missing < L(2.5f);
  return {select(w, d, a), select(w, a, select(x, d, b)), select(x, b, select(y, d, c)),
          select(y, c, d)};
}

/// Decodes an opacity in [0, 1].
template <class L>
GSNAV_HD L unpack_opacity(const L& code) noexcept {
  return code / L(65535.0f);
}

/// Index in PackedChunk::sh_steps for coefficient k >= 1.
GSNAV_HD constexpr int packed_band(int k) noexcept { return k < 4 ? 0 : k < 9 ? 1 : 2; }

/// One value of an SH coefficient as it is stored: a float, a half, or a code with its chunk's step.
GSNAV_HD float sh_value(float stored) noexcept { return stored; }
GSNAV_HD float sh_value(std::uint16_t stored) noexcept { return half_to_float(stored); }
GSNAV_HD float sh_value(std::int8_t stored, float step) noexcept {
  return static_cast<float>(stored) * step;
}

/// Reads one row of a set, as SetRows needs it.
struct OneRow {
  using lane = float;
  const ShapeRows& shape;
  std::size_t i;

  GSNAV_HD float floats(const View<const float>& plane) const noexcept { return plane[i]; }
  GSNAV_HD float codes(int plane) const noexcept {
    return static_cast<float>(shape.codes.data[static_cast<std::size_t>(plane) * shape.size + i]);
  }
  GSNAV_HD ShapeEncoding encoding() const noexcept { return shape.encoding(); }
  /// Constants that decode the row, or null if shapes are floats.
  GSNAV_HD const PackedChunk* chunk() const noexcept {
    return shape.encoding() == ShapeEncoding::codes ? &shape.chunks[i / kProjectChunk] : nullptr;
  }
  /// The element of `offsets` (one per origin) that belongs to the row.
  GSNAV_HD Vec3d offset(const View<const Vec3d>& offsets) const noexcept {
    return offsets[origin_id(shape.origin_ids, i)];
  }
};

/// Decodes one row of a set, or a pack of rows, from any encoding. Each member reads memory when it is
/// called. At selects the rows (OneRow, lanes::PackOfRows or lanes::FloatRows).
template <class At>
struct SetRows {
  using L = typename At::lane;
  At at;

  /// Offset of the mean from the row's origin, metres.
  GSNAV_HD Vec3<L> mean() const noexcept {
    const PackedChunk* const chunk = at.chunk();
    return chunk != nullptr && at.shape.means.empty() ? unpack_mean(*chunk, codes3(ShapeRows::kMeans))
                                                      : floats3(at.shape.means);
  }
  /// True if the shape is a factor M (ShapeRows::axes) instead of a quaternion and scales.
  GSNAV_HD bool has_factor() const noexcept { return at.encoding() == ShapeEncoding::factors; }
  GSNAV_HD Mat3<L> factor() const noexcept {
    return {{floats3(at.shape.axes), floats3(at.shape.axes, 3), floats3(at.shape.axes, 6)}};
  }
  GSNAV_HD Quat<L> quat() const noexcept {
    if (at.chunk() != nullptr) return unpack_quat(codes3(ShapeRows::kQuats));
    const Planes<const float, 4>& q = at.shape.quats;
    return {at.floats(q[0]), at.floats(q[1]), at.floats(q[2]), at.floats(q[3])};
  }
  GSNAV_HD Vec3<L> scales() const noexcept {
    const PackedChunk* const chunk = at.chunk();
    return chunk != nullptr ? unpack_scales(*chunk, codes3(ShapeRows::kScales))
                            : floats3(at.shape.scales);
  }
  GSNAV_HD L opacity() const noexcept {
    return at.chunk() != nullptr ? unpack_opacity(at.codes(ShapeRows::kOpacity))
                                 : at.floats(at.shape.opacities);
  }

 private:
  template <std::size_t K>
  GSNAV_HD Vec3<L> floats3(const Planes<const float, K>& planes, std::size_t k = 0) const noexcept {
    return {at.floats(planes[k]), at.floats(planes[k + 1]), at.floats(planes[k + 2])};
  }
  GSNAV_HD Vec3<L> codes3(int plane) const noexcept {
    return {at.codes(plane), at.codes(plane + 1), at.codes(plane + 2)};
  }
};

/// Mean of row i: its offset from its origin, metres.
GSNAV_HD Vec3<float> mean_of(const ShapeRows& shape, std::size_t i) noexcept {
  return SetRows<OneRow>{{shape, i}}.mean();
}
/// Standard deviations of row i, metres.
GSNAV_HD Vec3<float> scales_of(const ShapeRows& shape, std::size_t i) noexcept {
  return SetRows<OneRow>{{shape, i}}.scales();
}
/// Unit quaternion of row i.
GSNAV_HD Quat<float> quat_of(const ShapeRows& shape, std::size_t i) noexcept {
  return SetRows<OneRow>{{shape, i}}.quat();
}
/// Opacity of row i, in [0, 1].
GSNAV_HD float opacity_of(const ShapeRows& shape, std::size_t i) noexcept {
  return SetRows<OneRow>{{shape, i}}.opacity();
}

/// Value `at` of the bands above degree 0 ([N][rest]), whichever way they are kept. It is of coefficient
/// k of a row of `chunk`.
GSNAV_HD float band_value(const ColorRows& rows, std::size_t at, std::size_t chunk, int k) noexcept {
  switch (rows.band_encoding()) {
    case BandEncoding::codes:
      return sh_value(rows.shN_codes[at], rows.chunks[chunk].sh_steps[packed_band(k)]);
    case BandEncoding::halves:
      return sh_value(rows.shN_half[at]);
    case BandEncoding::floats:
      break;
  }
  return sh_value(rows.shN[at]);
}

/// Three values from p on, as they are stored.
template <class Stored>
GSNAV_HD Vec3<float> sh_values(const Stored* p) noexcept {
  return {sh_value(p[0]), sh_value(p[1]), sh_value(p[2])};
}

/// Coefficient k of row i of packed colours, for bands stored as codes, halves or floats.
GSNAV_HD Vec3<float> packed_coefficient(const ColorRows& rows, std::size_t i, int k) noexcept {
  if (k == 0) return sh_values(rows.sh0_half.data + 3 * i);
  const std::size_t at = rows.rest() * i + 3 * static_cast<std::size_t>(k - 1),
                    chunk = i / kProjectChunk;
  return {band_value(rows, at, chunk, k), band_value(rows, at + 1, chunk, k),
          band_value(rows, at + 2, chunk, k)};
}

/// Calls f(coefficient), where coefficient(k) reads coefficient k of row i as a Vec3<float>. The
/// encoding is looked up once, before.
template <class F>
GSNAV_HD auto with_coefficients(const ColorRows& rows, std::size_t i, const F& f) noexcept {
  if (rows.packed()) return f([&](int k) GSNAV_INLINED { return packed_coefficient(rows, i, k); });
  const float* const sh0 = rows.sh0.data + 3 * i;
  const auto of_bands = [=, &f](const auto* bands) GSNAV_INLINED {
    return f([=](int k)
                 GSNAV_INLINED { return k == 0 ? sh_values(sh0) : sh_values(bands + 3 * (k - 1)); });
  };
  const std::size_t at = rows.rest() * i;
  switch (rows.band_encoding()) {
    case BandEncoding::halves:
      return of_bands(rows.shN_half.data + at);
    case BandEncoding::codes:  // packed()
    case BandEncoding::floats:
      break;
  }
  return of_bands(rows.shN.data + at);
}

}  // namespace gsnav
