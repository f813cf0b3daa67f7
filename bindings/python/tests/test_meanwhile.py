# SPDX-License-Identifier: Apache-2.0
"""Work that runs while a GPU draws: `meanwhile` of BatchSimulator, and the results of VectorEnv."""

import os
import signal

import numpy as np
import pytest

import gsnav

N = 3
TURN, FORWARD = [2] * N, [1] * N
DEVICES = ["serial", "cpu"] + [d for d in gsnav.Device.available() if d.startswith("cuda")][:1]


@pytest.fixture(params=DEVICES)
def make(people, request):
    """Makes batches with two sensors that share an image."""
    episodes = gsnav.generate_episodes(people.navmesh, 8, 1)
    sensors = gsnav.rgbd_sensors(8, 12)
    sensors.append(gsnav.SensorSpec(**{**sensors[0].__getstate__(), "uuid": "again"}))

    def batch(device=request.param, copy=False, **settings):
        config = gsnav.BatchConfig(sensors=sensors, task=gsnav.TaskConfig(max_steps=3), **settings)
        return gsnav.BatchSimulator(device, [people], config, N, lambda e, k: episodes[(e + 5 * k) % 8], copy)

    return batch


@pytest.fixture
def ctrl_c():
    """Python's own handler of SIGINT, which a shell may have replaced."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def state(step):
    """Copies of the arrays of a step, without images."""
    return [np.copy(a) for a in (step.rewards, step.terminated, step.truncated, step.infos, step.point_goals,
                                 step.times, step.finished, step.final_point_goals, step.final_metrics)]


def images(step):
    """Copies of the images of a step."""
    return {name: np.copy(image) for name, image in [*step.images.items(),
                                                     *((n + "_end", i) for n, i in step.final_images.items())]}


def equal(a, b):
    a, b = (dict(enumerate(x)) if isinstance(x, list) else x for x in (a, b))
    return a.keys() == b.keys() and all(bits(a[k]) == bits(b[k]) for k in a)


def bits(array):
    """What compares equal if all numbers do. A structured array has bytes between its fields."""
    return repr(array.tolist()) if array.dtype.names else array.tobytes()


@pytest.mark.parametrize("copy", [True, False])
@pytest.mark.parametrize("mode", ["next_step", "same_step", "disabled"])
def test_everything_but_the_images_is_there_meanwhile(make, copy, mode):
    settings = {"auto_reset": getattr(gsnav.AutoReset, mode)}
    batch, expected = make(copy=copy, **settings), make("serial", **settings)
    seen = []

    def meanwhile(step):
        seen.append((step, state(step)))

    calls = [("reset", None), ("step", TURN), ("step", FORWARD), ("step", TURN), ("reset", np.array([True] * N)),
             ("step", FORWARD), ("reset", np.array([False, True, False])), ("step", TURN)]
    ends = 0
    for i, (name, argument) in enumerate(calls):
        got, want = getattr(batch, name)(argument, meanwhile), getattr(expected, name)(argument)
        assert len(seen) == i + 1 and seen[i][0] is got
        assert equal(seen[i][1], state(want)), i
        assert equal(images(got), images(want)), i
        ends += len(got.finished)
    assert ends == N


def test_an_exception_meanwhile_loses_one_result_and_nothing_else(make, ctrl_c):
    class Odd(BaseException):
        pass

    def fail(step):
        raise Odd

    def interrupt(step):
        os.kill(os.getpid(), signal.SIGINT)
        while True:
            pass

    batch, expected = make(copy=True), make("serial")
    with pytest.raises(Odd):
        batch.reset(None, fail)
    expected.reset()
    assert batch.world(0).time == expected.world(0).time
    for function, error in [(fail, Odd), (interrupt, KeyboardInterrupt), (lambda: None, TypeError)]:
        with pytest.raises(error):
            batch.step(TURN, function)
        expected.step(TURN)
        got, want = batch.step(FORWARD), expected.step(FORWARD)
        assert equal(state(got), state(want)) and equal(images(got), images(want))


def test_wrong_calls_meanwhile(make):
    batch = make()
    with pytest.raises(TypeError, match="BatchSimulator.reset: meanwhile must be callable or None, got int"):
        batch.reset(None, 3)
    batch.reset()
    for call in (lambda step: batch.step(TURN), lambda step: batch.reset(), lambda step: batch.world(0).agent):
        with pytest.raises(gsnav.InvalidArgument, match="another call of this object"):
            batch.step(TURN, call)
    called = []
    with pytest.raises(gsnav.InvalidArgument, match="environment 1: action 9"):
        batch.step([1, 9, 1], called.append)
    assert not called
    batch.set_rendering(False)
    assert batch.step(TURN, called.append).images == {} and len(called) == 1


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("copy", [True, False])
def test_an_interrupted_step_leaves_the_environment_usable(people, small, ctrl_c, device, copy):
    class Interrupted(gsnav.VectorEnv):
        due = False

        def _prepare(self, step):
            if self.due:
                self.due = False
                os.kill(os.getpid(), signal.SIGINT)
            super()._prepare(step)

    envs = Interrupted(N, people, config=small, device=device, copy=copy)
    other = gsnav.VectorEnv(N, people, config=small, device="serial")
    envs.reset(seed=1)
    other.reset(seed=1)
    for i in range(20):
        actions = [1 + (i + e) % 3 for e in range(N)]
        envs.due = i % 5 == 4
        want = other.step(actions)
        if envs.due:
            with pytest.raises(KeyboardInterrupt):
                envs.step(actions)
            continue
        got = envs.step(actions)
        assert equal(got[0], want[0]) and equal(list(got[1:4]), list(want[1:4]))
    assert equal(envs.reset(seed=2)[0], other.reset(seed=2)[0])
