# SPDX-License-Identifier: Apache-2.0
"""Draws held-out episodes of the trained agent as a moving picture. Needs matplotlib, and no torch.

    pointnav_replay.py --out replay.webp --episodes 3 40 117
"""

from __future__ import annotations

import argparse
import copy
import dataclasses
import pathlib
import sys
from collections.abc import Iterator

try:
    import matplotlib
    from PIL import Image, ImageDraw, ImageFont
except ImportError:
    sys.exit("pointnav_replay.py needs matplotlib: pip install matplotlib")
import numpy as np
from play_pointnav import WEIGHTS, sensor_of
from pointnav_files import aside
from pointnav_policy import HIDDEN, Policy, load
from pointnav_worlds import (HELD_OUT_SEEDS, Worlds, device_of, goals, images_of, number, run_program, sensors_of,
                             world_arguments)

import gsnav

SIDE, TOP, FAR = 192, 26, 6.0  # pixels of an image and of the space above it; depth at the end of the scale, metres
WIDTH, HEIGHT = 800, 306
MAP = (470, TOP, WIDTH - 10, HEIGHT - 44)  # left, top, right, bottom
INK, FLOOR, SHORTEST, TAKEN, GOAL = "#202020", "#dcdcdc", "#2a9d3a", "#1f5fd0", "#d62728"
VIEW = gsnav.SensorSpec(uuid="view", kind=gsnav.SensorKind.rgb, resolution=[SIDE, SIDE])  # not seen by the agent


@dataclasses.dataclass
class Moment:
    """A step of an episode. `end` holds the metrics after the last one."""

    images: np.ndarray
    view: np.ndarray
    at: np.ndarray
    forward: np.ndarray
    distance: float
    end: gsnav.EpisodeMetrics | None = None


def flat_of(episode: int) -> int:
    """The flat of a held-out episode of play_pointnav.py."""
    return HELD_OUT_SEEDS[episode % len(HELD_OUT_SEEDS)]


def play(args: argparse.Namespace, policy: Policy, number: int) -> tuple[Worlds, gsnav.PointNavEpisode, list[Moment]]:
    """Plays held-out episode `number` of play_pointnav.py, by the most probable actions."""
    flat, k = flat_of(number), number // len(HELD_OUT_SEEDS)
    worlds = Worlds(range(flat, flat + 1), args, k + 1)
    simulator = worlds.simulator(args, 1, [*sensors_of(args, not policy.channels), VIEW],
                                 lambda environment, count: worlds.episodes[k], memory=gsnav.ImageMemory.host)
    seen, start = simulator.reset(), np.ones(1, np.bool_)
    hidden, action = np.zeros((1, HIDDEN), np.float32), np.zeros(1, np.int64)
    moments: list[Moment] = []
    world = simulator.world(0)
    while not moments or moments[-1].end is None:
        agent, images = world.agent, images_of(seen, args, not policy.channels)
        moments.append(Moment(seen.images["view"][0].copy() if images is None else images[0].copy(),
                              seen.images["view"][0].copy(), agent.position, agent.forward(), world.distance_to_goal,
                              world.metrics() if world.done else None))
        if not world.done and len(moments) <= args.steps:
            log_p, hidden = policy.act(images, goals(seen), action, start, hidden)
            action, start = log_p.argmax(-1), np.zeros(1, np.bool_)
            seen = simulator.step(action)
        elif not world.done:
            moments[-1].end = world.metrics()
    return worlds, worlds.episodes[k].episode, moments


def colored(images: np.ndarray) -> Image.Image:
    """Depth by the scale, or colours."""
    if images.shape[-1] == 1:
        images = matplotlib.colormaps["inferno_r"](np.minimum(images[..., 0] / FAR, 1))
    return Image.fromarray(gsnav.to_bytes(np.ascontiguousarray(images[..., :3], np.float32)))


class Picture:
    """Draws the moments of an episode. Things that do not move are drawn once."""

    def __init__(self, navmesh: gsnav.NavMesh, episode: gsnav.PointNavEpisode, title: str, sees: str) -> None:
        self.image = Image.new("RGB", (WIDTH, HEIGHT), "white")
        self.font, self.large = ImageFont.load_default(14), ImageFont.load_default(20)
        self.pen = ImageDraw.Draw(self.image)
        vertices, triangles = navmesh.surface()
        low, high = vertices.min(0)[[0, 2]], vertices.max(0)[[0, 2]]
        left, top, right, bottom = MAP
        self.scale = float(((right - left, bottom - top) / (high - low)).min())  # pixels per metre
        self.origin = np.array([left, top]) - self.scale * low
        for triangle in triangles:
            self.pen.polygon(self.pixels(vertices[triangle]), FLOOR, FLOOR)
        shortest = navmesh.find_path(episode.start_position, episode.goal_position).points
        self.pen.line(self.pixels(shortest), SHORTEST, 3)
        self.mark(episode.start_position, 4, INK)
        self.mark(episode.goal_position, 6, GOAL)
        self.pen.line([(right - self.scale, TOP - 10), (right, TOP - 10)], INK, 2)
        self.text(right - self.scale - 28, 6, "1 m")
        self.text(left, 6, title)
        self.text(10, 6, f"agent's {sees}")
        self.text(260, 6, "the view in colour")
        self.legend(left - 16, HEIGHT - 30)
        if sees[:5] == "depth":
            ramp = np.linspace(0, FAR, SIDE)[:, None, None].repeat(12, 1)
            self.image.paste(colored(ramp), (10 + SIDE + 6, TOP))
            for metres in range(0, int(FAR) + 1, 2):
                y = TOP + (SIDE - 14) * metres / FAR
                self.text(10 + SIDE + 22, int(y), f"{metres} m")

    def pixels(self, points: np.ndarray) -> list[tuple[float, float]]:
        """Points of the world, [N][3], on the map."""
        return [(float(x), float(z)) for x, z in self.origin + self.scale * np.asarray(points)[:, [0, 2]]]

    def mark(self, point: np.ndarray, radius: float, color: str) -> None:
        (x, y), = self.pixels(point[None])
        self.pen.ellipse((x - radius, y - radius, x + radius, y + radius), color, "white")

    def text(self, x: float, y: float, words: str, color: str = INK) -> None:
        self.pen.text((x, y), words, color, self.font)

    def legend(self, x: int, y: int) -> None:
        """Explains the colours of the map."""
        for words, color, dot in (("shortest path", SHORTEST, False), ("path so far", TAKEN, False),
                                  ("goal", GOAL, True), ("start", INK, True)):
            if dot:
                self.pen.ellipse((x, y + 4, x + 10, y + 14), color)
            else:
                self.pen.line([(x, y + 9), (x + 16, y + 9)], color, 3)
            x += 16 if dot else 22
            self.text(x, y, words)
            x += int(self.font.getlength(words)) + 14

    def draw(self, moments: list[Moment], step: int) -> Image.Image:
        """The picture after a number of steps."""
        moment, picture = moments[step], copy.copy(self)
        picture.image = self.image.copy()
        picture.pen = ImageDraw.Draw(picture.image)
        shown = colored(moment.images).resize((SIDE, SIDE), Image.Resampling.NEAREST)
        picture.image.paste(shown, (10, TOP))
        picture.image.paste(colored(moment.view), (260, TOP))
        taken = np.array([m.at for m in moments[:step + 1]])
        picture.pen.line(picture.pixels(taken), TAKEN, 3)
        side = np.cross(moment.forward, [0, 1, 0])
        tip = [moment.forward * 0.32, side * 0.17 - moment.forward * 0.16, -side * 0.17 - moment.forward * 0.16]
        picture.pen.polygon(picture.pixels(moment.at + np.array(tip)), TAKEN, "white")
        y = TOP + SIDE + 12
        picture.text(10, y, f"step {step}")
        picture.text(120, y, f"{moment.distance:.1f} m to the goal")
        if moment.end is not None:
            ends = "success" if moment.end.success else "no success"
            picture.pen.text((10, y + 24), f"{ends}, SPL {moment.end.spl:.2f}",
                             SHORTEST if moment.end.success else GOAL, self.large)
        return picture.image


def frames(args: argparse.Namespace, policy: Policy) -> Iterator[tuple[Image.Image, int]]:
    """Pictures of all episodes, and how long each one is shown, milliseconds."""
    sees = f"{args.sensor}, {args.size} x {args.size}" if policy.channels else "view (it is blind)"
    for number in args.episodes:
        worlds, episode, moments = play(args, policy, number)
        navmesh, end = worlds.scenes[0].navmesh, moments[-1].end
        assert navmesh is not None and end is not None
        flat = flat_of(number)
        print(f"episode {number}, flat {flat}: {len(moments) - 1} steps, success {end.success:.0f}, SPL {end.spl:.2f}")
        picture = Picture(navmesh, episode, f"held-out flat {flat}, episode {number}", sees)
        last = len(moments) - 1
        for step in [*range(0, last, args.every), last]:
            yield picture.draw(moments, step), 2500 if step == last else args.milliseconds


def main() -> None:
    """Writes the moving picture."""
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--out", type=pathlib.Path, default="replay.webp", help="file to write, an animated WebP")
    p.add_argument("--weights", type=pathlib.Path, default=WEIGHTS, help="checkpoint.pt, or a file of --save-weights")
    p.add_argument("--episodes", type=number(int, 0, 10**6), nargs="+", default=[0], help="held-out episodes, from 0")
    p.add_argument("--steps", type=number(int, 1), default=500, help="steps after which an episode is left")
    p.add_argument("--every", type=number(int, 1), default=1, help="steps from one picture to the next")
    p.add_argument("--milliseconds", type=number(int, 1), default=100, help="how long a picture is shown")
    p.add_argument("--compression", type=int, default=60, choices=range(101), metavar="0..100",
                   help="quality of the compressed pictures")
    world_arguments(p)
    args = p.parse_args()
    if args.out.suffix != ".webp":
        p.error(f"--out {args.out}: the name must end in .webp")
    if not args.out.absolute().parent.is_dir():
        p.error(f"--out {args.out}: there is no folder {args.out.parent}")
    if args.out.is_dir():
        p.error(f"--out {args.out}: is a folder")
    args.device = device_of(args.device).name
    policy = load(args.weights)
    args.size, args.sensor = policy.size, sensor_of(policy)
    pictures, times = zip(*frames(args, policy))
    with aside(args.out) as part:  # A program that is stopped leaves an older picture as it was.
        pictures[0].save(part, "WEBP", save_all=True, append_images=pictures[1:], duration=list(times), loop=0,
                         quality=args.compression, method=6)
    print(f"{args.out}: {len(pictures)} pictures, {args.out.stat().st_size:,} bytes")


if __name__ == "__main__":
    run_program(main)
