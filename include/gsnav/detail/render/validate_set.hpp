// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <iterator>
#include <string>
#include <utility>

#include "gsnav/core/status.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

namespace detail {

/// Name of a packed array that does not fit the others, or null.
inline const char* wrong_packed(const GaussianRows& g) noexcept {
  const ShapeRows& shape = g.shape;
  const ColorRows& color = g.color;
  const std::size_t n = g.size();
  if (!shape.codes.empty()) {
    const bool means_are_floats = shape.codes.size == ShapeRows::kMeans * n && !shape.means.empty();
    if (shape.codes.size != ShapeRows::kCodePlanes * n && !means_are_floats) return "shape.codes";
    if (shape.chunks.size != g.chunk_count()) return "shape.chunks";
    if (!shape.axes.empty()) return "shape.codes (beside axes)";
  }
  if (!color.sh0_half.empty() && color.sh0_half.size != 3 * n) return "color.sh0_half";
  if (color.shN_codes.empty()) return nullptr;
  if (color.shN_codes.size != color.rest() * n) return "color.shN_codes";
  if (color.chunks.size != g.chunk_count()) return "color.chunks";
  if (color.sh0_half.empty()) return "color.shN_codes (without sh0_half)";
  return color.shN_half.empty() ? nullptr : "color.shN_codes (beside shN_half)";
}

}  // namespace detail

namespace detail {

/// Name of an array that is null but has a size, or null.
inline const char* null_array(const GaussianSet& set) noexcept {
  const GaussianRows& g = set.gaussians;
  const auto null = [](const auto& v) { return v.data == nullptr && v.size != 0; };
  const auto null_plane = [](const auto& planes) {
    for (std::size_t k = 0; k < std::size(planes.data); ++k) {
      if (planes.data[k] == nullptr && planes.size != 0) return true;
    }
    return false;
  };
  return null_plane(g.shape.means)          ? "shape.means"
         : null_plane(g.shape.quats)        ? "shape.quats"
         : null_plane(g.shape.scales)       ? "shape.scales"
         : null_plane(g.shape.axes)         ? "shape.axes"
         : null(g.shape.opacities)          ? "shape.opacities"
         : null(g.shape.origin_ids)         ? "shape.origin_ids"
         : null(g.shape.codes)              ? "shape.codes"
         : null(g.shape.chunks)             ? "shape.chunks"
         : null(g.color.sh0)                ? "color.sh0"
         : null(g.color.shN)                ? "color.shN"
         : null(g.color.shN_half)           ? "color.shN_half"
         : null(g.color.sh0_half)           ? "color.sh0_half"
         : null(g.color.shN_codes)          ? "color.shN_codes"
         : null(g.color.chunks)             ? "color.chunks"
         : null_plane(g.color.rotations)    ? "color.rotations"
         : null(g.color.chunk_degrees)      ? "color.chunk_degrees"
         : null(g.origins)                  ? "origins"
         : null(g.row_ids)                  ? "row_ids"
         : null(g.chunk_bounds)             ? "chunk_bounds"
         : null(g.part_bounds)              ? "part_bounds"
         : null(set.selection.drawn_chunks) ? "selection.drawn_chunks"
         : null(set.selection.seen)         ? "selection.seen"
                                            : nullptr;
}

/// Name of a group of planes with different lengths, or null.
inline const char* unequal_planes(const GaussianRows& g) noexcept {
  const auto unequal = [](const auto& planes) { return planes.size == planes.kUnequal; };
  return unequal(g.shape.means)       ? "shape.means"
         : unequal(g.shape.quats)     ? "shape.quats"
         : unequal(g.shape.scales)    ? "shape.scales"
         : unequal(g.shape.axes)      ? "shape.axes"
         : unequal(g.color.rotations) ? "color.rotations"
                                      : nullptr;
}

}  // namespace detail

/// Checks the sizes of a selection, for a set of `chunks` chunks.
inline Status validate(const Selection& selection, std::size_t chunks) {
  if (!selection.seen.empty() && !seen_may_have(selection.seen.size, chunks)) {
    return {Errc::invalid_argument,
            "GaussianSet: selection.seen has " + std::to_string(selection.seen.size) + " words where " +
                std::to_string(seen_chunk_words(chunks)) + " are needed, or twice that and " +
                std::to_string(kSeenRowWords) + " per visible chunk"};
  }
  if (selection.drawn_chunks.size > chunks) {
    return {Errc::invalid_argument, "GaussianSet: selection.drawn_chunks has " +
                                        std::to_string(selection.drawn_chunks.size) + " chunks of " +
                                        std::to_string(chunks)};
  }
  return {};
}

/// Checks a set against the assumptions of kernels.
/// @return invalid_argument naming the array or field.
inline Status validate(const GaussianSet& set) {
  const GaussianRows& g = set.gaussians;
  const ShapeRows& shape = g.shape;
  const ColorRows& color = g.color;
  const std::size_t n = g.size(), chunks = g.chunk_count();
  const BadArgument bad{"GaussianSet: "};
  const auto counted = [&](const char* name, std::size_t has, std::size_t wanted) {
    return has == wanted ? Status()
                         : bad(std::string(name) + " has " + std::to_string(has) + " values where " +
                               std::to_string(wanted) + " are needed");
  };
  if (set.filter > Filter::mip)
    return bad("filter = " + std::to_string(static_cast<int>(set.filter)) +
               ": must be a value of the enumeration");
  if (set.color_space > ColorSpace::linear) {
    return bad("color_space = " + std::to_string(static_cast<int>(set.color_space)) +
               ": must be a value of the enumeration");
  }
  if (color.degree < 0 || color.degree > kMaxShDegree) {
    return bad("color.degree = " + std::to_string(color.degree) + ": must be in [0, 3]");
  }
  const char* wrong = detail::null_array(set);
  if (wrong != nullptr) return bad(std::string(wrong) + " is null, with a size");
  wrong = detail::unequal_planes(g);
  if (wrong != nullptr) return bad(std::string(wrong) + " has arrays of different lengths");
  wrong = detail::wrong_packed(g);
  if (wrong != nullptr) {
    return bad(std::string(wrong) + " does not fit " + std::to_string(n) + " Gaussians of SH degree " +
               std::to_string(color.degree));
  }

  const bool packed = !shape.codes.empty(), has_axes = !shape.axes.empty();
  const bool packed_means = packed && shape.codes.size == ShapeRows::kCodePlanes * n;
  const std::size_t rest = color.rest() * n;
  const std::pair<const char*, std::array<std::size_t, 2>> lengths[] = {
      {"shape.means", {shape.means.size, packed_means ? 0 : n}},
      {"shape.scales", {shape.scales.size, has_axes || packed ? shape.scales.size : n}},
      {"shape.quats", {shape.quats.size, has_axes || packed ? shape.quats.size : n}},
      {"shape.axes", {shape.axes.size, has_axes ? n : 0}},
      {"shape.opacities", {shape.opacities.size, packed ? 0 : n}},
      {"color.rotations", {color.rotations.size, color.rotations.empty() ? 0 : n}},
      {"color.sh0", {color.sh0.size, color.sh0_half.empty() ? 3 * n : 0}},
      {"color.shN", {color.shN.size, color.shN_half.empty() && color.shN_codes.empty() ? rest : 0}},
      {"color.shN_half", {color.shN_half.size, color.shN_half.empty() ? 0 : rest}},
      {"color.chunk_degrees", {color.chunk_degrees.size, color.chunk_degrees.empty() ? 0 : chunks}},
      {"shape.origin_ids", {shape.origin_ids.size, shape.origin_ids.empty() ? 0 : n}},
      {"row_ids", {g.row_ids.size, g.row_ids.empty() ? 0 : n}},
      {"chunk_bounds", {g.chunk_bounds.size, g.chunk_bounds.empty() ? 0 : chunks}},
      {"part_bounds",
       {g.part_bounds.size, g.part_bounds.empty() ? 0 : (n + kChunkPart - 1) / kChunkPart}},
  };
  for (const auto& [name, length] : lengths) {
    if (Status s = counted(name, length[0], length[1]); !s) return s;
  }
  if (!shape.origin_ids.empty() && g.origins.empty()) return bad("shape.origin_ids needs origins");
  if (Status s = validate(set.selection, chunks); !s) return s;
  if (!(set.eps2d > 0) || !is_finite(set.eps2d)) {
    return bad("eps2d = " + std::to_string(set.eps2d) + ": must be positive");
  }
  if (!(set.base_eps2d >= 0 && set.base_eps2d <= set.eps2d)) {
    return bad("base_eps2d = " + std::to_string(set.base_eps2d) + ": must be in [0, eps2d]");
  }
  if (!is_valid(set.world_from_asset)) {
    return bad("world_from_asset must have a unit quaternion, a positive scale and be finite");
  }
  return {};
}

}  // namespace gsnav
