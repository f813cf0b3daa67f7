// SPDX-License-Identifier: Apache-2.0
// Renders eight images of people who walk through the embedded flat.
// usage: people [DEVICE]; writes people_0.png to people_7.png
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "gsnav/demo.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/io.hpp"

int main(int argc, char** argv) try {
  // [snippet: people]
  auto device = gsnav::Device::parse(argc > 1 ? argv[1] : "best").value();
  auto scene =
      std::make_shared<const gsnav::SimulatorScene>(gsnav::default_simulator_scene(5, 1, 0.2).value());
  auto view = gsnav::default_scene_views()[0];
  auto camera = gsnav::Camera::look_at(view.eye, view.target, {0, 1, 0}, 320, 240, 90);
  auto renderer = gsnav::Renderer::create(device, scene).value();
  gsnav::Frames<float> frames;  // reused, so that later frames allocate nothing
  for (int k = 0; k < 8; ++k) {
    const double time = 0.5 * k;  // seconds on the scene's clock
    renderer.render({&camera, 1}, frames, time).throw_if_error();
    auto name = "people_" + std::to_string(k) + ".png";
    gsnav::io::save_png_rgb(name, frames.rgb, 320, 240).throw_if_error();
    std::printf("%s: people at", name.c_str());
    for (const gsnav::AvatarActor& person : scene->avatars) {
      gsnav::Vec3d at = person.placement(time).translation;
      std::printf(" (%.2f, %.2f)", at.x, at.z);  // x and z, metres
    }
    std::printf("\n");
  }
  // [/snippet]
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
