// SPDX-License-Identifier: Apache-2.0
// Steps a BatchSimulator without Python, as the truth for the bits and the speed of the Python package.
// usage: gsnav_python_reference ENVIRONMENTS SIDE STEPS DENSITY [rgbd|depth [DEVICE]]
// It prints a hash of the images of the last step. On a GPU, images stay there, and the hash is 0.
// If STEPS is 0, it reads numbers of steps from standard input, and answers each with ms per step.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <memory>
#include <string_view>
#include <vector>

#include "gsnav/demo.hpp"
#include "gsnav/device/simulator.hpp"

namespace {

std::uint64_t hash(std::uint64_t h, std::span<const float> values) {
  for (const float v : values) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &v, sizeof bits);
    h = (h ^ bits) * 0x100000001b3ull;
  }
  return h;
}

/// A simulator, and the number of its last step.
struct Run {
  gsnav::BatchSimulator sim;
  std::size_t environments = 0, i = 0;
  gsnav::BatchStep out;

  /// Milliseconds per step of `count` steps.
  double step(int count) {
    std::chrono::duration<double, std::milli> took{};
    for (int k = 0; k < count; ++k, ++i) {
      std::vector<gsnav::Action> actions;
      for (std::size_t e = 0; e < environments; ++e) {
        actions.push_back(static_cast<gsnav::Action>(1 + (e + i) % 3));
      }
      const auto start = std::chrono::steady_clock::now();
      out = sim.step(actions).value();
      took += std::chrono::steady_clock::now() - start;
    }
    return took.count() / count;
  }
};

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 5 || argc > 7) {
    std::fprintf(stderr, "usage: %s ENVIRONMENTS SIDE STEPS DENSITY [rgbd|depth [DEVICE]]\n", argv[0]);
    return 2;
  }
  const auto environments = static_cast<std::size_t>(std::atoi(argv[1]));
  const int side = std::atoi(argv[2]), steps = std::atoi(argv[3]);
  auto scene = std::make_shared<const gsnav::SimulatorScene>(
      gsnav::default_simulator_scene(0, 1, std::atof(argv[4])).value());
  const auto episodes = gsnav::generate_episodes(*scene->navmesh, 1, 1).value();
  gsnav::BatchConfig config;
  config.sensors = gsnav::rgbd_sensors(side, side);
  if (argc > 5 && std::string_view(argv[5]) == "depth") config.sensors.erase(config.sensors.begin());
  const auto device = gsnav::Device::parse(argc > 6 ? argv[6] : "cpu").value();
  const bool on_gpu = device.kind() == gsnav::DeviceKind::cuda;
  if (on_gpu) config.images = gsnav::ImageMemory::backend;
  Run run{
      gsnav::BatchSimulator::create(device, {scene}, config, environments,
                                    [&](std::size_t, std::size_t) -> gsnav::Result<gsnav::BatchEpisode> {
                                      return gsnav::BatchEpisode{0, episodes[0]};
                                    })
          .value(),
      environments,
      0,
      {}};
  run.out = run.sim.reset().value();
  if (steps == 0) {
    for (int count = 0; std::cin >> count && count > 0;) {
      std::printf("%.5f\n", run.step(count));
      std::fflush(stdout);
    }
    return 0;
  }
  run.step(steps);
  std::uint64_t h = 0xcbf29ce484222325ull;
  for (const gsnav::BatchObservation& image : run.out.images) h = on_gpu ? 0 : hash(h, image.data);
  std::printf("%016llx\n", static_cast<unsigned long long>(h));
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
