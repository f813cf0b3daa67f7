# SPDX-License-Identifier: Apache-2.0
"""Objects that refer to each other in a circle are freed, and nothing is left at exit."""

import gc
import os
import subprocess
import sys
import weakref

import numpy as np
import pytest

import gsnav


class Owner:
    """Owns a simulator, gives it episodes, and keeps what it returned."""

    def __init__(self, scene, keep, copy=False, images=False):
        self.episodes = gsnav.generate_episodes(scene.navmesh, 2, 1)
        settings = {"image_source": self.memory} if images else {"copy": copy}
        self.simulator = gsnav.BatchSimulator("cpu", [scene], gsnav.BatchConfig(sensors=gsnav.rgbd_sensors(4, 6)), 2,
                                              self.episode, **settings)
        self.kept = keep(self.simulator, self.simulator.reset())

    def episode(self, environment, count):
        return self.episodes[environment]

    def memory(self, sensor, floats):
        return np.zeros(floats, np.float32)


KEEP = {
    "nothing": lambda simulator, step: None,
    "step": lambda simulator, step: step,
    "image": lambda simulator, step: step["rgb"],
    "rewards": lambda simulator, step: step.rewards,
    "world": lambda simulator, step: simulator.world(1),
}


@pytest.mark.parametrize("settings", [{}, {"copy": True}, {"images": True}])
@pytest.mark.parametrize("what", KEEP)
def test_circles_through_the_episode_source_are_collected(people, what, settings):
    owner = Owner(people, KEEP[what], **settings)
    dead = weakref.ref(owner)
    del owner
    gc.collect()
    assert dead() is None


@pytest.mark.parametrize("what", KEEP)
def test_circles_without_the_simulator_are_freed(people, what):
    owner = Owner(people, KEEP[what])
    dead, kept = weakref.ref(owner), owner.kept
    owner.simulator = None
    del owner
    gc.collect()
    assert dead() is None
    if what == "world":
        assert kept.episode.id == "1"
    elif what == "image":
        assert kept.any()


@pytest.mark.parametrize("owner, field, make, change", [
    (gsnav.SimulatorConfig, "lod", gsnav.LodChoice, {"pixels": 3.0}),
    (gsnav.BatchConfig, "lod", gsnav.LodChoice, {"pixels": 3.0}),
    (gsnav.DetailChoice, "lod", gsnav.LodChoice, {"pixels": 3.0}),
    (gsnav.OpenOptions, "navmesh_settings", gsnav.NavMeshSettings, {"cell_size": 3.0}),
    (gsnav.OpenOptions, "crop", gsnav.Aabb, {"low": (3.0, 3.0, 3.0)}),
])
def test_a_value_of_a_field_outlives_the_field(owner, field, make, change):
    """The value belongs to its owner, keeps it alive, and can be changed there. None leaves it as it was."""
    made = owner(**{field: make()})
    (name, number), = change.items()
    value = getattr(made, field)
    setattr(value, name, number)
    assert np.array_equal(getattr(getattr(made, field), name), number)
    setattr(made, field, None)
    gc.collect()
    others = [owner(**{field: make()}) for _ in range(100)]  # They would take the memory.
    assert np.array_equal(getattr(value, name), number) and getattr(made, field) is None
    setattr(value, name, getattr(getattr(others[0], field), name))
    assert getattr(made, field) is None
    del made, others
    gc.collect()
    [owner(**{field: make(**change)}) for _ in range(100)]
    assert repr(value) == repr(make())


AT_EXIT = """
import threading
import gsnav
scene = gsnav.default_simulator_scene(people=1, seed=1, density=0.05)
config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(4, 6))
env = gsnav.Env(scene, config=config)
envs = gsnav.VectorEnv(2, scene, config=config)
views = gsnav.VectorEnv(2, scene, config=config, copy=False)
kept = [env.reset(seed=1), envs.reset(seed=1), views.reset(seed=1)]
kept += [env.step(1), envs.step([1, 2]), views.step([1, 2])]
episodes = gsnav.generate_episodes(scene.navmesh, 2, 1)
class Owner:
    def __init__(self):
        self.simulator = gsnav.BatchSimulator("cpu", [scene], gsnav.BatchConfig(), 2, self.episode)
        self.last = self.simulator.reset()
        self.world = self.simulator.world(0)
    def episode(self, environment, count):
        return episodes[environment]
owner = Owner()
world = env.simulator.world
try:
    env.step(99)
except gsnav.InvalidArgument as error:
    kept.append(error)
thread = threading.Thread(target=gsnav.Renderer("cpu", scene).render, args=(gsnav.Camera.look_at(
    (5, 1.5, 4), (5, 1, 3), (0, 1, 0), 640, 480, 90),), daemon=DAEMON)
thread.start()
"""


@pytest.mark.parametrize("daemon", [False, True])
def test_nothing_is_printed_at_exit(daemon):
    """Also while a daemon thread renders. Only the objects of that thread are left."""
    environment = dict(os.environ, **({} if daemon else {"GSNAV_LEAK_WARNINGS": "1"}))
    run = subprocess.run([sys.executable, "-c", AT_EXIT.replace("DAEMON", str(daemon))], capture_output=True, text=True,
                         env=environment)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")


IN_A_CALLBACK = """
import threading
import time
import gsnav
inside = threading.Event()
def stay(*arguments):
    inside.set()
    while True:
        time.sleep(0.001)
scene = gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto", density=0.05))
episode = gsnav.generate_episodes(scene.scene.navmesh, 1, 1)[0]
config = gsnav.BatchConfig(sensors=gsnav.rgbd_sensors(4, 6))
def work():
    WORK
threading.Thread(target=work, daemon=True).start()
assert inside.wait(60)
"""

CALLBACKS = {
    "episode": 'gsnav.BatchSimulator("cpu", [scene], config, 2, stay).reset()',
    "image": 'gsnav.BatchSimulator("cpu", [scene], config, 2, lambda e, k: episode, image_source=stay).reset()',
    "levels": 'gsnav.build_lod("cpu", scene.scene.assets[0].cloud, progress=stay)',
    "progress": 'gsnav.open_scene("default", gsnav.OpenOptions(navmesh="gaussians", density=0.05), stay)',
}


@pytest.mark.parametrize("name", CALLBACKS)
def test_a_daemon_thread_inside_a_callback_ends_with_the_process(name):
    """Python unwinds the stack of such a thread at exit. That must not reach a function of C++ that cannot throw."""
    program = IN_A_CALLBACK.replace("WORK", CALLBACKS[name])
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=100)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")
