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
            for function in (value, getattr(value, "fset", None)):
                if type(function).__name__ in ("nb_func", "nb_method"):
                    yield f"{owner.__name__}.{name}", function


def test_no_function_gives_the_error_of_nanobind():
    names = [name for name, function in functions() if not complaint(function)]
    assert len(list(functions())) > 300 and not names, names


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


def test_a_value_without_text_is_named_by_its_type():
    class Silent:
        def __repr__(self):
            raise ValueError

    with pytest.raises(TypeError, match="got .* = a Silent;"):
        gsnav.load_navmesh(Silent())


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
