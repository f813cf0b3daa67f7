# SPDX-License-Identifier: Apache-2.0
"""Walks among people and reports how near the agent came to them. usage: people.py [PEOPLE]"""

import sys

import gsnav


def main(people: int = 3) -> None:
    # [snippet: people]
    task = gsnav.TaskConfig.avatar_pointnav()
    scene = gsnav.default_simulator_scene(people=people, seed=1, density=0.2, task=task)
    assert scene.navmesh is not None
    episode = gsnav.generate_episodes(scene.navmesh, 1, 1)[0]
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(64, 64), task=task)
    simulator = gsnav.Simulator("best", scene, config)
    policy = gsnav.GeodesicFollower()  # follows the shortest path and gives way
    observations = simulator.reset(episode)
    while not simulator.done:
        observations = simulator.step(policy.next(simulator.world))
    metrics = simulator.metrics()
    # [/snippet]
    print(f"success {metrics.success}, nearest person {metrics.min_clearance:.2f} m away, "
          f"steps with a collision {100 * metrics.collision_rate:.0f} %, goal {observations.point_goal.distance:.2f} m")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
