// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

#include "canvas.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/capsule.hpp"

namespace gsnav_tools {

/// A view to draw on: picture, camera and depth, shape [H][W], metres. 0: nothing there.
struct DrawnView {
  Canvas& canvas;
  const gsnav::Camera& camera;
  std::span<const float> depth;
};

/// Draws the edges of triangles within `reach` metres where the scene does not hide them.
void draw_navmesh(const DrawnView& view, std::span<const std::array<gsnav::Vec3d, 3>> triangles,
                  double reach = 8.0);

/// Draws a capsule where the scene is not clearly nearer.
void draw_capsule(const DrawnView& view, const gsnav::Capsule<double>& capsule, Rgb color, float alpha);

/// Draws capsules, each in the colour of its avatar, where the scene is not clearly nearer.
void draw_capsules(const DrawnView& view, std::span<const gsnav::DynamicCapsule> bodies);

}  // namespace gsnav_tools
