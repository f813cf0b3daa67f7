// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Packed rows: each plane where it is wanted, and no axes beside them.
inline Status validate_packed(const GaussianView& g) {
  const PackedRows& p = g.packed;
  const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(g.sh_degree) - 1);
  const bool codes = p.codes.size == PackedRows::kPlanes * g.size ||
                     (p.codes.size == PackedRows::kMeans * g.size && !g.means[0].empty());
  const char* wrong = !codes                                          ? "codes"
                      : p.chunks.size != g.all_chunks()               ? "chunks"
                      : !p.sh0.empty() && p.sh0.size != 3 * g.size    ? "sh0"
                      : !p.shN.empty() && p.shN.size != rest * g.size ? "shN"
                      : !p.shN.empty() && p.sh0.empty()               ? "shN (without sh0)"
                      : !p.shN.empty() && !g.shN_half.empty()         ? "shN (beside shN_half)"
                      : !g.axes[0].empty()                            ? "codes (beside axes)"
                                                                      : nullptr;
  if (wrong == nullptr) return {};
  return {Errc::invalid_argument, std::string("GaussianSet: packed.") + wrong + " do not fit " +
                                      std::to_string(g.size) + " Gaussians of SH degree " +
                                      std::to_string(g.sh_degree)};
}

/// Checks a set against what kernels assume; names the array that does not fit.
inline Status validate(const GaussianSet& set) {
  const GaussianView& g = set.gaussians;
  const auto bad = [](const std::string& what) {
    return Status(Errc::invalid_argument, "GaussianSet: " + what);
  };
  const auto sized = [&](const View<const float>& v, std::size_t n, const char* name) {
    if (v.data == nullptr && v.size != 0)
      return bad(std::string(name) + " is null, with a size of " + std::to_string(v.size));
    return v.size == n ? Status()
                       : bad(std::string(name) + " has " + std::to_string(v.size) + " values where " +
                             std::to_string(n) + " are needed");
  };
  if (set.filter > Filter::mip)
    return bad("filter = " + std::to_string(static_cast<int>(set.filter)) +
               ": there is none of this number");
  if (set.color_space > ColorSpace::linear) {
    return bad("color_space = " + std::to_string(static_cast<int>(set.color_space)) +
               ": there is none of this number");
  }
  const auto null = [](const auto& v) { return v.data == nullptr && v.size != 0; };
  const char* nothing = null(g.shN_half)           ? "shN_half"
                        : null(g.row_ids)          ? "row_ids"
                        : null(g.origin_ids)       ? "origin_ids"
                        : null(g.origins)          ? "origins"
                        : null(g.chunk_bounds)     ? "chunk_bounds"
                        : null(g.part_bounds)      ? "part_bounds"
                        : null(g.chunk_sh_degrees) ? "chunk_sh_degrees"
                        : null(g.drawn_chunks)     ? "drawn_chunks"
                        : null(g.seen)             ? "seen"
                                                   : nullptr;
  if (nothing != nullptr) return bad(std::string(nothing) + " is null, with a size");
  if (g.sh_degree < 0 || g.sh_degree > kMaxShDegree) {
    return bad("sh_degree = " + std::to_string(g.sh_degree) + ": must be in [0, 3]");
  }
  const bool has_axes = !g.axes[0].empty(), packed = !g.packed.codes.empty();
  if (packed) {
    if (Status s = validate_packed(g); !s) return s;
  }
  for (int k = 0; k < 9 && has_axes; ++k) {
    if (Status s = sized(g.axes[k], g.size, "axes"); !s) return s;
  }
  for (int k = 0; k < 3; ++k) {
    if (Status s =
            sized(g.means[k], packed && g.packed.codes.size == PackedRows::kPlanes * g.size ? 0 : g.size,
                  "means");
        !s) {
      return s;
    }
    if (has_axes || packed) continue;
    if (Status s = sized(g.scales[k], g.size, "scales"); !s) return s;
  }
  for (int k = 0; k < 4; ++k) {
    if (!g.sh_rotations[k].empty()) {
      if (Status s = sized(g.sh_rotations[k], g.size, "sh_rotations"); !s) return s;
    }
    if (has_axes || packed) continue;
    if (Status s = sized(g.quats[k], g.size, "quats"); !s) return s;
  }
  if (Status s = sized(g.opacities, packed ? 0 : g.size, "opacities"); !s) return s;
  const bool bytes = packed && !g.packed.shN.empty();
  if (Status s = sized(g.sh0, packed && !g.packed.sh0.empty() ? 0 : 3 * g.size, "sh0"); !s) return s;
  const std::size_t rest = static_cast<std::size_t>(sh_coefficient_count(g.sh_degree) - 1);
  if (g.shN_half.empty()) {
    if (Status s = sized(g.shN, bytes ? 0 : 3 * rest * g.size, "shN"); !s) return s;
  } else if (g.shN_half.size != 3 * rest * g.size || !g.shN.empty()) {
    return bad("shN_half has " + std::to_string(g.shN_half.size) + " values where " +
               std::to_string(3 * rest * g.size) + " are needed, and shN must be empty beside it");
  }
  if (!g.row_ids.empty() && g.row_ids.size != g.size) {
    return bad("row_ids has " + std::to_string(g.row_ids.size) + " values where " +
               std::to_string(g.size) + " are needed");
  }
  if (!g.chunk_bounds.empty() && g.chunk_bounds.size != g.all_chunks()) {
    return bad("chunk_bounds has " + std::to_string(g.chunk_bounds.size) + " values where " +
               std::to_string(g.all_chunks()) + " are needed");
  }
  const std::size_t parts = (g.size + kChunkPart - 1) / kChunkPart;
  if (!g.part_bounds.empty() && g.part_bounds.size != parts) {
    return bad("part_bounds has " + std::to_string(g.part_bounds.size) + " values where " +
               std::to_string(parts) + " are needed");
  }
  if (!g.chunk_sh_degrees.empty() && g.chunk_sh_degrees.size != g.all_chunks()) {
    return bad("chunk_sh_degrees has " + std::to_string(g.chunk_sh_degrees.size) + " values where " +
               std::to_string(g.all_chunks()) + " are needed");
  }
  if (!g.seen.empty() && !g.seen_may_have(g.seen.size)) {
    return bad("seen has " + std::to_string(g.seen.size) + " words where " +
               std::to_string(g.seen_words()) + " are needed, or twice as many and " +
               std::to_string(kSeenRowWords) + " a chunk that is seen");
  }
  if (g.drawn_chunks.size > g.all_chunks()) {
    return bad("drawn_chunks has " + std::to_string(g.drawn_chunks.size) + " chunks of " +
               std::to_string(g.all_chunks()));
  }
  if (!g.origin_ids.empty() && (g.origin_ids.size != g.size || g.origins.empty())) {
    return bad("origin_ids needs one id per Gaussian and a table of origins");
  }
  if (!(set.eps2d > 0) || !is_finite(set.eps2d)) {
    return bad("eps2d = " + std::to_string(set.eps2d) + ": must be positive");
  }
  if (!(set.base_eps2d >= 0 && set.base_eps2d <= set.eps2d)) {
    return bad("base_eps2d = " + std::to_string(set.base_eps2d) + ": must be in [0, eps2d]");
  }
  const Similarity& a = set.world_from_asset;
  if (!(a.scale > 0) || !is_finite(a.scale) || !is_finite(a.translation) ||
      !(abs(dot(a.rotation, a.rotation) - 1.0) < 1e-6)) {
    return bad("world_from_asset must have a unit quaternion, a positive scale and be finite");
  }
  return {};
}

}  // namespace gsnav
