// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

#include "canvas.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/capsule.hpp"

namespace gsnav_tools {

/// A view to draw on: the picture, its camera and its depth [H][W] (metres, 0: nothing there).
struct DrawnView {
  Canvas& canvas;
  const gsnav::Camera& camera;
  std::span<const float> depth;
};

/// Edges of triangles within `reach` metres, where nothing of the scene is nearer.
void draw_navmesh(const DrawnView& view, std::span<const std::array<gsnav::Vec3d, 3>> triangles,
                  double reach = 8.0);

/// A capsule where nothing of the scene is clearly nearer.
void draw_capsule(const DrawnView& view, const gsnav::Capsule<double>& capsule, Rgb color, float alpha);

/// Capsules, each in its avatar's colour, where nothing of the scene is clearly nearer.
void draw_capsules(const DrawnView& view, std::span<const gsnav::DynamicCapsule> bodies);

}  // namespace gsnav_tools
