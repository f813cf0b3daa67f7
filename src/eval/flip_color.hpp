// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/vec.hpp"

namespace gsnav::eval::detail {

// Colour spaces of FLIP. XYZ is relative to the white of sRGB, which is (1, 1, 1).

Vec3d xyz_from_linear(const Vec3d& rgb);
Vec3d linear_from_xyz(const Vec3d& xyz);
/// Opponent space of the contrast sensitivity filters. It is linear in XYZ.
Vec3d ycxcz_from_xyz(const Vec3d& xyz);
Vec3d xyz_from_ycxcz(const Vec3d& c);
/// CIELAB (CIE 15) with chroma scaled by L / 100, because differences of saturation are less visible in
/// the dark (Hunt).
Vec3d hunt_lab_from_xyz(const Vec3d& xyz);
/// Distance for large colour differences (Abasi et al. 2020): |dL| + |d(a, b)|.
double hyab(const Vec3d& a, const Vec3d& b);

}  // namespace gsnav::eval::detail
