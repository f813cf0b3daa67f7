# SPDX-License-Identifier: Apache-2.0
import multiprocessing
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import gsnav


def test_one_simulator_per_thread(people, small):
    episodes = gsnav.generate_episodes(people.navmesh, 1, 1)

    def run(out):
        simulator = gsnav.Simulator("serial", people, small)
        simulator.reset(episodes[0])
        out.append(np.stack([simulator.step(1 + i % 3)["rgb"].copy() for i in range(8)]))

    results = [[] for _ in range(3)]
    threads = [threading.Thread(target=run, args=(r,)) for r in results]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert all(np.array_equal(r[0], results[0][0]) for r in results)


def test_a_second_thread_gets_an_error(opened):
    renderer = gsnav.Renderer("serial", opened)
    camera = gsnav.framing_camera(opened, 640, 480)
    refused, ready = [], threading.Barrier(2)

    def run():
        ready.wait()
        for _ in range(10):
            try:
                renderer.render(camera)
            except gsnav.InvalidArgument as e:
                refused.append(str(e))

    threads = [threading.Thread(target=run) for _ in range(2)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert refused and "another call of this object" in refused[0]
    assert renderer.render(camera).rgb.any()


def test_a_callback_cannot_call_its_simulator(people):
    episodes = gsnav.generate_episodes(people.navmesh, 1, 1)
    batch = None

    def source(environment, count):
        if count == 1:
            batch.reset()
        return episodes[0]

    batch = gsnav.BatchSimulator("cpu", [people], gsnav.BatchConfig(sensors=[]), 1, source)
    batch.reset()
    with pytest.raises(gsnav.InvalidArgument, match="callback"):
        batch.reset()


def test_rendering_releases_the_interpreter(opened):
    renderer = gsnav.Renderer("serial", opened)
    cameras = gsnav.views_around(opened, 8, 640, 480)
    thread = threading.Thread(target=renderer.render, args=(cameras,))
    ticks = 0
    thread.start()
    while thread.is_alive():
        ticks += 1
        time.sleep(0.001)
    assert ticks > 5  # with the lock held, the loop could not run before the end


CHANGES = """
import sys, threading
import gsnav
sys.setswitchinterval(1e-6)
scene = gsnav.default_simulator_scene(people=0, density=0.05)
simulator = gsnav.Simulator("serial", scene, gsnav.SimulatorConfig(sensors=[]))
episode = gsnav.generate_episodes(scene.navmesh, 1, 1)[0]
start = episode.start_position
names, places = ("a" * 40, "b" * 4000), (start, start + (0, 50, 0))
episode.id = names[0]  # the thread may begin late
options = gsnav.SnapOptions()
extents = ((2.0, 4.0, 2.0), (1e-9, 1e-9, 1e-9))
camera = gsnav.Camera.look_at((5, 1.5, 4), (5, 1, 3), (0, 1, 0), 64, 64, 90)
running = True
def change():
    while running:
        for i in range(2):
            episode.id, episode.start_position, camera.height = names[i], places[i], (64, 512)[i]
            options.half_extents = extents[i]
thread = threading.Thread(target=change)
thread.start()
try:
    for _ in range(ROUNDS):
        try:
            simulator.reset(episode)
            assert simulator.world.episode.id in names
        except gsnav.NothingNavigable as e:
            assert any(name in str(e) for name in names)
        assert simulator.render(camera).rgb.shape in ((64, 64, 3), (512, 64, 3))
        scene.navmesh.geodesic_distance(start, start + (1, 0, 0), options)
finally:
    running = False
    thread.join()
"""


def test_settings_may_change_during_a_call():
    """C++ reads copies of episodes, cameras and settings while other threads run."""
    program = CHANGES.replace("ROUNDS", "300")
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=200)
    assert run.returncode == 0, run.stderr


def test_a_follower_in_two_threads(people):
    episode = gsnav.generate_episodes(people.navmesh, 1, 1)[0]
    follower, refused = gsnav.GreedyGeodesicFollower(people.navmesh, episode.goal_position), []

    end = time.monotonic() + 60

    def run():
        while not refused and time.monotonic() < end:  # mostly a few milliseconds
            try:
                follower.next(episode.start_position, 0.0)
            except gsnav.InvalidArgument as e:
                refused.append(str(e))

    threads = [threading.Thread(target=run) for _ in range(3)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert refused and all("GreedyGeodesicFollower.next: another call" in text for text in refused)


def test_progress_is_called_and_its_errors_do_not_stop_the_work(capfd):
    calls = []
    gsnav.open_scene("default", gsnav.OpenOptions(navmesh="gaussians", density=0.05),
                     lambda task, share: calls.append((task, share)))
    assert calls and all(0 <= share <= 1 for _, share in calls)


def test_ctrl_c_in_progress_is_not_lost():
    def stop(task, share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gsnav.open_scene("default", gsnav.OpenOptions(navmesh="gaussians", density=0.05), stop)


INTERRUPTED = """
import os, signal, threading, time
import gsnav
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have ignored it
scene = gsnav.default_simulator_scene(people=1, density=0.05)
camera = gsnav.Camera.look_at((5, 1.5, 4), (5, 1, 3), (0, 1, 0), 1024, 1024, 90)
renderer = gsnav.Renderer("serial", scene)
start = time.perf_counter()
renderer.render([camera] * 8)
whole = 8 * (time.perf_counter() - start)
timer = threading.Timer(whole / 32, os.kill, (os.getpid(), signal.SIGINT))
start = time.perf_counter()
timer.start()
try:
    renderer.render([camera] * 64)
except KeyboardInterrupt:
    print(f"{(time.perf_counter() - start) / whole:.2f}")
assert renderer.render(camera).rgb.any()
"""


def test_ctrl_c_ends_the_rendering_of_many_cameras():
    run = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert float(run.stdout) < 0.6  # of the time of the whole call; mostly an eighth


WORK = """
import os, signal, sys, threading, time
import gsnav
signal.signal(signal.SIGINT, signal.default_int_handler)
mesh = gsnav.default_simulator_scene(people=0, density=0.05).navmesh
calls = {"people": lambda: gsnav.default_simulator_scene(people=1000, density=0.05),
         "rooms": lambda: gsnav.planned_simulator_scene(people=1000, density=0.05),
         "open": lambda: gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto", people=1000, density=0.05)),
         "episodes": lambda: gsnav.generate_episodes(mesh, 10**7, 1)}
threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
start = time.process_time()
try:
    calls[sys.argv[1]]()
except KeyboardInterrupt:
    print(time.process_time() - start)
"""


@pytest.mark.parametrize("call", ["people", "rooms", "open", "episodes"])
def test_ctrl_c_ends_calls_that_make_many_people_or_episodes(call):
    run = subprocess.run([sys.executable, "-c", WORK, call], capture_output=True, text=True, timeout=100)
    assert run.returncode == 0, run.stderr
    assert float(run.stdout) < 20  # All of the work takes minutes.


OPENED = """
import os, signal, sys, threading, time
import gsnav
class Stop(BaseException):
    pass
def handler(*_):
    raise Stop
signal.signal(signal.SIGINT, handler)
options = gsnav.OpenOptions(navmesh=sys.argv[1], levels=getattr(gsnav.SceneLevels, sys.argv[2]), density=0.2,
                            cell_size=0.02)
start = time.process_time()
gsnav.open_scene("default", options)
whole = time.process_time() - start
def interrupt():
    while time.process_time() - start < share * whole:
        time.sleep(0.002)
    os.kill(os.getpid(), signal.SIGINT)
for share in (0.1, 0.4):
    start = time.process_time()
    thread = threading.Thread(target=interrupt)
    thread.start()
    try:
        gsnav.open_scene("default", options)
    except Stop:
        print(f"{(time.process_time() - start) / whole - share:.2f}")
    thread.join()
"""


@pytest.mark.parametrize("parts", [("gaussians", "none"), ("mesh", "built")])
def test_ctrl_c_ends_the_opening_of_a_scene(parts):
    run = subprocess.run([sys.executable, "-c", OPENED, *parts], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    waited = [float(line) for line in run.stdout.split()]
    assert len(waited) == 2 and max(waited) < 0.5, waited  # shares of the processor time of the whole call


def test_many_cameras_are_rendered_in_parts_with_the_same_bits(people):
    cameras = [gsnav.Camera.look_at((5, 1.5, 4 + 0.1 * i), (5, 1, 3), (0, 1, 0), 1536, 1024, 90) for i in range(13)]
    outputs = int(gsnav.Output.kRgb | gsnav.Output.kMedianDepth)
    renderer = gsnav.Renderer("cpu:1", people, gsnav.RenderOptions(render=gsnav.RenderConfig(outputs=outputs)))
    frames = renderer.render(cameras, 1.5)
    assert frames.rgb.shape == (13, 1024, 1536, 3) and frames.median_depth.shape == (13, 1024, 1536)
    assert frames.alpha is None and frames.cameras == len(frames.stats) == 13
    for i in (0, 4, 5, 9, 12):
        one = renderer.render(cameras[i], 1.5)
        assert np.array_equal(one.rgb, frames.rgb[i]) and np.array_equal(one.median_depth, frames.median_depth[i])
        assert repr(one.stats[0].visible) == repr(frames.stats[i].visible)
    for wrong, words in [({"fx": 0.0}, "Camera.fx"), ({"width": 64}, "one size")]:
        last = gsnav.Camera(**{**cameras[0].__getstate__(), **wrong})
        start = time.process_time()
        with pytest.raises(gsnav.InvalidArgument, match=words):
            renderer.render([*cameras, last])
        assert time.process_time() - start < 0.5  # before anything is rendered
    with pytest.raises(gsnav.InvalidArgument, match="no camera"):
        renderer.render([])


def _in_child(function):
    """Runs function in a forked child. Returns its exit status, or None after 60 s."""
    pid = os.fork()
    if pid == 0:
        try:
            function()
            os._exit(0)
        except gsnav.Unsupported:
            os._exit(7)
        except BaseException:
            os._exit(1)
    for _ in range(600):
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.1)
    os.kill(pid, 9)
    os.waitpid(pid, 0)
    return None


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore:os.fork:RuntimeWarning")  # of Python, of JAX
def test_fork(opened):
    camera = gsnav.framing_camera(opened, 64, 64)
    renderer = gsnav.Renderer("cpu:2", opened)
    renderer.render(camera)
    assert _in_child(lambda: renderer.render(camera)) == 7
    assert _in_child(lambda: gsnav.Renderer("cpu", opened)) == 7
    assert _in_child(lambda: gsnav.Renderer("serial", opened).render(camera)) == 0
    built = gsnav.OpenOptions(density=0.05, levels=gsnav.SceneLevels.built, device=gsnav.Device.parse("cpu"))
    assert _in_child(lambda: gsnav.open_scene("default", built)) == 7
    built.device = gsnav.Device.parse("serial")
    assert _in_child(lambda: gsnav.open_scene("default", built)) == 0
    assert renderer.render(camera).rgb.any()


def _spawned(queue):
    env = gsnav.Env(gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto", density=0.05)),
                    config=gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(8, 8)))
    queue.put(float(env.reset(seed=1)[0]["rgb"].sum()))


def test_spawn(opened):
    context = multiprocessing.get_context("spawn")
    queue = context.Queue()
    process = context.Process(target=_spawned, args=(queue,))
    process.start()
    total = queue.get(timeout=120)
    process.join()
    env = gsnav.Env(opened, config=gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(8, 8)))
    assert total == float(env.reset(seed=1)[0]["rgb"].sum())


SUBINTERPRETER = """
import importlib.util
import gsnav
env = gsnav.Env(config=gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(8, 8)))
env.reset(seed=1)
name = next(n for n in ("_interpreters", "_xxsubinterpreters") if importlib.util.find_spec(n))
interpreters = importlib.import_module(name)
code = "try:\\n    import gsnav\\nexcept ImportError as e:\\n    print('refused:', e, flush=True)"
interpreters.run_string(interpreters.create(), code)
env.step(1)  # the types of the main interpreter are as they were
print("alive")
"""


def test_a_subinterpreter_gets_an_error():
    run = subprocess.run([sys.executable, "-c", SUBINTERPRETER], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "refused:" in run.stdout and "subinterpreters" in run.stdout and "alive" in run.stdout


def test_without_numpy_the_import_is_an_error():
    code = "import sys; sys.modules['numpy'] = None; import gsnav._gsnav"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.returncode == 1 and "ImportError" in run.stderr or "ModuleNotFoundError" in run.stderr


TWICE = """
import importlib
import sys
import gsnav
scene = gsnav.default_simulator_scene(people=0, density=0.05)
kept = {name: sys.modules.pop(name) for name in list(sys.modules) if name.split(".")[0] == "gsnav"}
for _ in range(2):
    try:
        import gsnav
    except ImportError as e:
        print("refused:", e)
    for name in list(sys.modules):
        if name.split(".")[0] == "gsnav":
            del sys.modules[name]
sys.modules["gsnav._gsnav"] = kept["gsnav._gsnav"]
import gsnav
env = gsnav.Env(scene, config=gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(8, 8)))
env.reset(seed=1)
importlib.reload(gsnav)
print("alive", env.step(1)[1])
"""


def test_a_second_import_is_an_error():
    run = subprocess.run([sys.executable, "-c", TWICE], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("refused: gsnav cannot be loaded twice") == 2 and "alive" in run.stdout
    # After an import that failed, another one works.
    code = "import sys, numpy; sys.modules['numpy'] = None\ntry:\n    import gsnav._gsnav\nexcept ImportError:"
    again = code + "\n    pass\nsys.modules['numpy'] = numpy\nimport gsnav; print(gsnav.Rng(1).next())"
    run = subprocess.run([sys.executable, "-c", again], capture_output=True, text=True)
    assert run.returncode == 0 and run.stdout.strip() == str(gsnav.Rng(1).next()), run.stderr
