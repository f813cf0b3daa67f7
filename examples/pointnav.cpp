// SPDX-License-Identifier: Apache-2.0
// PointNav among people: fifteen lines. usage: pointnav [device]
#include <cstdio>

#include "gsnav/demo.hpp"
#include "gsnav/device/simulator.hpp"
#include "gsnav/sim/follower.hpp"

int main(int argc, char** argv) {
  auto device = gsnav::Device::parse(argc > 1 ? argv[1] : "best").value();
  auto scene = gsnav::default_simulator_scene(3).value();
  auto episodes = gsnav::generate_episodes(*scene.navmesh, 3, 1).value();
  auto sim = gsnav::Simulator::create(device, scene, {.sensors = gsnav::rgbd_sensors(128, 128)}).value();
  gsnav::GeodesicFollower policy;
  for (const auto& episode : episodes) {
    auto obs = sim.reset(episode).value();
    while (!sim.done()) obs = sim.step(policy.next(sim.world())).value();  // obs["rgb"], obs["depth"]
    auto m = sim.metrics();
    std::printf("%s: success %d, SPL %.2f, CR %.2f, PSI %.3f\n", episode.id.c_str(), m.success, m.spl,
                m.collision_rate, m.psi);
  }
}
