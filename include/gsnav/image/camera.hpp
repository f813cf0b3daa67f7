// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "gsnav/math/mat.hpp"
#include "gsnav/math/similarity.hpp"

namespace gsnav {

/// Pinhole camera. Camera axes are x right, y down, z forward (OpenCV). The pixel in column j, row i has
/// its centre at (j + 0.5, i + 0.5); row 0 is the top. All values are double; kernels convert them to
/// their scalar type.
struct Camera {
  Affine3<double> viewmat{};  ///< world to camera, rigid, metres
  double fx = 128,            ///< horizontal focal length in pixels, > 0
      fy = 128;               ///< vertical focal length in pixels, > 0
  double cx = 128,            ///< column of the principal point in pixels; may be off-centre
      cy = 128;               ///< row of the principal point in pixels; may be off-centre
  int width = 256,            ///< image width in pixels
      height = 256;           ///< image height in pixels
  double near_plane = 0.2;    ///< Metres. A Gaussian whose centre has z <= near_plane is not drawn.
  /// Also skip a Gaussian whose centre has z <= near_sigma times its standard deviation along the view
  /// axis. Use 0 for tools, and 1 for simulator sensors, whose near plane is close to zero.
  double near_sigma = 0.0;

  /// Camera position in the world, metres.
  Vec3d position() const noexcept { return rigid_inverse(viewmat).translation; }
  /// Camera position in the frame of an asset that stands so in the world.
  Vec3d position_in(const Similarity& world_from_asset) const noexcept {
    return inverse(world_from_asset) * position();
  }

  /// Focal length in pixels of an image that is `w` pixels wide, by its horizontal field of view in
  /// degrees.
  static double focal_of_hfov(double w, double hfov_degrees) noexcept {
    return 0.5 * w / std::tan(hfov_degrees * std::numbers::pi / 360.0);
  }
  /// Sets a w x h image with square pixels, a horizontal field of view in degrees and a centred
  /// principal point.
  Camera& set_hfov(int w, int h, double hfov_degrees) noexcept {
    width = w;
    height = h;
    fx = fy = focal_of_hfov(w, hfov_degrees);
    cx = 0.5 * w;
    cy = 0.5 * h;
    return *this;
  }

  /// Camera at `eye` that looks at `target`. `up` points upwards in the image and must not be parallel
  /// to the view direction. Image size in pixels, field of view in degrees.
  static Camera look_at(const Vec3d& eye, const Vec3d& target, const Vec3d& up, int w, int h,
                        double hfov_degrees) noexcept {
    Camera c;
    c.set_hfov(w, h, hfov_degrees);
    const Vec3d forward = normalized(target - eye);
    const Vec3d right = normalized(cross(forward, up));
    const Vec3d down = cross(forward, right);
    c.viewmat.linear = {{right, down, forward}};
    c.viewmat.translation = -(c.viewmat.linear * eye);
    return c;
  }
};

}  // namespace gsnav
