// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <functional>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Settings of build_visible_sets. Lengths are metres in the world. With the defaults, images of
/// Quality::fast keep the bounds of the profile `fast`, as measured with up to a million Gaussians
/// (docs/notes/lod.md).
struct VisibleSettings {
  double cell = 0.5;  ///< Side of a cell.
  /// A viewpoint counts for a cell if it is at most this far outside of it. With less than the side of a
  /// cell, single pixels are far off.
  double margin = 0.5;
  double min_weight = 1e-5;  ///< Least share of a pixel that a Gaussian must have to count as seen.
  /// Consecutive rows that are seen or not together: 1, 2, 4, 8, 16 or 32. 0: all rows of a chunk.
  int rows = 8;
  int face = 256;  ///< Pixels along a side of the six images that are rendered for each viewpoint.
  double near_plane =
      0.2;  ///< Near plane of these images. Chunks nearer to a cell than this are always in its set.
  double near_sigma = 0;  ///< Camera::near_sigma of these images.
  /// Largest mean share of the Gaussians that a cell may see, in (0, 1]. Above it, as in the open, sets
  /// gain nothing and build_visible_sets returns VisibleSets::refused_share and no cells. It decides
  /// early, on 16 cells spread evenly that are finished first. It never refuses at 1, nor with fewer
  /// than 64 cells.
  double most_share = 0.9;

  /// Recommended distance between viewpoints (navmesh_viewpoints). Each cell then has several, each with
  /// its own directions.
  double spacing() const noexcept { return 0.5 * cell; }
  /// Raises `face` where the camera needs more, and sets `near_plane` and `near_sigma`, so that the sets
  /// apply to this camera. Coarser images than the default miss gaps that small images show.
  void serve(const Camera& camera) noexcept {
    face = max(face, static_cast<int>(std::ceil(2 * max(camera.fx, camera.fy) - 1e-6)));
    near_plane = camera.near_plane;
    near_sigma = camera.near_sigma;
  }
  /// Called after each viewpoint with the share of the work that is done, in [0, 1], by the calling
  /// thread. Several threads look from several viewpoints first, and the calls for these come together.
  std::function<void(double)> progress{};
};

/// Returns invalid_argument naming the field that is out of range, or ok.
inline Status validate(const VisibleSettings& s) {
  const bool divides_word = s.rows >= 1 && s.rows <= 32 && 32 % s.rows == 0;
  detail::FieldCheck check("VisibleSettings.");
  check.positive("cell", s.cell).not_negative("margin", s.margin);
  check.need(s.min_weight >= 0 && s.min_weight < 1, "min_weight", s.min_weight, "must be in [0, 1)");
  check.need(s.rows == 0 || divides_word, "rows", s.rows, "must be 0, 1, 2, 4, 8, 16 or 32");
  check.in("face", s.face, 16, 4096);
  check.positive("near_plane", s.near_plane).not_negative("near_sigma", s.near_sigma);
  const bool share = s.most_share > 0 && s.most_share <= 1;
  return check.need(share, "most_share", s.most_share, "must be in (0, 1]").status();
}

}  // namespace gsnav
