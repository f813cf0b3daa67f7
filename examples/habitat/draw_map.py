# SPDX-License-Identifier: Apache-2.0
"""Draws an agent of Habitat-Lab halfway to its goal: what it sees, and where it is. Run it in the folder of its data.

usage: draw_map.py OUT.png [EPISODE]
"""
import sys

import habitat
import imageio.v2
from habitat.config import read_write
from habitat.config.default_structured_configs import TopDownMapMeasurementConfig
from habitat.tasks.nav.shortest_path_follower import ShortestPathFollower
from habitat.utils.visualizations.utils import observations_to_image

config = habitat.get_config("benchmark/nav/pointnav/pointnav_habitat_test.yaml")
with read_write(config):
    config.habitat.task.measurements.top_down_map = TopDownMapMeasurementConfig()
with habitat.Env(config) as env:
    env.episodes = [env.episodes[int(sys.argv[2]) if len(sys.argv) > 2 else 0]]
    follower = ShortestPathFollower(env.sim, 0.2, return_one_hot=False)
    seen = env.reset()
    half = env.get_metrics()["distance_to_goal"] / 2
    while env.get_metrics()["distance_to_goal"] > half:
        seen = env.step(follower.get_next_action(env.current_episode.goals[0].position))
    imageio.v2.imwrite(sys.argv[1], observations_to_image(seen, env.get_metrics()))
