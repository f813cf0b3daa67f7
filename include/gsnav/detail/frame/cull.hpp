// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/frame/projection.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

namespace detail {

/// Extremes of linear functions over a chunk's box of means, relative to a camera. Margins exceed all
/// rounding, also in float.
///
/// Let R be the largest |w| of a footprint in standard deviations, and L >= |(1, u)| for the u that the
/// Jacobian is limited to. A footprint's half-width is at most R (f sigma L / z + sqrt(h)). In pixels
/// times z, it reaches R f sigma L (`wide`) beyond its mean, and R sqrt(h) (`fixed`) pixels more.
struct ChunkInView {
  const ProjectionCamera<double>& camera;
  const ChunkBounds& bounds;
  Vec3d center, half;
  double size, slack;

  GSNAV_HD ChunkInView(const ProjectionCamera<double>& c, const ChunkBounds& b) noexcept
      : camera(c), bounds(b), center((b.low + b.high) * 0.5 - c.position), half((b.high - b.low) * 0.5) {
    // Bound of the float errors: means are rounded to 2e-6 m (offsets are at most 64 m), and the
    // camera's offset relatively.
    size = abs(center.x) + abs(center.y) + abs(center.z) + half.x + half.y + half.z;
    slack = 1e-6 * size + 1e-5;
  }
  GSNAV_HD double largest(const Vec3d& direction) const noexcept {
    return dot(direction, center) + abs(direction.x) * half.x + abs(direction.y) * half.y +
           abs(direction.z) * half.z;
  }
  /// The function of a side of the image, as a direction.
  GSNAV_HD Vec3d across(const ImageAxis& axis, const ImageSide<double>& side) const noexcept {
    return axis.normal(side, camera.rotation.row[2]);
  }
  GSNAV_HD double z_max() const noexcept { return largest(camera.rotation.row[2]) + slack; }
  GSNAV_HD double z_min() const noexcept {
    return max(-largest(-camera.rotation.row[2]) - slack, camera.near_plane / camera.scale);
  }
  /// |w|^2 at the edge of the largest footprint, in kernel units.
  GSNAV_HD double s_max() const noexcept {
    return opacity_excess(log2_of_opacity(static_cast<double>(bounds.opacity_max)),
                          camera.log2_alpha_min);
  }

  /// Reach of footprints beyond their means along one image axis: `wide` in pixels times depth, plus
  /// `fixed` in pixels.
  struct Reach {
    double wide, fixed;
  };
  GSNAV_HD Reach reach(double z_min, double s_max, const ImageAxis& axis) const noexcept {
    const double radius = footprint_radius(s_max);
    const double h = sqrt(camera.eps2d);
    const double reach = axis.f * bounds.scale_max * axis.slant();
    // At least the padding of splat_bounds: relative, plus 5e-7 of the aspect ratio, and absolute.
    const double pad = 1.002 + 5e-7 * (reach / (z_min * h) + 1);
    return {pad * radius * reach + 1e-5 * (axis.f + abs(axis.c) + axis.extent) * (size + slack),
            pad * radius * h + 0.01};
  }
};

}  // namespace detail

/// True if a Gaussian within the bounds may be visible (`Projected::visible`). Conservative: never false
/// if one is visible, and true if anything is not finite.
///
/// "Left of the image" is linear in the mean after multiplying by z (ImageSide). Such a function has its
/// maximum at a corner of the box.
/// @param s_max ChunkInView::s_max of the bounds, or of larger bounds that contain them
GSNAV_HD bool may_be_visible(const ProjectionCamera<double>& camera, const ChunkBounds& b,
                             double s_max) noexcept {
  const detail::ChunkInView chunk(camera, b);
  if (chunk.z_max() * camera.scale * (1 + 1e-6) <= camera.near_plane) return false;
  // the reach computed here does not bound other responses
  if (camera.response != Response::ewa) return true;
  const double z_min = chunk.z_min();
  if (s_max < -1e-5) return false;
  const auto outside = [&](const ImageAxis& axis) GSNAV_INLINED {
    const auto [wide, fixed] = chunk.reach(z_min, s_max, axis);
    return chunk.largest(chunk.across(axis, axis.first_side(fixed))) < -wide ||
           chunk.largest(chunk.across(axis, axis.last_side(fixed))) < -wide;
  };
  return !outside(camera.image_axis(0)) && !outside(camera.image_axis(1));
}

GSNAV_HD bool may_be_visible(const ProjectionCamera<double>& camera, const ChunkBounds& b) noexcept {
  return may_be_visible(camera, b, detail::ChunkInView(camera, b).s_max());
}

/// True if all means of a box are in front of the camera and inside the image. Testing its parts would
/// then skip little. The result affects speed only.
GSNAV_HD bool lies_in_view(const ProjectionCamera<double>& camera, const ChunkBounds& b) noexcept {
  const detail::ChunkInView chunk(camera, b);
  const auto inside = [&](const ImageAxis& axis) GSNAV_INLINED {
    return chunk.largest(-chunk.across(axis, axis.first_side(0))) <= 0 &&
           chunk.largest(-chunk.across(axis, axis.last_side(0))) <= 0;
  };
  return beyond_near_plane(camera.near_plane, -chunk.largest(-camera.rotation.row[2]) * camera.scale) &&
         inside(camera.image_axis(0)) && inside(camera.image_axis(1));
}

/// Bounds of the sort keys and footprints of a chunk, for one camera.
struct ChunkExtent {
  float nearest;          ///< lower bound of the sort keys
  double x0, y0, x1, y1;  ///< bounds of all footprints in pixels; may lie outside the image
};

/// Extent of a chunk for which may_be_visible() is true. Response::ewa only.
GSNAV_HD ChunkExtent chunk_extent(const ProjectionCamera<double>& camera,
                                  const ChunkBounds& b) noexcept {
  const detail::ChunkInView chunk(camera, b);
  const double z_min = chunk.z_min(), z_max = chunk.z_max(), s_max = chunk.s_max();
  ChunkExtent e;
  // A distance is at least z only if the view axis has unit length. A viewmat may deviate from that
  // within its tolerance.
  const double row =
      camera.sort_order == SortOrder::z_depth ? 1.0 : max(1.0, norm(camera.rotation.row[2]));
  e.nearest = static_cast<float>(z_min / row * camera.scale * (1 - 1e-6));
  const auto along = [&](const ImageAxis& axis, double& low, double& high) GSNAV_INLINED {
    const auto [wide, fixed] = chunk.reach(z_min, s_max, axis);
    const double left = -chunk.largest(axis.direction * -axis.f) - wide,
                 right = chunk.largest(axis.direction * axis.f) + wide;
    low = axis.c - fixed + left / (left < 0 ? z_min : z_max);
    high = axis.c + fixed + right / (right > 0 ? z_min : z_max);
  };
  along(camera.image_axis(0), e.x0, e.x1);
  along(camera.image_axis(1), e.y0, e.y1);
  return e;
}

/// Lower bound of the depths at which Gaussians of a chunk have an effect, metres: none reaches nearer
/// than the largest and most opaque one would.
/// @param e chunk_extent of the chunk
GSNAV_HD double nearest_reach(const ProjectionCamera<double>& camera, const ChunkBounds& b,
                              const ChunkExtent& e) noexcept {
  const double radius2 = footprint_radius2(detail::ChunkInView(camera, b).s_max() + 1e-5);
  const double reach = sqrt(max(radius2, 0.0)) * static_cast<double>(b.scale_max) * camera.scale;
  return static_cast<double>(e.nearest) * (1 - 1e-6) - reach * (1 + 1e-5);
}

}  // namespace gsnav
