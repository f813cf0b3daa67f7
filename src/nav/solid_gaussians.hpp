// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "gaussian_voxels.hpp"
#include "gsnav/detail/frame/set_rows.hpp"

// Steps from a scene's Gaussians to its solid voxels.

namespace gsnav::detail::solids {

/// An opaque Gaussian in world coordinates.
struct Solid {
  Vec3d mean;
  Mat3d axes;  // Columns: principal axes times standard deviations.
  double opacity;
};

/// A set with the transform of its Gaussians.
struct PlacedSet {
  const GaussianSet* set = nullptr;
  Mat3d placed{};
  explicit PlacedSet(const GaussianSet& s)
      : set(&s), placed(rotation_matrix(s.world_from_asset.rotation) * s.world_from_asset.scale) {}

  /// Reads a Gaussian. Returns false if its opacity is below `min_opacity` or a value is not finite.
  bool read(std::size_t i, double min_opacity, Solid& s) const {
    const ShapeRows& g = set->gaussians.shape;
    s.opacity = static_cast<double>(opacity_of(g, i));
    const Vec3d mean = set->gaussians.origin_of(i) + vec_cast<double>(mean_of(g, i));
    s.mean = set->world_from_asset * mean;
    if (!(s.opacity >= min_opacity) || !is_finite(s.mean)) return false;
    const Vec3d scales = vec_cast<double>(scales_of(g, i));
    s.axes = placed * rotation_matrix(quat_cast<double>(quat_of(g, i)));
    for (int k = 0; k < 3; ++k) {
      for (int r = 0; r < 3; ++r) s.axes(r, k) *= scales[k];
    }
    return true;
  }
};

template <class F>
void for_each_opaque(std::span<const GaussianSet> sets, double min_opacity, std::size_t& faint, F&& f) {
  for (const GaussianSet& set : sets) {
    const PlacedSet placed(set);
    Solid s;
    for (std::size_t i = 0; i < set.gaussians.size(); ++i) {
      if (placed.read(i, min_opacity, s)) {
        f(s);
      } else {
        ++faint;
      }
    }
  }
}

inline bool inside(const Aabb<double>& box, const Vec3d& p) noexcept {
  for (int k = 0; k < 3; ++k) {
    if (p[k] < box.low[k] || p[k] > box.high[k]) return false;
  }
  return true;
}

/// Box of the heaviest connected part of the scene and of every part with at least a tenth of its mass.
/// Outliers and a distant sky are separate parts.
Aabb<double> scene_box(std::span<const GaussianSet> sets, const GaussianNavOptions& options);

/// Fills `g.runs`.
/// @return out_of_memory.
Status rasterise_tiles(VoxelGrid& g, std::span<const GaussianSet> sets, const GaussianNavOptions& o,
                       ThreadPool& pool, GaussianNavReport& report);

}  // namespace gsnav::detail::solids
