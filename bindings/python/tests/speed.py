# SPDX-License-Identifier: Apache-2.0
"""Compares the frames per second of VectorEnv with those of the C++ batch.

Two take turns, so that the numbers of a pair belong to the same state of the machine. The first pair, which
allocates memory, is not counted. First a VectorEnv is compared with a process without Python that draws the same
frames. On a GPU, two processes of one program differ by up to 19 %, whatever they run. So a VectorEnv is also compared
with its own simulator, which C++ steps without Python between the steps. Their turns are single steps, and the frames
are neighbours.

    speed.py REFERENCE --side 64 --sensors depth
    speed.py REFERENCE --side 128
    speed.py REFERENCE --side 256 --device cuda --steps 100
"""

import argparse
import statistics
import subprocess
import time

import numpy as np

import gsnav

DENSITY = 0.3


class Reference:
    """The C++ batch in a process of its own."""

    def __init__(self, args):
        sizes = map(str, (args.environments, args.side, 0, DENSITY))
        self.process = subprocess.Popen([args.reference, *sizes, args.sensors, args.device], text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def ms(self, steps):
        """Milliseconds per step of the next steps."""
        self.process.stdin.write(f"{steps}\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class Ours:
    """A VectorEnv, stepped as the C++ batch is."""

    def __init__(self, scene, args, copy):
        episode = gsnav.generate_episodes(scene.navmesh, 1, 1)
        sensors = gsnav.rgbd_sensors(args.side, args.side)[1 if args.sensors == "depth" else 0:]
        images = gsnav.ImageMemory.backend if args.device.startswith("cuda") else gsnav.ImageMemory.host
        self.envs = gsnav.VectorEnv(args.environments, scene, device=args.device, episodes=episode, copy=copy,
                                    config=gsnav.BatchConfig(sensors=sensors, images=images))
        self.envs.reset(seed=1)
        self.step = 0

    def actions(self, steps):
        """Actions of the next steps."""
        self.step += steps
        return [1 + (np.arange(self.envs.num_envs) + k) % 3 for k in range(self.step - steps, self.step)]

    def ms(self, steps):
        """Milliseconds per step of the next steps."""
        seconds = 0.0
        for actions in self.actions(steps):
            start = time.perf_counter()
            self.envs.step(actions)
            seconds += time.perf_counter() - start
        return 1000 * seconds / steps

    def ms_without_python(self, steps):
        """The same of C++, in the same simulator. Only with copy=False."""
        return 1000 * self.envs.simulator._time_steps(self.actions(steps)) / steps


def compare(args, name, theirs, ours, steps, pairs):
    """Prints the ratio of frames per second of two functions that return milliseconds per step."""
    both, times = [theirs, ours], []
    for _ in range(pairs + 1):
        taken = {ms: ms(steps) for ms in both}
        times.append((taken[theirs], taken[ours]))
        both.reverse()
    del times[0]
    ratios = sorted(100 * one / other for one, other in times)
    one, other = (statistics.median(column) for column in zip(*times))
    print(f"{args.device}, {args.environments} environments, {args.side} x {args.side} {args.sensors}: VectorEnv has "
          f"{statistics.median(ratios):.1f} % of the frames per second of {name} (pairs {ratios[0]:.1f} to "
          f"{ratios[-1]:.1f}; medians {one:.4f} and {other:.4f} ms per step)")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reference", help="the program gsnav_python_reference")
    parser.add_argument("--environments", type=int, default=256)
    parser.add_argument("--side", type=int, default=64, help="rows and columns of an image")
    parser.add_argument("--sensors", choices=["rgbd", "depth"], default="rgbd")
    parser.add_argument("--device", default="cpu", help="name of a device; on a GPU, images stay there")
    parser.add_argument("--steps", type=int, default=10, help="steps of a turn")
    parser.add_argument("--pairs", type=int, default=12, help="pairs of turns")
    args = parser.parse_args()
    if args.steps < 1 or args.pairs < 1:
        parser.error("--steps and --pairs must be positive")
    scene = gsnav.default_simulator_scene(people=0, seed=1, density=DENSITY)
    for copy in (True, False):
        reference, ours = Reference(args), Ours(scene, args, copy)
        compare(args, f"another process, copy={copy}", reference.ms, ours.ms, args.steps, args.pairs)
        reference.close()
    ours = Ours(scene, args, copy=False)
    compare(args, "its own simulator in C++", ours.ms_without_python, ours.ms, 1, args.steps * args.pairs)


if __name__ == "__main__":
    main()
