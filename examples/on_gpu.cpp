// SPDX-License-Identifier: Apache-2.0
// Renders sixteen environments and leaves their images in the memory of the GPU.
// usage: on_gpu [DEVICE]
#include <cstdio>
#include <exception>
#include <memory>

#include "gsnav/demo.hpp"
#include "gsnav/device/simulator.hpp"

int main(int argc, char** argv) try {
  // [snippet: device]
  auto device = gsnav::Device::parse(argc > 1 ? argv[1] : "cuda");
  if (!device) {  // the message lists the devices of this build and machine
    std::printf("skipped: %s\n", device.message().c_str());
    return 77;
  }
  // [/snippet]
  auto scene =
      std::make_shared<const gsnav::SimulatorScene>(gsnav::default_simulator_scene(3, 1, 0.2).value());
  auto episodes = gsnav::generate_episodes(*scene->navmesh, 16, 1).value();
  // [snippet: batch]
  gsnav::BatchConfig config;
  config.sensors = gsnav::rgbd_sensors(64, 64);
  config.images = gsnav::ImageMemory::backend;
  auto episode_of = [&](std::size_t e, std::size_t) { return gsnav::BatchEpisode{0, episodes[e]}; };
  auto sim = gsnav::BatchSimulator::create(*device, {scene}, config, 16, episode_of).value();
  auto out = sim.reset().value();
  for (int i = 0; i < 10; ++i) {
    std::vector<gsnav::Action> actions(sim.environments(), gsnav::Action::turn_left);
    out = sim.step(actions).value();
  }
  // [16][64][64][3] floats: rgb.on_backend points to GPU memory; on a CPU the images are in rgb.data.
  const gsnav::BatchObservation& rgb = out["rgb"];
  // [/snippet]
  std::printf("%s: %zu images, %s\n", device->description().c_str(), rgb.environments,
              rgb.on_backend != nullptr ? "in the device's memory" : "in host memory");
  return (rgb.on_backend != nullptr) == (device->kind() == gsnav::DeviceKind::cuda) ? 0 : 1;
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
