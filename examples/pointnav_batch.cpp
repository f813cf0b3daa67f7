// SPDX-License-Identifier: Apache-2.0
// Runs PointNav episodes in sixteen environments that share one scene.
// usage: pointnav_batch [DEVICE]
#include <cstdio>
#include <exception>

#include "gsnav/demo.hpp"
#include "gsnav/device/simulator.hpp"
#include "gsnav/sim/follower.hpp"

int main(int argc, char** argv) try {
  // [snippet: create]
  auto device = gsnav::Device::parse(argc > 1 ? argv[1] : "best").value();
  auto scene =
      std::make_shared<const gsnav::SimulatorScene>(gsnav::default_simulator_scene(3, 1, 0.2).value());
  auto episodes = gsnav::generate_episodes(*scene->navmesh, 64, 1).value();
  // Episode k of environment e. Each environment goes on with its next one by itself.
  auto episode_of = [&](std::size_t e, std::size_t k) -> gsnav::Result<gsnav::BatchEpisode> {
    return gsnav::BatchEpisode{0, episodes[(16 * k + e) % 64]};
  };
  auto sim = gsnav::BatchSimulator::create(device, {scene}, {{.sensors = gsnav::rgbd_sensors(64, 64)}},
                                           16, episode_of)
                 .value();
  // [/snippet]
  // [snippet: step]
  gsnav::GeodesicFollower policy;
  auto out = sim.reset().value();
  std::vector<gsnav::EpisodeMetrics> ended;
  for (int i = 0; i < 60; ++i) {
    std::vector<gsnav::Action> actions;
    for (std::size_t e = 0; e < 16; ++e) actions.push_back(policy.next(sim.world(e)));
    out = sim.step(actions).value();  // out["rgb"].data: [16][64][64][3]; out.rewards[e]
    ended.insert(ended.end(), out.final_metrics.begin(), out.final_metrics.end());
  }
  // [/snippet]
  std::printf("%zu episodes, SR %.2f\n", ended.size(), gsnav::summarize(ended).success_rate);
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
