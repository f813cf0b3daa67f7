// SPDX-License-Identifier: Apache-2.0
// Steps a BatchSimulator without Python, as the truth for the bits and the speed of the Python package.
// usage: gsnav_python_reference ENVIRONMENTS SIDE STEPS DENSITY [rgbd|depth [DEVICE]]
// It prints a hash of the images of the last step, and ms per step after the first five, which allocate
// memory. On a GPU, images stay there, and the hash is 0.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
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
  auto sim =
      gsnav::BatchSimulator::create(device, {scene}, config, environments,
                                    [&](std::size_t, std::size_t) -> gsnav::Result<gsnav::BatchEpisode> {
                                      return gsnav::BatchEpisode{0, episodes[0]};
                                    })
          .value();
  gsnav::BatchStep out = sim.reset().value();
  std::uint64_t h = 0xcbf29ce484222325ull;
  constexpr int kWarmUp = 5;
  double seconds = 0;
  for (int i = 0; i < steps; ++i) {
    std::vector<gsnav::Action> actions;
    for (std::size_t e = 0; e < environments; ++e) {
      actions.push_back(static_cast<gsnav::Action>(1 + (e + static_cast<std::size_t>(i)) % 3));
    }
    const auto start = std::chrono::steady_clock::now();
    out = sim.step(actions).value();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    if (i >= kWarmUp) seconds += took.count();
  }
  for (const gsnav::BatchObservation& image : out.images) h = on_gpu ? 0 : hash(h, image.data);
  std::printf("%016llx %.4f\n", static_cast<unsigned long long>(h),
              1000 * seconds / std::max(1, steps - kWarmUp));
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
