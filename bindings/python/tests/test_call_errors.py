# SPDX-License-Identifier: Apache-2.0
"""Messages for arguments of wrong types: they name the argument and its value."""

import inspect
import signal

import numpy as np
import pytest

import gsnav
from gsnav import _gsnav


class Odd:
    """A value that no function takes."""

    def __repr__(self):
        return "<odd>"


def functions():
    """All functions of the compiled module, setters of properties included."""
    for owner in [_gsnav, *(c for c in vars(_gsnav).values() if inspect.isclass(c))]:
        for name, value in vars(owner).items():
            for function in (value, getattr(value, "fget", None), getattr(value, "fset", None)):
                if type(function).__name__ in ("nb_func", "nb_method"):
                    yield f"{owner.__name__}.{name}", function


def test_no_function_gives_the_error_of_nanobind():
    names = [name for name, function in functions() if not complaint(function)]
    assert len(list(functions())) > 500 and not names, names


def complaint(function):
    """Whether all errors of calls with odd arguments are the package's own."""
    for count in range(6):
        try:
            function(*[Odd()] * count)
        except Exception as error:
            if "incompatible function arguments" in str(error):
                return False
    return True


@pytest.mark.parametrize("call, words", [
    (lambda: gsnav.Renderer("serial", 4), ["Renderer: got device = 'serial', scene = 4; expected (device: Device | "
                                           "str, scene: SimulatorScene | OpenedScene, options: RenderOptions = ...)"]),
    (lambda: gsnav.RenderOptions(3), ["RenderOptions: got argument 1 = 3; expected (*, render: "]),
    (lambda: gsnav.Renderer("serial", scene=Odd()), ["Renderer: got device = 'serial', scene = <odd>;"]),
    (lambda: gsnav.rgbd_sensors("9" * 500), ["rgbd_sensors: got", " = '999", "999...;"]),
    (lambda: gsnav.load_navmesh(), ["load_navmesh: got no arguments; expected ("]),
    (lambda: gsnav.rgbd_sensors(8, 8, 8, 8, 8, 8, 8, more=1), ["argument 7 = 8", "more = 1;"]),
    (lambda: gsnav.load_navmesh(np.zeros(2)), ["load_navmesh: got", "array([0., 0.]);"]),
])
def test_arguments_and_values_are_named(call, words):
    with pytest.raises(TypeError) as raised:
        call()
    assert all(word in str(raised.value) for word in words), str(raised.value)


TASK, POINT = gsnav.TaskConfig, (5, 0, 4)


@pytest.mark.parametrize("call, message", [
    (lambda: TASK.max_steps.fget(3), "TaskConfig.max_steps: expected a TaskConfig as self, got 3"),
    (lambda: TASK.max_steps.fset(3, 4), "TaskConfig.max_steps: expected a TaskConfig as self, got 3"),
    (lambda: gsnav.NavMesh.settings.fget(None), "NavMesh.settings: expected a NavMesh as self, got None"),
    (lambda: gsnav.NavMesh.snap_point(5, POINT), "NavMesh.snap_point: expected a NavMesh as self, got 5"),
    (lambda: gsnav.NavMesh.snap_point(), "NavMesh.snap_point: got no arguments; expected (point: "),
    (lambda: gsnav.Renderer.__init__(5, "serial"), "Renderer.__init__: expected a Renderer as self, got 5"),
])
def test_a_wrong_self_is_named(call, message):
    with pytest.raises(TypeError) as raised:
        call()
    assert str(raised.value).startswith(message), str(raised.value)


@pytest.mark.filterwarnings("ignore:nanobind")
def test_an_object_that_init_has_not_made():
    for use in (lambda mesh: mesh.snap_point(POINT), lambda mesh: mesh.settings):
        with pytest.raises(TypeError, match="^NavMesh.[a-z_]*: __init__ of this NavMesh has not been called$"):
            use(gsnav.NavMesh.__new__(gsnav.NavMesh))


@pytest.mark.filterwarnings("ignore:nanobind")
def test_an_object_is_made_once(people):
    pose, renderer = gsnav.AgentPose(yaw=1.0), gsnav.Renderer("serial", people)
    for again in (lambda: pose.__init__(yaw=2.0), lambda: pose.__setstate__({"yaw": 2.0}),
                  lambda: renderer.__init__("serial", people)):
        with pytest.raises(TypeError, match="^(AgentPose|Renderer).*: this object has been made already; make another"):
            again()
    assert pose.yaw == 1.0 and renderer.render(gsnav.Camera()).rgb.shape == (256, 256, 3)


TEXT, NUMBERS = "x" * 10**7, [1.5] * 10**6


@pytest.mark.parametrize("call", [
    lambda envs: gsnav.load_navmesh(NUMBERS), lambda envs: gsnav.Renderer("serial", TEXT), lambda envs: TASK(TEXT),
    lambda envs: TASK(max_steps=TEXT), lambda envs: setattr(TASK(), "max_steps", NUMBERS),
    lambda envs: TASK(**{TEXT: 1}),
    lambda envs: gsnav.load_navmesh(TEXT), lambda envs: gsnav.load_navmesh(path=1, **{TEXT: 1}),
    lambda envs: gsnav.load_navmesh(*range(10**5)),
    lambda envs: gsnav.load_navmesh(**{f"k{i}": i for i in range(10**4)}),
    lambda envs: gsnav.Device.parse(TEXT), lambda envs: setattr(gsnav.Camera(), "viewmat", NUMBERS),
    lambda envs: gsnav.open_scene(TEXT), lambda envs: gsnav.OpenOptions(up=NUMBERS),
    lambda envs: gsnav.AgentPose(yaw=TEXT), lambda envs: envs.simulator.step([10**4000] * 2),
    lambda envs: gsnav.open_scene("default", gsnav.OpenOptions(up=TEXT)),
    lambda envs: gsnav.SensorSpec(uuid=NUMBERS), lambda envs: envs.reset(options=NUMBERS), lambda envs: envs.step(TEXT),
    lambda envs: envs.reset(seed=TEXT), lambda envs: envs.step(NUMBERS), lambda envs: gsnav.VectorEnv(TEXT),
    lambda envs: gsnav.VectorEnv(2, TEXT), lambda envs: gsnav.VectorEnv(2, autoreset_mode=TEXT),
    lambda envs: gsnav.VectorEnv(2, episodes=NUMBERS), lambda envs: gsnav.VectorEnv(2, render_mode=TEXT),
    lambda envs: envs.simulator.step([1, 1])[TEXT], lambda envs: gsnav.Env(device=TEXT),
])
def test_a_long_argument_gives_a_short_message(call, people, small):
    envs = gsnav.VectorEnv(2, people, config=small)
    envs.reset(seed=1)
    with pytest.raises((TypeError, ValueError, KeyError, IndexError, OSError)) as raised:
        call(envs)
    assert 0 < len(str(raised.value)) < 9000


def test_a_value_without_text_is_named_by_its_type():
    class Silent:
        def __repr__(self):
            raise ValueError

    with pytest.raises(TypeError, match="got .* = a Silent;"):
        gsnav.load_navmesh(Silent())


def test_values_that_cannot_be_shown_or_asked(people, small):
    class Odd:
        @property
        def __class__(self):
            raise ZeroDivisionError

        def __repr__(self):
            return "\udc80"

    with pytest.raises(TypeError, match="^TaskConfig.max_steps: expected a TaskConfig as self, got "):
        TASK.max_steps.fget(Odd())
    with pytest.raises(TypeError, match=r"max_steps.*\\udc80"):
        TASK(max_steps=Odd())
    envs = gsnav.VectorEnv(2, people, config=small)
    for call, name in ((lambda n: gsnav.VectorEnv(n, people), "num_envs"), (lambda n: envs.reset(seed=n), "seed")):
        for huge in (10**5000, -10**5000):  # Python makes no text of it.
            with pytest.raises(gsnav.InvalidArgument, match=f"^{name} = a int: must be "):
                call(huge)


def test_errors_of_functions_that_call_python_stay(people):
    def source(environment, count):
        return gsnav.load_navmesh(Odd())

    batch = gsnav.BatchSimulator("serial", [people], gsnav.BatchConfig(sensors=[]), 1, source)
    with pytest.raises(TypeError, match="^load_navmesh: got .* = <odd>;"):
        batch.reset()


@pytest.mark.parametrize("give", [
    lambda evil, opened: gsnav.SensorSpec(resolution=evil),
    lambda evil, opened: gsnav.navmesh_viewpoints(opened.scene.navmesh, evil, 1.0),
    lambda evil, opened: gsnav.SimulatorScene(opened.scene, people=evil),
])
def test_a_list_that_changes_while_it_is_read(give, opened):
    class Evil:
        def __float__(self):
            emptied.clear()
            self.junk = [[0] * n for n in range(1, 300)]
            return 1.0

        __int__ = __index__ = __float__

    emptied = []
    for _ in range(20):
        emptied[:] = [Evil(), *(10**6 + i for i in range(2000))]
        with pytest.raises((TypeError, ValueError, IndexError, gsnav.Error)):
            give(emptied, opened)


def test_a_state_that_changes_while_it_is_read():
    class Evil:
        def __len__(self):
            return 3

        def __getitem__(self, i):
            state.clear()
            return 1.0

    for _ in range(100):
        state = {"position": Evil(), "yaw": 0.5}
        pose = gsnav.AgentPose.__new__(gsnav.AgentPose)
        pose.__setstate__(state)
        assert pose.yaw == 0.5


@pytest.mark.parametrize("method, call", [
    ("__index__", lambda batch, value: batch.step([1, value])),
    ("__fspath__", lambda batch, value: gsnav.open_scene(value)),
    ("__float__", lambda batch, value: gsnav.AgentPose(yaw=value)),
    ("__float__", lambda batch, value: gsnav.AgentPose(position=[0, value, 0])),
    ("__repr__", lambda batch, value: gsnav.load_navmesh(value)),
])
def test_ctrl_c_in_code_of_an_argument_is_not_lost(method, call, opened):
    class Interrupts:
        pass

    def interrupt(value):
        signal.raise_signal(signal.SIGINT)
        return "text" if method in ("__fspath__", "__repr__") else 1

    setattr(Interrupts, method, interrupt)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    episodes = gsnav.generate_episodes(opened.scene.navmesh, 2, 1)
    batch = gsnav.BatchSimulator("serial", [opened.scene], gsnav.BatchConfig(rendering=False), 2,
                                 lambda e, k: episodes[e])
    batch.reset()
    try:
        with pytest.raises(KeyboardInterrupt):
            call(batch, Interrupts())
            for _ in range(10):  # Ctrl-C may come a moment later.
                pass
        assert len(batch.step([1, 1]).rewards) == 2
    finally:
        signal.signal(signal.SIGINT, before)


def test_an_error_of_a_callback_stays_as_it_is(opened):
    words = "f(): incompatible function arguments. The following argument types are supported:\n    1. f(a: int)"

    def wrong(step):
        raise TypeError(words)

    episodes = gsnav.generate_episodes(opened.scene.navmesh, 2, 1)
    batch = gsnav.BatchSimulator("serial", [opened.scene], gsnav.BatchConfig(rendering=False), 2,
                                 lambda e, k: episodes[e])
    batch.reset()
    with pytest.raises(TypeError) as raised:
        batch.step([1, 1], wrong)
    assert str(raised.value) == words and raised.traceback[-1].name == "wrong"
