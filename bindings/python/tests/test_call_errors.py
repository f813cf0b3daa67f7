# SPDX-License-Identifier: Apache-2.0
"""Messages for arguments of wrong types: they name the argument and its value."""

import inspect

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
