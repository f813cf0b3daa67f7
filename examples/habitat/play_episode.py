# SPDX-License-Identifier: Apache-2.0
"""Plays an episode of Habitat-Lab along the shortest path. Run it in the folder of its data."""
# [snippet: play]
import habitat
from habitat.tasks.nav.shortest_path_follower import ShortestPathFollower

config = habitat.get_config("benchmark/nav/pointnav/pointnav_habitat_test.yaml")
with habitat.Env(config) as env:
    follower = ShortestPathFollower(env.sim, 0.2, return_one_hot=False)
    env.reset()
    while not env.episode_over:
        env.step(follower.get_next_action(env.current_episode.goals[0].position))
    print(env.get_metrics())
# [/snippet]
