// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/kernels/gaussians.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/half.hpp"
#include "gsnav/math/quat.hpp"

// Packed rows (scene/packed_cloud.hpp), read as the floats that they stand for: over lanes and one at a time the same
// bits, as every operation is rounded once.

namespace gsnav {

/// Largest code of a quaternion's part; half of it is 0.
inline constexpr float kQuatCodes = 32766.0f;
inline constexpr float kRootHalf = 0.70710678118654752f;

/// Offset of a mean from its origin, metres. Codes are whole numbers of [0, 65535].
template <class L>
GSNAV_HD Vec3<L> unpack_mean(const PackedChunk& chunk, const Vec3<L>& code) noexcept {
  return {fma(L(chunk.step.x), code.x, L(chunk.low.x)), fma(L(chunk.step.y), code.y, L(chunk.low.y)),
          fma(L(chunk.step.z), code.z, L(chunk.low.z))};
}

/// Standard deviations, metres: steps of their roots, so that small ones are not lost beside large ones.
template <class L>
GSNAV_HD Vec3<L> unpack_scales(const PackedChunk& chunk, const Vec3<L>& code) noexcept {
  const L step(chunk.scale_step);
  const Vec3<L> roots{code.x * step, code.y * step, code.z * step};
  return {roots.x * roots.x, roots.y * roots.y, roots.z * roots.z};
}

/// A unit quaternion from three of its parts, each within +-sqrt(1/2); the fourth, the largest, is positive. The lowest
/// bits of the first two codes number it.
template <class L>
GSNAV_HD Quat<L> unpack_quat(const Vec3<L>& code) noexcept {
  const L half(0.5f), two(2.0f), zero(0.0f), middle(kQuatCodes / 2), step(kRootHalf / (kQuatCodes / 2));
  const L first = truncated(code.x * half), second = truncated(code.y * half), third = truncated(code.z * half);
  const L missing = fma(two, code.y - two * second, code.x - two * first);
  const L a = (first - middle) * step, b = (second - middle) * step, c = (third - middle) * step;
  const L d = sqrt(max(fma(-a, a, fma(-b, b, fma(-c, c, L(1.0f)))), zero));
  const auto w = missing < half, x = missing < L(1.5f), y = missing < L(2.5f);
  return {select(w, d, a), select(w, a, select(x, d, b)), select(x, b, select(y, d, c)), select(y, c, d)};
}

/// In [0, 1].
template <class L>
GSNAV_HD L unpack_opacity(const L& code) noexcept {
  return code / L(65535.0f);
}

/// Which of a chunk's steps coefficient k = 1, ... of a colour has.
GSNAV_HD constexpr int packed_band(int k) noexcept { return k < 4 ? 0 : k < 9 ? 1 : 2; }

/// Whether shapes and opacities of the rows are packed. Other memory than the host's holds floats.
GSNAV_HD bool is_packed(const GaussianView& gs) noexcept {
#if defined(__CUDA_ARCH__)
  static_cast<void>(gs);
  return false;
#else
  return !gs.packed.codes.empty();
#endif
}
/// Whether colours are.
GSNAV_HD bool has_packed_colors(const GaussianView& gs) noexcept { return is_packed(gs) && !gs.packed.sh0.empty(); }

namespace detail {

/// Codes of row i in three planes from `plane` on.
GSNAV_HD Vec3<float> packed_codes(const GaussianView& gs, int plane, std::size_t i) noexcept {
  const std::uint16_t* code = gs.packed.codes.data + static_cast<std::size_t>(plane) * gs.size + i;
  return {static_cast<float>(code[0]), static_cast<float>(code[gs.size]), static_cast<float>(code[2 * gs.size])};
}

}  // namespace detail

/// The mean of row i as an offset from its origin, metres.
GSNAV_HD Vec3<float> mean_of(const GaussianView& gs, std::size_t i) noexcept {
  if (is_packed(gs) && gs.means[0].empty()) {
    return unpack_mean(gs.packed.chunks[i / kProjectChunk], detail::packed_codes(gs, PackedRows::kMeans, i));
  }
  return {gs.means[0][i], gs.means[1][i], gs.means[2][i]};
}
GSNAV_HD Vec3<float> scales_of(const GaussianView& gs, std::size_t i) noexcept {
  if (is_packed(gs)) {
    return unpack_scales(gs.packed.chunks[i / kProjectChunk], detail::packed_codes(gs, PackedRows::kScales, i));
  }
  return {gs.scales[0][i], gs.scales[1][i], gs.scales[2][i]};
}
GSNAV_HD Quat<float> quat_of(const GaussianView& gs, std::size_t i) noexcept {
  if (is_packed(gs)) return unpack_quat(detail::packed_codes(gs, PackedRows::kQuats, i));
  return {gs.quats[0][i], gs.quats[1][i], gs.quats[2][i], gs.quats[3][i]};
}
GSNAV_HD float opacity_of(const GaussianView& gs, std::size_t i) noexcept {
  if (is_packed(gs)) return unpack_opacity(static_cast<float>(gs.packed.codes[PackedRows::kOpacity * gs.size + i]));
  return gs.opacities[i];
}

/// Coefficient k of row i of packed colours, whichever way the bands are kept.
GSNAV_HD Vec3<float> packed_coefficient(const GaussianView& gs, std::size_t i, int k) noexcept {
  const auto halves = [](const std::uint16_t* p) GSNAV_INLINED {
    return Vec3<float>{half_to_float(p[0]), half_to_float(p[1]), half_to_float(p[2])};
  };
  if (k == 0) return halves(gs.packed.sh0.data + 3 * i);
  const std::size_t rest = static_cast<std::size_t>(sh_coefficient_count(gs.sh_degree) - 1);
  const std::size_t at = 3 * (rest * i + static_cast<std::size_t>(k - 1));
  if (!gs.packed.shN.empty()) {
    const float step = gs.packed.chunks[i / kProjectChunk].sh_steps[packed_band(k)];
    const std::int8_t* p = gs.packed.shN.data + at;
    return {static_cast<float>(p[0]) * step, static_cast<float>(p[1]) * step, static_cast<float>(p[2]) * step};
  }
  if (!gs.shN_half.empty()) return halves(gs.shN_half.data + at);
  return {gs.shN[at], gs.shN[at + 1], gs.shN[at + 2]};
}

}  // namespace gsnav
