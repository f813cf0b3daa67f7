# SPDX-License-Identifier: Apache-2.0
"""Measures what docs/guide/scale_out.md calculates with: memory, sizes of messages, and the time of the driver.

usage: unit_costs.py; needs Linux, and ray for the last row
"""

import os
import pickle
import sys
import time

import numpy as np

import gsnav
import gsnav.ray


def megabytes():
    """Memory of this process that is in use."""
    with open("/proc/self/statm") as f:
        return int(f.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def row(name, value, unit):
    print(f"{name:56} {value:10.3g} {unit}", flush=True)


def cpu_seconds(function, repeats):
    """Seconds of all threads of this process, so that other programs do not count."""
    start = time.process_time()
    for _ in range(repeats):
        function()
    return (time.process_time() - start) / repeats


def forward_maker(envs):
    return lambda observations, playing: [1] * envs.num_envs


def in_child(function, *arguments):
    """Runs function in a new process, because freed memory would hide later growth."""
    call = f"import unit_costs; unit_costs.{function}(*{arguments!r})"
    # The child, and actors of Ray that it starts, import this file from any working directory.
    paths = [os.path.dirname(os.path.abspath(__file__)), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    if os.spawnve(os.P_WAIT, sys.executable, [sys.executable, "-c", call], environment) != 0:
        sys.exit(f"unit_costs.py: {function}{arguments} failed")


def scenes(density):
    start, before = time.process_time(), megabytes()
    opened = gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto", density=density))
    row(f"scene of {opened.gaussian_count} Gaussians, NavMesh included", megabytes() - before, "MB")
    row("... to make it and its NavMesh, CPU", time.process_time() - start, "s")


def environments(side):
    scene = gsnav.default_simulator_scene(people=3, seed=1, density=0.05)
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(side, side))
    used = []
    for count in (4, 132):
        envs = gsnav.VectorEnv(count, scene, config=config, copy=False)
        envs.reset(seed=1)
        envs.step(np.ones(count, int))
        used.append(megabytes())
    row(f"environment, {side} x {side} RGB-D", (used[1] - used[0]) / 128, "MB")
    row("... of that, its observation", side * side * 16 / 1e6, "MB")


def messages():
    scene = gsnav.default_simulator_scene(people=3, seed=1, density=0.05)
    episodes = gsnav.generate_episodes(scene.navmesh, 64, 1)
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(8, 8), task=gsnav.TaskConfig(max_steps=100))
    workers = gsnav.ray.Workers(scene, actors=0, environments=16, config=config)
    rollouts = list(workers.rollouts(episodes, forward_maker))
    row("episode, sent to an actor", len(pickle.dumps(list(enumerate(episodes)))) / 64, "bytes")
    result = pickle.dumps(rollouts)
    row("rollout of 100 actions without observations, sent back", len(result) / 64, "bytes")
    row("line of a journal", sum(len(gsnav.ray._journal.line(r)) + 1 for r in rollouts) / 64, "bytes")

    def receive():
        for rollout in pickle.loads(result):
            gsnav.ray._journal.line(rollout)

    row("driver: an episode", cpu_seconds(receive, 20) / 64 * 1e6, "us")


def calls():
    try:
        import ray
    except ImportError:
        print("driver: a call of an actor: needs ray, which is not installed")
        return
    ray.init(log_to_driver=False, logging_level="ERROR")
    player = ray.remote(gsnav.ray.Player).options(num_cpus=1).remote(4, "default", {})
    ray.get(player.ready.remote())
    row("driver: a call of an actor", cpu_seconds(lambda: ray.get(player.__ray_call__.remote(len_of)), 300) * 1e6, "us")


def len_of(player):
    return len(player._piece)


if __name__ == "__main__":
    row("process with gsnav and its numpy", megabytes(), "MB")
    for density in (0.3, 3.0):
        in_child("scenes", density)
    for side in (64, 128, 256):
        in_child("environments", side)
    in_child("messages")
    in_child("calls")
