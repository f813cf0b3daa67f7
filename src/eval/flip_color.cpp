// SPDX-License-Identifier: Apache-2.0
#include "flip_color.hpp"

#include <cmath>

#include "gsnav/math/mat.hpp"

namespace gsnav::eval::detail {
namespace {

/// XYZ with Y = 1 for a chromaticity.
Vec3d from_chromaticity(double x, double y) { return {x / y, 1.0, (1.0 - x - y) / y}; }

/// Matrix from linear sRGB to XYZ divided by the XYZ of white, from the primaries and the D65 white of
/// IEC 61966-2-1.
Mat3d make_matrix() {
  const Mat3d primaries = transpose(Mat3d{
      {from_chromaticity(0.64, 0.33), from_chromaticity(0.30, 0.60), from_chromaticity(0.15, 0.06)}});
  const Vec3d white = from_chromaticity(0.3127, 0.3290);
  const Vec3d strength = inverse(primaries) * white;
  Mat3d m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m(i, j) = primaries(i, j) * strength[j] / white[i];
  }
  return m;
}

struct Matrices {
  Mat3d xyz_from_linear = make_matrix();
  Mat3d linear_from_xyz = inverse(xyz_from_linear);
};

// A function-local static, so that it is initialized before any static of another file uses it.
const Matrices& matrices() {
  static const Matrices m;
  return m;
}

/// Cube root, continued by its tangent below (6/29)^3.
double lab_curve(double t) {
  constexpr double d = 6.0 / 29.0;
  return t > d * d * d ? std::cbrt(t) : t / (3.0 * d * d) + 4.0 / 29.0;
}

}  // namespace

Vec3d xyz_from_linear(const Vec3d& rgb) { return matrices().xyz_from_linear * rgb; }
Vec3d linear_from_xyz(const Vec3d& xyz) { return matrices().linear_from_xyz * xyz; }

Vec3d ycxcz_from_xyz(const Vec3d& v) {
  return {116.0 * v[1] - 16.0, 500.0 * (v[0] - v[1]), 200.0 * (v[1] - v[2])};
}

Vec3d xyz_from_ycxcz(const Vec3d& c) {
  const double y = (c[0] + 16.0) / 116.0;
  return {y + c[1] / 500.0, y, y - c[2] / 200.0};
}

Vec3d hunt_lab_from_xyz(const Vec3d& v) {
  const double x = lab_curve(v[0]), y = lab_curve(v[1]), z = lab_curve(v[2]);
  const double lightness = 116.0 * y - 16.0;
  return {lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)};
}

double hyab(const Vec3d& a, const Vec3d& b) {
  return std::fabs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

}  // namespace gsnav::eval::detail
