// SPDX-License-Identifier: Apache-2.0
// Runs three PointNav episodes among people.
// usage: pointnav [DEVICE]
#include <cstdio>
#include <exception>

#include "gsnav/demo.hpp"
#include "gsnav/device/simulator.hpp"
#include "gsnav/sim/follower.hpp"

int main(int argc, char** argv) try {
  // [snippet: scene]
  auto device = gsnav::Device::parse(argc > 1 ? argv[1] : "best").value();
  auto scene = gsnav::default_simulator_scene(3).value();  // the embedded flat and three people
  // [/snippet]
  // [snippet: simulator]
  auto episodes = gsnav::generate_episodes(*scene.navmesh, 3, 1).value();  // three, from seed 1
  auto sim = gsnav::Simulator::create(device, scene, {.sensors = gsnav::rgbd_sensors(128, 128)}).value();
  // [/snippet]
  // [snippet: episodes]
  gsnav::GeodesicFollower policy;  // follows the shortest path and waits for people
  for (const auto& episode : episodes) {
    auto obs = sim.reset(episode).value();
    while (!sim.done()) obs = sim.step(policy.next(sim.world())).value();  // obs["rgb"], obs["depth"]
    auto m = sim.metrics();
    std::printf("%s: success %d, SPL %.2f, CR %.2f, PSI %.3f\n", episode.id.c_str(), m.success, m.spl,
                m.collision_rate, m.psi);
  }
  // [/snippet]
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
