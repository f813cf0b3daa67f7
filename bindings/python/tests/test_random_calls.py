# SPDX-License-Identifier: Apache-2.0
"""Random calls with wrong and odd arguments. Each is an exception or a documented result, and all objects stay
usable. GSNAV_RANDOM_CALLS is the number of calls, GSNAV_RANDOM_SEED the seed."""

import gc
import itertools
import math
import os

import numpy as np
import pytest

import gsnav

CALLS = int(os.environ.get("GSNAV_RANDOM_CALLS", 10_000))
SEED = int(os.environ.get("GSNAV_RANDOM_SEED", 1))
gymnasium = pytest.importorskip("gymnasium")
# Gymnasium's error is that of a wrong seed.
EXCEPTIONS = (gsnav.Error, gymnasium.error.Error, TypeError, ValueError, LookupError, OverflowError, BufferError)
DTYPES = ["?", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8", "g", "c8", "c16", ">i4", ">f8", "U3",
          "S2", "O", "M8[s]", "m8[s]", [("a", "i4"), ("b", "f8")]]
SCALARS = [None, True, 0, 1, 3, -1, 4, 6, 2**31, 2**64, -2**70, 0.5, math.nan, math.inf, -math.inf, 1j, "", "x", "1",
           b"x", np.int64(2), np.uint8(255), np.float32("nan"), np.bool_(True), np.array(1), object(), type, Ellipsis,
           gsnav.Action.move_forward, gsnav.VelocityCommand(linear=math.nan), 1.5]


class OnlyDlpack:
    """An array that other libraries see through DLPack only."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **kwargs):
        return self.array.__dlpack__(**kwargs)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


class Liar:
    """A sequence with wrong answers."""

    def __init__(self, length, item):
        self.length, self.item = length, item

    def __len__(self):
        return self.length

    def __getitem__(self, index):
        if index > 9:
            raise IndexError
        if isinstance(self.item, Exception):
            raise self.item
        return self.item


class Arguments:
    """Makes arguments. Half of them are nearly right."""

    def __init__(self, rng):
        self.rng = rng

    def one_of(self, values):
        return values[int(self.rng.integers(len(values)))]

    def scalar(self):
        return self.one_of(SCALARS)

    def number(self):
        return self.one_of([0.0, 1.0, -2.5, 7, math.nan, math.inf, 1e300, 1e-300, -0.0, 2**40])

    def array(self, shape=None, dtype=None):
        shape = tuple(self.rng.integers(0, 4, int(self.rng.integers(0, 4)))) if shape is None else shape
        dtype = np.dtype(self.one_of(DTYPES) if dtype is None else dtype)
        values = np.zeros(shape, dtype)
        if dtype.kind in "iufc":
            values[...] = self.rng.integers(0, 4, shape)
        if dtype.kind in "fc" and self.rng.integers(3) == 0:
            values[...] = self.one_of([math.nan, math.inf])
        turn = int(self.rng.integers(8))
        if turn == 1:
            values = np.repeat(values, 2, axis=-1)[..., ::2] if values.ndim else values
        elif turn == 2:
            values = values[::-1] if values.ndim else values
        elif turn == 3:
            values = np.asfortranarray(values)
        elif turn == 4 and values.size:
            values = np.broadcast_to(values.flat[0], values.shape)
        elif turn == 5:
            values.flags.writeable = False
        elif turn == 6 and dtype.kind in "iuf" and dtype.isnative:
            return OnlyDlpack(values)
        elif turn == 7:
            return values.tolist()
        return values

    def point(self):
        turn = int(self.rng.integers(8))
        if turn < 4:
            return [self.number() if turn == 0 else float(self.rng.uniform(-1, 9)) for _ in range(3)]
        return self.array((3,), "f8") if turn < 6 else self.anything()

    def actions(self, count):
        turn = int(self.rng.integers(8))
        if turn < 3:
            return self.array((count,), self.one_of(["i1", "i4", "i8", "u8"]))
        if turn == 3:
            return [self.scalar() for _ in range(count)]
        return self.array((count,)) if turn == 4 else self.anything()

    def mask(self, count):
        return self.array((count,), "?") if self.rng.integers(2) else self.anything()

    def anything(self):
        turn = int(self.rng.integers(8))
        if turn < 3:
            return self.array()
        if turn < 6:
            return self.scalar()
        if turn == 6:
            return Liar(self.one_of([0, 1, 2, 3, 20]), self.one_of([1, math.nan, "x", KeyError("mine"), None]))
        return self.one_of([[], (), {}, [[]], [1, 2], [[1, 2, 3]] * 3, memoryview(b"123"), range(3), {1, 2, 3},
                            iter([1])])


class Things:
    """Objects that the random calls use."""

    def __init__(self, scene):
        self.config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(4, 6), task=gsnav.TaskConfig(max_steps=9))
        self.scene = scene
        self.episodes = gsnav.generate_episodes(scene.navmesh, 4, 1)
        self.simulator = gsnav.Simulator("cpu", scene, self.config)
        self.batch = gsnav.BatchSimulator("cpu", [scene], gsnav.BatchConfig(sensors=self.config.sensors), 3,
                                          lambda e, k: self.episodes[(e + k) % 4])
        self.env = gsnav.Env(scene, config=self.config)
        self.envs = gsnav.VectorEnv(3, scene, config=self.config)
        self.views = gsnav.VectorEnv(3, scene, config=self.config, copy=False)
        self.renderer = gsnav.Renderer("cpu", scene)
        self.closed = [gsnav.Env(scene, config=self.config), gsnav.VectorEnv(2, scene, config=self.config)]
        [env.close() for env in self.closed]
        self.camera = gsnav.Camera.look_at((5, 1.5, 4), (5, 1, 3), (0, 1, 0), 6, 4, 90)
        self.cloud = scene.assets[0].cloud
        self.sets = gsnav.build_visible_sets("cpu", self.cloud, [(5, 1.5, 4)], gsnav.VisibleSettings(face=16))
        self.still = gsnav.SimulatorScene(assets=scene.assets)
        self.first = self.bits()

    def bits(self):
        """Results of right calls, to see that nothing has changed."""
        out = [self.env.reset(seed=1)[0]["rgb"].sum(), self.env.step(1)[1]]
        for envs in (self.envs, self.views):
            out += [envs.reset(seed=1)[0]["rgb"].sum(), *envs.step([1, 2, 3])[1]]
        self.batch.reset()
        self.simulator.reset(self.episodes[0])
        out += [self.batch.step([1, 1, 1]).images["depth"].shape[0], self.simulator.step(1)["rgb"].sum()]
        return [*out, self.renderer.render(self.camera).rgb.sum()]


def calls(t, a):
    """Functions that make one random call each."""
    mesh = t.scene.navmesh

    def camera():
        made = gsnav.Camera(width=6, height=4, fx=3.0, fy=3.0, cx=3.0, cy=2.0)
        name = a.one_of(["fx", "fy", "cx", "cy", "near_plane", "near_sigma"])
        setattr(made, name, a.number())
        if a.rng.integers(3) == 0:
            made.viewmat = a.array((4, 4), "f8") if a.rng.integers(2) else a.anything()
        return made

    def episode():
        made = gsnav.PointNavEpisode(start_position=a.point(), goal_position=a.point())
        if a.rng.integers(2):
            made.start_rotation = [a.number() for _ in range(4)]
        return made

    return [
        lambda: t.envs.step(a.actions(3)),
        lambda: t.views.step(a.actions(3)),
        lambda: t.batch.step(a.actions(3)),
        lambda: t.env.step(a.scalar() if a.rng.integers(2) else a.anything()),
        lambda: t.simulator.step(a.scalar() if a.rng.integers(2) else a.anything()),
        lambda: t.simulator.step(gsnav.VelocityCommand(linear=a.number(), angular=a.number(), lateral=a.number())),
        lambda: t.batch.step([gsnav.VelocityCommand(linear=a.number()) for _ in range(int(a.rng.integers(2, 4)))]),
        lambda: t.envs.reset(seed=a.anything()),
        lambda: t.envs.reset(options={"reset_mask": a.mask(3)}),
        lambda: t.batch.reset(a.mask(3)),
        lambda: t.env.reset(seed=a.anything()),
        lambda: t.env.reset(options={"episode": episode() if a.rng.integers(2) else a.anything()}),
        lambda: t.simulator.reset(episode()),
        lambda: t.simulator.set_agent(a.point(), a.number() if a.rng.integers(2) else a.anything()),
        lambda: t.simulator.set_state(a.anything()),
        lambda: t.simulator.observe()[a.scalar()],
        lambda: t.simulator.render(camera(), a.one_of([1, 2, 64, 2**32, -1, "x", gsnav.Output.kMedianDepth])),
        lambda: t.renderer.render(camera() if a.rng.integers(2) else a.anything(), a.number()),
        lambda: t.renderer.render([t.camera] * int(a.rng.integers(3)) + [camera()]),
        lambda: t.batch.world(a.scalar()).metrics(),
        lambda: t.batch.scene_of(a.scalar()),
        lambda: mesh.find_path(a.point(), a.point()),
        lambda: mesh.geodesic_distance(a.point(), [a.point(), a.point()]),
        lambda: mesh.snap_point(a.point(), gsnav.SnapOptions(half_extents=a.point())),
        lambda: mesh.path_between(gsnav.NavPoint(position=a.point(), poly=int(a.rng.integers(2**33))),
                                  gsnav.NavPoint()),
        lambda: mesh.random_point_near(gsnav.Rng(1), a.point(), a.number()),
        lambda: mesh.height_at(int(a.rng.integers(2**60)), a.point()),
        lambda: mesh.top_down_map(a.number(), a.one_of([0.5, 0, -1, math.nan, "x"])),
        lambda: mesh.surface(a.scalar()),
        lambda: mesh.island_area(a.scalar()),
        lambda: gsnav.to_bytes(a.array(dtype="f4") if a.rng.integers(2) else a.anything()),
        lambda: gsnav.NavMesh.build(gsnav.NavMeshSettings(), a.array((3, 3), "f8"), a.array((1, 3))),
        lambda: setattr(t.simulator.config.task, a.one_of(["max_steps", "agent_radius"]), a.anything()),
        lambda: gsnav.TaskConfig(**{a.one_of(["max_steps", "turn_angle", "x"]): a.anything()}),
        lambda: gsnav.SensorSpec(resolution=a.anything(), position=a.point()),
        lambda: gsnav.Device.parse(a.scalar()),
        lambda: gsnav.eval.image_error(a.array((2, 2, 3)), a.array((2, 2, 3)), a.mask(2)),
        lambda: gsnav.eval.depth_error(a.array((2, 2)), a.array(), a.anything(), a.anything()),
        lambda: gsnav.eval.oracle_render("cpu", a.one_of([t.still, t.scene, a.anything()]), camera()),
        lambda: gsnav.build_visible_sets("cpu", t.cloud, [a.point()],
                                         gsnav.VisibleSettings(face=16, rows=a.one_of([0, 3, 8]), cell=a.number())),
        lambda: gsnav.build_lod("cpu", a.anything(), progress=a.anything()),
        lambda: t.sets.count_seen_rows(a.scalar(), a.scalar()),
        lambda: t.sets.cell_of(camera(), gsnav.Similarity(scale=a.number(), translation=a.point())),
        lambda: gsnav.navmesh_viewpoints(mesh, [a.number()], a.one_of([0.0, -1, math.nan, 3.0])),
        lambda: gsnav.SimulatorScene(a.anything(), assets=a.one_of([None, [], t.still.assets, a.anything()])),
        lambda: gsnav.Renderer("cpu", gsnav.SimulatorScene(assets=[gsnav.SceneAsset(
            t.cloud, gsnav.Similarity(rotation=[a.number() for _ in range(4)], scale=a.number()))])).render(t.camera),
        lambda: gsnav.io.save_scene(a.anything(), t.cloud) if a.rng.integers(2) else gsnav.io.count_clamped(
            "x.splat", a.anything()),
        lambda: a.one_of(t.closed).step(a.anything()),
        lambda: a.one_of(t.closed).reset(seed=a.scalar()),
    ]


@pytest.mark.filterwarnings("ignore")
def test_random_calls(people):
    rng = np.random.default_rng(SEED)
    things = Things(people)
    made = calls(things, Arguments(rng))
    results = 0
    for i in range(CALLS):
        which = int(rng.integers(len(made)))
        try:
            with np.errstate(all="ignore"):
                made[which]()
            results += 1
        except EXCEPTIONS as e:
            assert str(e), (i, which)
        except Exception as e:
            raise AssertionError(f"call {i}, function {which}: {type(e).__name__}: {e}") from e
        if i % 500 == 499:
            assert things.bits() == things.first, i
    assert CALLS // 10 < results < CALLS
    assert things.bits() == things.first


def test_viewed_objects_are_deleted_in_every_order(people):
    episodes = gsnav.generate_episodes(people.navmesh, 2, 1)
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(4, 6))
    for order in itertools.permutations(range(5)):
        simulator = gsnav.Simulator("serial", people, config)
        seen = simulator.reset(episodes[0])
        image = seen["rgb"]
        single = [simulator, seen, simulator.world, image, image[1:, ::2]]
        batch = gsnav.BatchSimulator("serial", [people], gsnav.BatchConfig(sensors=config.sensors), 2,
                                     lambda e, k: episodes[e])
        step = batch.reset()
        many = [batch, step, batch.world(1), step.infos["moved"], step["depth"][1]]
        kept = image.copy(), step["depth"].copy()
        del simulator, seen, image, batch, step
        for i in order:
            single[i] = many[i] = None
            gc.collect(0)
            assert single[2] is None or single[2].episode.id == "0"
            assert many[2] is None or many[2].episode.id == "1"
            assert single[3] is None or np.array_equal(single[3], kept[0])
            assert single[4] is None or np.array_equal(single[4], kept[0][1:, ::2])
            assert many[4] is None or np.array_equal(many[4], kept[1][1])
            assert single[1] is None or np.array_equal(single[1]["rgb"], kept[0])
