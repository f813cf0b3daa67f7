#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Times DD-PPO of habitat-baselines, unmodified, that learns PointNav on gsnav.

    steps_per_second.py --environments 64 --ranks 1 --device cuda
    steps_per_second.py --gaussians 20000 --side 64 --environments 4 --steps 16 --device cpu

Makes a flat with episodes, and starts --ranks processes of habitat_baselines.run, which share the cores and the GPUs.
A bias of --stop-bias on the action stop makes episodes as long as those of a trained policy. Times are those of
--updates updates after --warm ones. Settings of habitat-baselines may follow, as NAME=VALUE.

Prints the steps per second of all ranks, and the milliseconds of rank 0 per step of its environments. Drawing overlaps
with other work of the environments, and is not known with --workers. Learning includes the wait for other ranks.
Needs gsnav, gsnav-habitat, habitat-lab and habitat-baselines (docs/guide/habitat_lab.md).
"""

import argparse
import json
import os
import pathlib
import runpy
import shlex
import signal
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
FACTORY = "habitat_baselines.vector_env_factory._target_=gsnav.habitat.BatchVectorEnvFactory"


def make_pack(folder, gaussians, episodes):
    """Writes a flat and its episodes into a folder, unless they are there."""
    if (folder / "data").exists():
        return
    sys.path.insert(0, str(ROOT / "tools"))
    import gsnav
    import make_habitat_pack

    usual = gsnav.open_scene("default").gaussian_count
    if not 0.05 <= gaussians / usual <= 20:
        sys.exit(f"--gaussians {gaussians}: must be 0.05 to 20 times the {usual} of the flat")
    flat = gsnav.open_scene("default", gsnav.OpenOptions(density=gaussians / usual))
    folder.mkdir(parents=True, exist_ok=True)
    gsnav.io.save_scene(folder / "flat.ply", flat.scene.assets[0].cloud)
    make_habitat_pack.make_of_scans(folder, [folder / "flat.ply"], episodes, 10)


def settings_of(o, folder, pack):
    """Arguments of habitat_baselines.run."""
    data, trainer, sensors = "habitat.dataset", "habitat_baselines", "habitat.simulator.agents.main_agent.sim_sensors"
    return [
        f"--config-name={o.config}", f"hydra.run.dir={folder}/hydra", f"{data}.split=train",
        f"{data}.data_path={pack}/data/datasets/pointnav/habitat-test-scenes/v1/train/train.json.gz",
        f"{data}.scenes_dir={pack}/data/scene_datasets",
        *(f"{sensors}.{s}_sensor.{k}={o.side}" for s in ("rgb", "depth") for k in ("width", "height")),
        f"{trainer}.trainer_name=ddppo", f"{trainer}.num_environments={o.environments}",
        f"{trainer}.total_num_steps=-1.0", f"{trainer}.num_updates={o.warm + o.updates}",
        f"{trainer}.rl.ppo.num_steps={o.steps}", f"{trainer}.num_checkpoints=1",
        f"{trainer}.rl.ddppo.force_distributed=True", f"{trainer}.rl.ddppo.distrib_backend={o.backend}",
        f"{trainer}.checkpoint_folder={folder}/checkpoints", f"{trainer}.tensorboard_dir={folder}/tb",
        f"{trainer}.log_file={folder}/train.log", *([] if o.workers else [FACTORY]), *o.override,
    ]  # fmt: skip


def timed(function, times):
    """The same function, which appends its begin and end to a list. It may run on any thread."""

    def run(*arguments):
        start = time.perf_counter()
        value = function(*arguments)
        times.append((start, time.perf_counter()))
        return value

    return run


def result_of(marks, drawings):
    """Rates, and milliseconds by part. A mark has the time, the steps so far, and sums and numbers of the trainer's
    times."""
    (begin, steps, before), (end, all_steps, after) = marks[0], marks[-1]
    each = 1e3 / (after["trainer.step_env"][1] - before["trainer.step_env"][1])

    def ms(*names):
        return each * sum(after[f"trainer.{n}"][0] - before[f"trainer.{n}"][0] for n in names)

    drawn, until = 0.0, begin  # Drawings of several threads overlap.
    for first, last in sorted(drawings):
        drawn, until = drawn + max(0.0, min(last, end) - max(first, until)), max(until, last)
    parts = {"environments": ms("step_env"), "trainer: collecting": ms("update_stats"),
             "trainer: policy": ms("sample_action", "obs_insert"), "trainer: learning": ms("update_agent")}  # fmt: skip
    parts |= {"the rest": each * (end - begin) - sum(parts.values()), "all": each * (end - begin)}
    return {"rate": (all_steps - steps) / (end - begin), "parts": parts,
            "rates": [(b[1] - a[1]) / (b[0] - a[0]) for a, b in zip(marks, marks[1:])],
            "drawing": f"{each * drawn:.1f} ms" if drawings else "an unknown time"}  # fmt: skip


def run_rank(o, folder, pack):
    """Trains as one rank in its own process. Rank 0 writes result.json."""
    sys.path.insert(0, str(ROOT / "bindings/habitat/tests"))
    import torch
    from compare_vector_envs import memory
    from habitat_baselines.rl.ppo.ppo_trainer import PPOTrainer
    from habitat_baselines.utils.timing import g_timer
    from habitat_sim._draw import Painter

    rank, gpus = int(os.environ["RANK"]), torch.cuda.device_count()
    os.environ["LOCAL_RANK"] = str(rank % max(1, gpus))  # The number of its GPU.
    torch.set_num_threads(max(1, len(os.sched_getaffinity(0)) // o.ranks))
    begin, log = PPOTrainer._init_train, PPOTrainer._training_log
    marks, drawings, used = [], [], {}
    for name in ("_draw_place", "_draw_places"):
        setattr(Painter, name, timed(getattr(Painter, name), drawings))

    def begun(self, *arguments):
        begin(self, *arguments)
        with torch.no_grad():  # The action stop is the first.
            self._agent.actor_critic.action_distribution.linear.bias[0] = o.stop_bias

    def logged(self, *arguments):  # Called after every update.
        log(self, *arguments)
        if rank != 0 or self.num_updates_done < o.warm:
            return
        if gpus:
            torch.cuda.synchronize()
        if not used:
            ranks = pathlib.Path(f"/proc/{os.getppid()}/task/{os.getppid()}/children").read_text().split()
            free, total = torch.cuda.mem_get_info() if gpus else (0, 0)
            used.update(mb=sum(map(memory, ranks)), gpu_mb=(total - free) / 2**20)
        times = {name: (x.sum, x.count) for name, x in g_timer.items()}
        marks.append((time.perf_counter(), self.num_steps_done, times))
        if self.num_updates_done == o.warm + o.updates:
            (folder / "result.json").write_text(json.dumps({**result_of(marks, drawings), **used}))

    PPOTrainer._init_train, PPOTrainer._training_log = begun, logged
    sys.argv[1:] = settings_of(o, folder, pack)
    runpy.run_module("habitat_baselines.run", run_name="__main__")


def run_ranks(o, folder, pack):
    """Starts all ranks and waits for them. Returns what rank 0 wrote."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    threads = 1 if o.workers else max(1, len(os.sched_getaffinity(0)) // o.ranks)
    # Habitat-Baselines asks programs for the interface, unless it is given. They may be missing.
    given = {"MAIN_ADDR": "127.0.0.1", "MAIN_PORT": port, "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": port,
             "GLOO_SOCKET_IFNAME": "lo", "NCCL_SOCKET_IFNAME": "lo", "WORLD_SIZE": str(o.ranks),
             "OMP_NUM_THREADS": str(threads), **({"GSNAV_DEVICE": o.device} if o.device else {})}  # fmt: skip
    command = [sys.executable, str(ROOT / "bench/habitat/steps_per_second.py"), *sys.argv[1:],
               "--pack", str(pack.parent), "--rank-in", str(folder)]  # fmt: skip
    ranks, start, logs = [], time.monotonic(), [folder / f"rank_{r}.log" for r in range(o.ranks)]
    try:
        for r, name in enumerate(logs):
            given["RANK"], file = str(r), open(name, "wb")
            ranks.append(subprocess.Popen(
                command, cwd=folder, env={**os.environ, **given}, stdout=file, stderr=file, start_new_session=True))
        while time.monotonic() < start + o.seconds and {p.poll() for p in ranks} in ({None}, {None, 0}):
            time.sleep(0.2)
        failed = next((r for r, p in enumerate(ranks) if p.poll()), 0)
    finally:
        for p in ranks:
            if p.poll() is None:
                os.killpg(p.pid, signal.SIGKILL)
                p.wait()
    if (folder / "result.json").exists():
        return json.loads((folder / "result.json").read_text())
    sys.exit(f"{logs[failed].read_text(errors='replace')[-3000:]}\nNo result. Rank {failed} ended with these lines.")


def main():
    """Reads the arguments, makes the flat, runs the ranks, and prints tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, value, text in (
        ("gaussians", 1000000, "Gaussians of the flat"), ("episodes", 1000, "episodes in the flat"),
        ("side", 256, "width and height of colour and depth, pixels"), ("environments", 64, "environments per rank"),
        ("ranks", 1, "processes of DD-PPO"), ("warm", 1, "updates before the clock starts"),
        ("updates", 3, "updates that are timed"), ("steps", 128, "steps per environment and update"),
        ("stop-bias", -6.0, "bias of the action stop"), ("seconds", 3600.0, "the ranks are killed after this time"),
        ("config", "pointnav/ddppo_pointnav.yaml", "configuration of habitat-baselines"),
        ("backend", "GLOO", "of torch.distributed: GLOO, or NCCL with a GPU per rank"),
    ):  # fmt: skip
        parser.add_argument(f"--{name}", type=type(value), default=value, help=f"{text} (default: {value})")
    add = parser.add_argument
    add("--workers", action="store_true", help="a forkserver worker per environment, instead of one process")
    add("--device", help="GSNAV_DEVICE: cuda, cpu, cpu:2 (default: the GPU of the rank, if there is one)")
    add("--pack", type=pathlib.Path, help="folder in which the flat is kept (default: made again each time)")
    add("--rank-in", type=pathlib.Path, help=argparse.SUPPRESS)
    add("override", nargs="*", help="settings of habitat-baselines")
    o = parser.parse_args()
    if min(o.ranks, o.environments, o.warm, o.updates, o.steps) < 1:
        parser.error("--ranks, --environments, --warm, --updates, --steps: must be at least 1")
    with tempfile.TemporaryDirectory() as made:
        pack = (o.pack or pathlib.Path(made)).resolve() / f"flat_{o.gaussians}"
        if o.rank_in:
            return run_rank(o, o.rank_in, pack)
        make_pack(pack, o.gaussians, o.episodes)
        r = run_ranks(o, pathlib.Path(made), pack)
    way = "workers" if o.workers else "one process"
    print("| ranks | environments per rank | way | steps/s | slowest and fastest update | MB | GPU MB |\n"
          f"|---:|---:|---|---:|---:|---:|---:|\n| {o.ranks} | {o.environments} | {way} | {r['rate']:.1f} | "
          f"{min(r['rates']):.1f}, {max(r['rates']):.1f} | {r['mb']:.0f} | {r['gpu_mb']:.0f} |\n\n"
          f"| ms per step of all {o.environments} environments of rank 0 | |\n|---|---:|")  # fmt: skip
    print(*(f"| {name} | {x:.1f} |" for name, x in r["parts"].items()), sep="\n")
    print(f"\nDrawing ran {r['drawing']} of these.\n\n    "
          + shlex.join(["bench/habitat/steps_per_second.py", *sys.argv[1:]]))  # fmt: skip


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("stopped"))  # So that the ranks end, too.
    main()
