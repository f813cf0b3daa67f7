// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "gsnav/math/mat.hpp"

namespace gsnav {

/// Pinhole camera: x right, y down, z forward (OpenCV). Pixel (column j, row i) has its centre at
/// (j + 0.5, i + 0.5); row 0 is the top. Always double: kernels get what they need in their scalar.
struct Camera {
  Affine3<double> viewmat{};      ///< world to camera, rigid
  double fx = 128, fy = 128;      ///< focal lengths in pixels, > 0
  double cx = 128, cy = 128;      ///< principal point in pixels, may be off-centre
  int width = 256, height = 256;  ///< Size of the image, pixels.
  double near_plane = 0.2;        ///< a Gaussian whose centre has z <= near_plane is not drawn; metres
  /// Additionally a Gaussian is not drawn where z <= near_sigma times its extent (one sigma) along the
  /// view axis. 0 for tools; 1 for simulator sensors, whose near plane is close to zero.
  double near_sigma = 0.0;

  /// Camera position in the world.
  Vec3d position() const noexcept { return rigid_inverse(viewmat).translation; }

  /// Sets square pixels from a horizontal field of view (degrees) and centres the principal point.
  Camera& set_hfov(int w, int h, double hfov_degrees) noexcept {
    width = w;
    height = h;
    fx = fy = 0.5 * w / std::tan(hfov_degrees * 3.14159265358979323846 / 360.0);
    cx = 0.5 * w;
    cy = 0.5 * h;
    return *this;
  }

  /// Camera at `eye` that looks at `target`, with `up` upwards in the image (not parallel to the view).
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
