// SPDX-License-Identifier: Apache-2.0
// An image of a scene. usage: embed [device]
#include <cstdio>

#include "gsnav/demo.hpp"
#include "gsnav/device/renderer.hpp"

int main(int argc, char** argv) {
  auto device = gsnav::Device::parse(argc > 1 ? argv[1] : "best").value();
  auto scene = gsnav::make_default_scene(0.2).value();  // or gsnav::io::load_scene("flat.ply").value()
  auto view = gsnav::default_scene_views()[0];
  auto camera = gsnav::Camera::look_at(view.eye, view.target, {0, 1, 0}, 256, 256, 90);
  auto renderer = gsnav::Renderer::create(device, scene.cloud).value();
  auto frames = renderer.render(camera).value();  // rgb [256][256][3], median_depth [256][256]
  std::size_t center = 128 * 256 + 128;
  std::printf("%zu Gaussians; the centre pixel is %.2f m away\n", scene.cloud.size(),
              frames.median_depth[center]);
  return frames.median_depth[center] > 0 ? 0 : 1;
}
