// SPDX-License-Identifier: Apache-2.0
// Renders an image and a depth map of a scene.
// usage: render_scan [SCENE [DEVICE]]; writes rgb.png and depth.png
#include <cstdio>

#include "gsnav/device/renderer.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/open.hpp"

int main(int argc, char** argv) try {
  // [snippet: open]
  auto device = gsnav::Device::parse(argc > 2 ? argv[2] : "best").value();
  auto scene = gsnav::open_scene(argc > 1 ? argv[1] : "default").value();  // PLY, SOG, SPZ, glTF, ...
  // [/snippet]
  // [snippet: render]
  auto camera = gsnav::framing_camera(scene, 640, 480).value();
  auto renderer = gsnav::Renderer::create(device, scene.scene).value();
  auto frames = renderer.render(camera).value();  // rgb [480][640][3]; median_depth [480][640], metres
  // [/snippet]
  // [snippet: save]
  auto depth = gsnav::io::colorize_depth(frames.median_depth, 0, 8);  // bright at 0 m, dark at 8 m
  gsnav::io::save_png_rgb("rgb.png", frames.rgb, 640, 480).throw_if_error();
  gsnav::io::save_png_rgb8("depth.png", depth, 640, 480).throw_if_error();
  // [/snippet]
  std::printf("%s on %s\n", scene.name.c_str(), device.description().c_str());
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
