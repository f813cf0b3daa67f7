// SPDX-License-Identifier: Apache-2.0
// Calls three kernels without linking a library: SH colour, a capsule sweep and linear blend skinning.
// usage: one_kernel
#include <cstdio>

#include "gsnav/frame/sh.hpp"
#include "gsnav/skin/lbs.hpp"
#include "gsnav/sweep/capsule.hpp"

int main() {
  using gsnav::Vec3d;

  // [snippet: sh]
  // Spherical harmonics of degree 1 give the colour of a Gaussian seen along +z.
  const Vec3d sh[4] = {{1, 1, 1}, {0, 0, 0}, {0.5, 0, -0.5}, {0, 0, 0}};
  const Vec3d color = gsnav::sh_color(1, Vec3d{0, 0, 1}, [&](int k) { return sh[k]; });
  std::printf("color %.4f %.4f %.4f\n", color.x, color.y, color.z);
  // [/snippet]

  // [snippet: sweep]
  // A capsule sweep finds when an agent, walking 2 m along x, meets a pillar.
  const gsnav::Capsule<double> start{{0, 0.2, 0}, {0, 1.6, 0}, 0.2}, end{{2, 0.2, 0}, {2, 1.6, 0}, 0.2};
  const gsnav::Capsule<double> pillar{{1, 0, 0}, {1, 2, 0}, 0.3};
  const gsnav::MovingCapsule<double> agent{start, end}, obstacle{pillar, pillar};
  const auto impact = gsnav::sweep(agent, obstacle);
  std::printf("hit %d after %.3f m\n", impact.hit, 2 * impact.time);
  // [/snippet]

  // [snippet: skin]
  // Linear blend skinning moves a Gaussian that two joints share; one turns by 90 degrees about z.
  const gsnav::Affine3<double> joints[2] = {
      {}, {gsnav::rotation_matrix(gsnav::axis_angle(Vec3d{0, 0, 1}, 1.5707963267948966)), {}}};
  const gsnav::SkinRow<4> row{{0, 1}, {32768, 32767}, {1, 0, 0}, {1, 0, 0, 0}};
  const auto skinned = gsnav::skin_row<double>(
      row, [&](int j) -> const gsnav::Affine3<double>& { return joints[j]; }, false);
  std::printf("mean %.4f %.4f %.4f, turned by quaternion %.4f 0 0 %.4f\n", skinned.mean.x,
              skinned.mean.y, skinned.mean.z, skinned.quat.w, skinned.quat.z);
  // [/snippet]
}
