# SPDX-License-Identifier: Apache-2.0
"""The worlds and episodes of train_pointnav.py, play_pointnav.py and pointnav_speed.py. Needs no torch."""

from __future__ import annotations

import argparse
import collections
import concurrent.futures
import contextlib
import hashlib
import math
import os
import sys
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from pointnav_policy import CHANNELS, LARGEST_SIZE, LEAST_SIZE

import gsnav

LEFT, RIGHT = int(gsnav.Action.turn_left), int(gsnav.Action.turn_right)
SENSORS = {"depth": ("depth",), "rgb": ("rgb",), "rgbd": ("rgb", "depth")}  # images of an agent's sensor, in order
TRAIN_SEEDS, HELD_OUT_SEEDS = range(64), range(64, 80)
MESH_DENSITY = 0.05  # largest density of flats of triangles
SUCCESS = 2.5  # reward for a success
# Version of Worlds and Draw, which checkpoints keep. Raise it when the same arguments give other flats or episodes.
# In version 1, episodes of people began at time 0.
WORLDS_VERSION = 2
METRICS = ("success", "spl", "soft_spl", "collision_rate", "psi", "steps")


class Worlds:
    """Flats and their episodes. The same arguments give the same ones.

    success: reward for a success. penalties: factor on the penalties of collisions with people and nearness to them.
    """

    def __init__(self, seeds: range, args: argparse.Namespace, episodes: int, success: float = SUCCESS,
                 penalties: float = 1.0) -> None:
        self.task = gsnav.TaskConfig.avatar_pointnav() if args.people else gsnav.TaskConfig()
        self.task.reward.success = success
        self.task.reward.proximity *= penalties
        self.task.reward.collision *= penalties
        self.lod = gsnav.LodChoice() if args.quality == "lod" else None
        self.quality = gsnav.Quality.exact() if args.quality == "exact" else gsnav.Quality.fast()

        def make(seed: int) -> tuple[gsnav.SimulatorScene, list[gsnav.PointNavEpisode]]:
            plan = gsnav.FloorPlanOptions(seed=seed, rooms=args.rooms)
            mesh = args.worlds == "meshes" or args.worlds == "both" and seed % 2 == 1
            kind = gsnav.SurfaceKind.mesh if mesh else gsnav.SurfaceKind.gaussians
            density = min(args.density, MESH_DENSITY) if mesh else args.density
            scene = gsnav.planned_simulator_scene(plan, args.people, seed, density, self.task, kind)
            assert scene.navmesh is not None
            if self.lod is not None:
                assets = scene.assets
                for asset in assets:
                    assert asset.cloud is not None
                    asset.lod = gsnav.build_lod("cpu:1", asset.cloud)
                scene = gsnav.SimulatorScene(scene, assets=assets)
            made = gsnav.generate_episodes(scene.navmesh, episodes, seed)
            if args.people:  # else people would be at the same places at the beginning of all episodes of a flat
                made = gsnav.draw_start_times(made, scene, self.task, seed)
            return scene, list(made)

        made = in_threads(make, seeds)
        self.scenes = [scene for scene, _ in made]
        self.episodes = [gsnav.BatchEpisode(scene=s, episode=made[s][1][k])
                         for k in range(episodes) for s in range(len(made))]

    def simulator(self, args: argparse.Namespace, environments: int, sensors: list[gsnav.SensorSpec],
                  next_episode: Callable[[int, int], gsnav.BatchEpisode],
                  image_source: Callable[[int, int], Any] | None = None,
                  memory: gsnav.ImageMemory = gsnav.ImageMemory.backend) -> gsnav.BatchSimulator:
        """Environments with the sensors. After an episode, a step without effect begins the next."""
        # With as many slots as environments, one pass draws all images.
        config = gsnav.BatchConfig(task=self.task, sensors=sensors, pose_slots=environments,
                                   render=gsnav.RenderConfig(quality=self.quality), lod=self.lod,
                                   images=memory, auto_reset=gsnav.AutoReset.next_step)
        return gsnav.BatchSimulator(args.device, self.scenes, config, environments, next_episode,
                                    image_source=image_source)


def in_threads(make: Callable[[int], Any], seeds: range) -> list[Any]:
    """The results of make(seed) in the order of the seeds.

    Threads make them. After Ctrl-C they go on, until run_program() ends the program. An error waits for them.
    """
    futures = [concurrent.futures.Future[Any]() for _ in seeds]
    left = collections.deque(zip(seeds, futures))

    def work() -> None:
        while True:
            try:
                seed, future = left.popleft()
            except IndexError:
                return
            try:
                future.set_result(make(seed))
            except BaseException as e:
                future.set_exception(e)

    threads = [threading.Thread(target=work, daemon=True) for _ in range(min(16, os.cpu_count() or 1, len(seeds)))]
    for thread in threads:
        thread.start()
    try:
        return [future.result() for future in futures]
    except Exception:
        left.clear()
        for thread in threads:
            thread.join()
        raise


def mixed(*numbers: int) -> int:
    """A number of 64 bits that depends on all arguments."""
    return int.from_bytes(hashlib.blake2b(repr(numbers).encode(), digest_size=8).digest(), "little")


class Draw:
    """Source of the training episodes. They depend on the environment's number among all ranks."""

    def __init__(self, worlds: Worlds, seed: int, first: int) -> None:
        self.episodes, self.seed, self.first = worlds.episodes, seed, first
        self.begin(0)

    def begin(self, epoch: int) -> None:
        """From here on, episodes depend on `epoch` and not on those that were played before."""
        self.epoch, self.given = epoch, collections.Counter[int]()

    def __call__(self, environment: int, count: int) -> gsnav.BatchEpisode:
        self.given[environment] += 1
        at = mixed(self.seed, self.epoch, self.first + environment, self.given[environment])
        return self.episodes[at % len(self.episodes)]


def sensors_of(args: argparse.Namespace, blind: bool) -> list[gsnav.SensorSpec]:
    """The sensors of an agent, none if it is blind."""
    return [gsnav.SensorSpec(uuid=name, kind=gsnav.SensorKind[name], resolution=[args.size, args.size])
            for name in SENSORS[args.sensor] if not blind]


def images_of(seen: gsnav.BatchStep, args: argparse.Namespace, blind: bool) -> np.ndarray | None:
    """Images as the agent sees them, [N][H][W][C], or None if it is blind."""
    images = [seen.images[name] for name in SENSORS[args.sensor] if not blind]
    return (images[0] if len(images) == 1 else np.concatenate(images, -1)) if images else None


def goals(seen: gsnav.BatchStep) -> np.ndarray:
    """Goals as the agent gets them, [N][3]: distance (metres), cosine and sine of the angle."""
    distance, angle = seen.point_goals.T
    return np.stack([distance, np.cos(angle), np.sin(angle)], 1)


def number(kind: type, least: float, most: float = math.inf) -> Callable[[str], Any]:
    """A type for argparse: a number in [least, most]."""
    def parse(text: str) -> Any:
        value = kind(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{text} is not {least:g} or more" if most == math.inf else
                                             f"{text} is not between {least:,} and {most:,}")
        return value
    parse.__name__ = kind.__name__
    return parse


def run_program(main: Callable[[], None]) -> None:
    """Runs main(). Errors of gsnav and of files, too little memory and Ctrl-C end the program with a line."""
    name = os.path.basename(sys.argv[0])
    try:
        main()
    except (gsnav.Error, OSError, MemoryError) as e:
        sys.exit(f"{name}: {e}")
    except RuntimeError as e:  # of PyTorch
        if "memory" not in str(e):
            raise
        sys.exit(f"{name}: {str(e).splitlines()[0]}")
    except KeyboardInterrupt:
        with contextlib.suppress(OSError):  # a closed pipe
            print(f"{name}: stopped", file=sys.stderr, flush=True)
            sys.stdout.flush()
        os._exit(1)  # handlers of an ordinary exit must not run beside the threads of in_threads()


def world_arguments(p: argparse.ArgumentParser) -> None:
    """Adds the arguments for the worlds and the quality of images."""
    p.add_argument("--device", default="best", help="device of gsnav and torch: best, cuda, cuda:1, cpu, ...")
    p.add_argument("--people", type=number(int, 0, 1000), default=0, help="people in each flat")
    p.add_argument("--density", type=number(float, 0.05, 20), default=0.3,
                   help="factor on the number of Gaussians. Flats of triangles take "
                   f"{MESH_DENSITY} at most, because it only changes how fine their colours are")
    p.add_argument("--rooms", type=number(int, 1, 1000), default=4, help="rooms of a flat")
    p.add_argument("--worlds", default="gaussians", choices=["gaussians", "meshes", "both"],
                   help="what flats are made of; both: every other flat is a mesh")
    p.add_argument("--quality", default="exact", choices=["exact", "fast", "lod"],
                   help="error budget of the images, or levels of detail")


def sensor_arguments(p: argparse.ArgumentParser) -> None:
    """Adds the arguments for the sensor of an agent."""
    p.add_argument("--blind", action="store_true", help="the agent sees no images")
    p.add_argument("--sensor", default="depth", choices=list(CHANNELS), help="what the agent sees")
    p.add_argument("--size", type=number(int, LEAST_SIZE, LARGEST_SIZE), default=64,
                   help=f"edge of the images, pixels, {LEAST_SIZE} or more")


def flats_argument(p: argparse.ArgumentParser, what: str) -> None:
    """Adds the argument for the number of flats of the training, with `what` as its help."""
    most = len(TRAIN_SEEDS)
    p.add_argument("--flats", type=int, default=most, choices=range(1, most + 1), metavar=f"1..{most}", help=what)


def device_of(name: str) -> gsnav.Device:
    """The device, or the end of the program with an error that lists the devices."""
    try:
        return gsnav.Device.parse(name)
    except gsnav.Error as e:
        sys.exit(f"--device {name}: {e}")
