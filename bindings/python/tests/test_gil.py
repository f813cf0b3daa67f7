# SPDX-License-Identifier: Apache-2.0
"""Calls of more than 50 us let other threads run."""

import subprocess
import sys

TURNS = """
import sys, threading, time
import numpy as np
import gsnav
scene = gsnav.default_simulator_scene(people=8, density=0.05)
episode = gsnav.generate_episodes(scene.navmesh, 1, 1)[0]
start, goal = episode.start_position, episode.goal_position
simulator = gsnav.Simulator("serial", scene, gsnav.SimulatorConfig(sensors=[]))
simulator.reset(episode)
tracker = gsnav.AvatarTracker(scene)
rows = [[0.0, 0, 0, 0, 1, 0, 0.1]] * 500
metrics = [gsnav.EpisodeMetrics()] * 5000
x, z = (c.ravel() for c in np.meshgrid(np.arange(300.0), np.arange(300.0)))
vertices, triangles = np.stack([x, 0 * x, z], 1), np.zeros((10**6, 3), np.uint32)
def refused():
    try:
        gsnav.NavMesh.build(gsnav.NavMeshSettings(cell_size=-1), vertices, triangles)
    except gsnav.InvalidArgument:
        pass
calls = {"set_agent": lambda: simulator.set_agent(start, 0.0), "move": lambda: tracker.move(start, goal, 0.0, 1.0),
         "capsules": lambda: tracker.capsules(0.5), "set_capsules": lambda: tracker.set_capsules(rows),
         "distance": lambda: tracker.distance(start, 0.5), "summarize": lambda: gsnav.summarize(metrics),
         "surface": scene.navmesh.surface, "build": refused}
turns = 0
def count():
    global turns
    while True:
        turns += 1
        time.sleep(0)
sys.setswitchinterval(1000)  # the other thread runs only where a call releases the lock
threading.Thread(target=count, daemon=True).start()
for name, call in calls.items():
    before, end = turns, time.monotonic() + 10
    while turns == before and time.monotonic() < end:
        call()
    print(name, "released" if turns != before else "held", flush=True)
"""


def test_short_calls_release_the_interpreter():
    run = subprocess.run([sys.executable, "-c", TURNS], capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    lines = run.stdout.splitlines()
    assert len(lines) == 8 and all(line.endswith(" released") for line in lines), run.stdout
