# SPDX-License-Identifier: Apache-2.0
"""The interpreter ends while a daemon thread is in the caller's code, which a function of gsnav has called."""

import subprocess
import sys

import pytest

PROGRAM = """
import sys
import threading
import time
import gsnav
inside = threading.Event()
def stay(*arguments, **named):
    inside.set()
    while True:
        time.sleep(0.001)
class Stays:
    def __len__(self):
        return 3
    def __dlpack_device__(self):
        return (1, 0)
class Slow:
    def __del__(self, sleep=time.sleep):
        sleep(0.2)
scene = gsnav.default_simulator_scene(people=0, density=0.05)
episode = gsnav.generate_episodes(scene.navmesh, 1, 1)[0]
batch = gsnav.BatchSimulator("serial", [scene], gsnav.BatchConfig(sensors=[]), 1, lambda e, k: episode)
batch.reset()
setattr(Stays, "METHOD", stay)
value = Stays()
def work():
    WORK
thread = threading.Thread(target=work, daemon=True)
thread.start()
assert inside.wait(60)
sys.modules["slow"] = Slow()  # the thread asks for the interpreter while the modules go away
"""

CALLS = {
    "repr": ("__repr__", "gsnav.load_navmesh(value)"),
    "repr_of_constructor": ("__repr__", 'gsnav.Renderer("serial", value)'),
    "repr_of_field": ("__repr__", "gsnav.TaskConfig(max_steps=value)"),
    "repr_of_setter": ("__repr__", "gsnav.TaskConfig().max_steps = value"),
    "float": ("__float__", "gsnav.AgentPose(yaw=value)"),
    "index": ("__index__", "batch.step([value])"),
    "integer": ("__index__", "gsnav.rgbd_sensors(value)"),
    "integer_field": ("__index__", "gsnav.TaskConfig(max_steps=value)"),
    "item": ("__getitem__", "scene.navmesh.snap_point(value)"),
    "items": ("__getitem__", "gsnav.navmesh_viewpoints(scene.navmesh, value, 1.0)"),
    "path": ("__fspath__", "gsnav.load_navmesh(value)"),
    "dlpack": ("__dlpack__", "batch.step(value)"),
    "array": ("__array__", "gsnav.NavMesh.build(gsnav.NavMeshSettings(), value, value)"),
    "attribute": ("__getattr__", "gsnav.AgentPose(yaw=value)"),
    "deletion": ("__del__", "states = [value]; globals().pop('value'); gsnav.TaskConfig(max_steps=states.pop())"),
    "warning": ("unused", "import warnings; warnings.simplefilter('always'); warnings.showwarning = stay; "
                "gsnav.TaskConfig.__new__(gsnav.TaskConfig).max_steps"),
    "second_init": ("unused", "import warnings; warnings.simplefilter('always'); warnings.showwarning = stay; "
                    "gsnav.TaskConfig().__init__()"),
    "meanwhile": ("unused", "batch.step([1], stay)"),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_daemon_thread_in_code_of_an_argument(name):
    method, call = CALLS[name]
    program = PROGRAM.replace("METHOD", method).replace("WORK", call)
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=100)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")
