#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the table of CPU renderers in docs/benchmarks.md: time, error and memory of gsnav and baselines.

    tools/cpu_table.py --build build/dev            # the flats that gsnav-scene makes
    tools/cpu_table.py --build build/dev --scene flat=flat.ply:cameras.json --baseline NAME=BINARY

A scene is any file that gsnav-convert reads; all renderers get the same PLY. A baseline is a binary or a
C++ source. It is called as `CAMERAS=cameras.json BINARY SCENE.ply WIDTH HEIGHT THREADS REPEATS`, and
prints `total X ms` (median over views) and `RSS X MB`. It may compare its images with those of the folder
that REFERENCE names, and print `PSNR X dB`. Baselines and gsnav take turns for each size.
Scenes, binaries and float64 references are kept in --cache. Times are medians over all views of the
fastest turn; errors are those of the worst of four evenly spread views.
"""
import argparse
import collections
import json
import os
import pathlib
import re
import subprocess
import sys
import textwrap
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROFILES = ("exact", "fast")
Baseline = collections.namedtuple("Baseline", "source least_gain")
BASELINES = {"prototype": Baseline("proto.cpp", 2), "row renderer": Baseline("surrogate.cpp", 4)}
FLATS = {"flat 100K": 100_000, "flat 300K": 300_000, "flat 1M": 1_000_000}
BASELINE_LINES = {"ms": r"total ([\d.]+) ms", "MB": r"RSS (\d+) MB", "psnr": r"PSNR (-?[\d.]+) dB"}
TIMEOUT_S = 900
# Bound on spinning in GNU's OpenMP, for all renderers alike. Without it a waiting thread may occupy the core that
# the working thread needs, for 8 ms at every barrier.
SPIN_BOUND = {"GOMP_SPINCOUNT": os.environ.get("GOMP_SPINCOUNT", "20000")}


def stop(message):
    sys.exit(f"cpu_table.py: {message}")


def run(command, env=None, **kwargs):
    """Standard output of a command. If it fails, ends the program with the end of its error output."""
    try:
        done = subprocess.run([str(c) for c in command], env={**os.environ, **SPIN_BOUND, **(env or {})}, text=True,
                              capture_output=True, timeout=TIMEOUT_S, **kwargs)
    except (OSError, subprocess.TimeoutExpired) as error:
        stop(f"{command[0]}: {error}")
    if done.returncode != 0:
        said = (done.stderr or done.stdout)[-600:].strip()
        stop(f"{' '.join(map(str, command))} ended with {done.returncode}: {said}")
    return done.stdout


def busy_share(seconds):
    """Share of all cores that was busy during `seconds`."""
    def ticks():
        fields = [int(f) for f in pathlib.Path("/proc/stat").read_text().split("\n")[0].split()[1:]]
        return sum(fields), fields[3] + fields[4]
    total, idle = ticks()
    time.sleep(seconds)
    total2, idle2 = ticks()
    return 1 - (idle2 - idle) / max(1, total2 - total)


def wait_until_quiet(limit_s, what):
    """Waits until other programs are idle, since they would disturb times. Returns the share of cores still busy."""
    end = time.monotonic() + limit_s
    while (busy := busy_share(0.5)) > 0.1 and time.monotonic() < end:
        pass
    if busy > 0.1:
        print(f"cpu_table.py: warning: {what}: {busy:.0%} of the processor is busy with something else",
              file=sys.stderr)
    return busy


def program(build, name):
    for path in (build / "bench" / name, build / "tools" / name):
        if path.is_file():
            return path
    stop(f"{name} is not in {build}: cmake --build {build} --target {name}")


def compiled(source, cache, flags):
    """Path of the binary of a C++ source, which is built once."""
    binary = cache / source.stem
    if not binary.exists() or binary.stat().st_mtime < source.stat().st_mtime:
        run(["g++", "-O3", "-fopenmp", "-std=c++17", "-w", *flags, source, "-o", binary])
    return binary


def default_scenes(build, cache):
    """(name, PLY, cameras) of the flats that gsnav-scene makes."""
    scenes = []
    for name, count in FLATS.items():
        ply, cameras = cache / f"flat_{count}.ply", cache / f"flat_{count}.json"
        if not (ply.exists() and cameras.exists()):
            run([program(build, "gsnav-scene"), "flat", "--gaussians", count, "--out", ply, "--cameras", cameras,
                 "--views", 64, "--width", 256, "--height", 256, "--hfov", 90])
        scenes.append((name, str(ply), str(cameras)))
    return scenes


def parse_scene(text):
    found = re.fullmatch(r"([^=]+)=(.+):(.+\.json)", text)
    if not found:
        stop(f"--scene {text}: use NAME=PATH:CAMERAS.json")
    return found.groups()


def as_ply(build, name, path, cache):
    if path.endswith(".ply") and "," not in path:
        return path
    ply = cache / (re.sub(r"\W+", "_", name) + ".ply")
    if not ply.exists():
        run([program(build, "gsnav-convert"), path, ply])
    return str(ply)


def parse_baseline(text, cache):
    name, _, path = text.partition("=")
    if not path or not pathlib.Path(path).is_file():
        stop(f"--baseline {text}: use NAME=BINARY or NAME=SOURCE.cpp")
    path = pathlib.Path(path)
    return name, compiled(path, cache, ["-march=native"]) if path.suffix == ".cpp" else path.resolve()


def reference_images(build, name, ply, cameras, size, cache):
    """Folder of NNNN.rgb.npy: float64 images of four evenly spread views, or of all if there are fewer."""
    folder = cache / "images" / (re.sub(r"\W+", "_", name) + f"_{size[0]}x{size[1]}")
    if not folder.exists():
        views = json.loads(pathlib.Path(cameras).read_text())
        judged = [views[i * len(views) // 4] for i in range(4)] if len(views) > 4 else views
        for view in judged:
            scale = size[0] / view["width"]  # square pixels, as bench_render
            view.update(width=size[0], height=size[1], fx=view["fx"] * scale, fy=view["fy"] * scale)
        made = folder.with_name(folder.name + ".part")
        made.mkdir(parents=True, exist_ok=True)
        (made / "cameras.json").write_text(json.dumps(judged))
        run([program(build, "gsnav-render"), "--scene", ply, "--cameras", made / "cameras.json", "--device",
             "serial64", "--up", "keep", "--npy", "--out", made])
        made.rename(folder)
    return folder


def time_baseline(binary, ply, cameras, size, threads, repeats, reference):
    out = run([binary, ply, *size, threads, repeats],
              env={"CAMERAS": cameras, **({"REFERENCE": str(reference)} if reference else {})})
    row = {key: float(found.group(1)) for key, pattern in BASELINE_LINES.items() if (found := re.search(pattern, out))}
    if "ms" not in row:
        stop(f"{binary} printed no `total X ms`: {out[-300:]}")
    return row


def time_gsnav(bench, ply, cameras, size, threads, repeats, cache, judged):
    """Rows of bench_render by profile and threads. At 256x256 also the row of a batch, with the most threads."""
    shape = f"{size[0]}x{size[1]}"
    names = "|".join(f"openmp{t}/rgb/({'|'.join(PROFILES)})/{shape}/" for t in threads)
    if judged and size == (256, 256):
        names += f"|openmp{threads[-1]}/batch64/rgb/fast/{shape}/"
    out = run([bench, f"--benchmark_filter=^({names})", "--benchmark_format=json"],
              env={"GSNAV_BENCH_SCENE": ply, "GSNAV_BENCH_CAMERAS": cameras, "GSNAV_BENCH_REPEATS": str(repeats),
                   "GSNAV_BENCH_REFERENCES": str(cache / "references"),
                   **({} if judged else {"GSNAV_BENCH_TIMES_ONLY": "1"})})
    rows = {}
    for row in json.loads(out)["benchmarks"]:
        backend, sensor, profile = row["name"].split("/")[:3]
        key = "batch" if sensor == "batch64" else f"{profile} {backend.removeprefix('openmp')}"
        rows[key] = {k: v for k, v in row.items() if isinstance(v, (int, float))}
    return rows


def best(rounds):
    """The fastest of several rounds of one measurement, since disturbances only slow a round down. Only the first
    round has floor and error."""
    first, fastest = rounds[0], min(rounds, key=lambda r: r.get("median_ms", r.get("ms", 0)))
    out = {**first, **fastest}
    for ratio in {"floor_ratio", "floor_ratio_best"} & first.keys():
        out[ratio] = first[ratio] * fastest["median_ms"] / first["median_ms"]
    return out


def measure(options, scenes, baselines):
    bench, rows = program(options.build, "bench_render"), []
    for name, path, cameras in scenes:
        ply = as_ply(options.build, name, path, options.cache)
        for size in options.sizes:
            busy = wait_until_quiet(options.quiet, f"{name} {size[0]}x{size[1]}")
            begin, ours, theirs = time.monotonic(), {}, {}
            for number in range(options.rounds):
                turns = [*baselines, None]
                turns = turns[number % len(turns):] + turns[:number % len(turns)]
                for turn in turns:
                    if turn is None:
                        for k, v in time_gsnav(bench, ply, cameras, size, options.threads, options.repeats,
                                               options.cache, number == 0).items():
                            ours.setdefault(k, []).append(v)
                    else:
                        reference = number == 0 and reference_images(options.build, name, ply, cameras, size,
                                                                     options.cache)
                        theirs.setdefault(turn[0], []).append(time_baseline(
                            turn[1], ply, cameras, size, options.threads[-1], options.repeats, reference))
            rows.append({"scene": name, "size": f"{size[0]}x{size[1]}", "busy_before": busy,
                         "gsnav": {k: best(v) for k, v in ours.items()},
                         "baselines": {k: best(v) for k, v in theirs.items()}})
            print(f"{name} {rows[-1]['size']}: {time.monotonic() - begin:.0f} s", file=sys.stderr, flush=True)
    return rows


def number(value, digits=3):
    """Three significant digits, without an exponent."""
    decimals = max(0, digits - len(str(int(abs(value)))))
    return f"{value:.{min(decimals, 2)}f}"


def table(rows, threads, baselines):
    most = threads[-1]

    def pair(row, key):
        return " / ".join(number(row["gsnav"][f"{p} {most}"][key]) for p in PROFILES)

    counts = " / ".join(map(str, threads))
    judged = [b for b in baselines if all("psnr" in row["baselines"][b] for row in rows)]
    head = ["scene", "size", *(f"{p}, ms on {counts} threads" for p in PROFILES), "times the floor",
            *(f"{b}, ms (times gsnav's)" for b in baselines), "PSNR, dB", *(f"PSNR of {b}, dB" for b in judged),
            "memory, MB"]
    lines = [" | ".join(head), "|".join(["---"] * 2 + ["---:"] * (len(head) - 2))]
    for row in rows:
        ours = row["gsnav"]
        cells = [row["scene"], row["size"]]
        cells += [" / ".join(number(ours[f"{p} {t}"]["median_ms"]) for t in threads) for p in PROFILES]
        cells.append(pair(row, "floor_ratio"))
        for b in baselines:
            ms = row["baselines"][b]["ms"]
            ratios = " / ".join(number(ms / ours[f"{p} {most}"]["median_ms"]) for p in PROFILES)
            cells.append(f"{number(ms)} ({ratios})")
        cells.append(" / ".join(f"{ours[f'{p} {most}']['rgb_psnr']:.0f}" for p in PROFILES))
        cells += [f"{row['baselines'][b]['psnr']:.0f}" for b in judged]
        fast = ours[f"fast {most}"]
        cells.append(f"{fast['scene_MB'] + fast['scratch_MB']:.0f}")
        lines.append(" | ".join(cells))
    return "\n".join(f"| {line} |" if "---" not in line else f"|{line}|" for line in lines)


def caption(options, baselines):
    model = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    text = (f"RGB, medians over all views, on {options.threads[-1]} cores of "
            f"{model.group(1) if model else 'a processor'}"
            f" where nothing else is said; of two numbers the first is `{PROFILES[0]}`, the second `{PROFILES[1]}`."
            " The floor is what a frame's work would take at the measured bandwidth and clock and the best unit costs"
            " known (`bench/floor.hpp`). PSNR: the worst of four evenly spread views, against float64."
            " Memory: scene and scratch.")
    if made := [b for b in baselines if b in BASELINES]:
        text += (f" {' and '.join(made).capitalize()}: throwaway AVX-512 baselines with the same near plane,"
                 " guard band, cuts and stop.")
    return "\n".join(textwrap.wrap(text, 110))


def summary(rows, threads, baselines):
    """Lines on the limits that all rows must keep, each with the row that is worst."""
    most, lines = threads[-1], []

    def worst(title, value, limit, at_most):
        values = [(v, f"{r['scene']} {r['size']}") for r in rows if (v := value(r)) is not None]
        if values:
            v, where = (max if at_most else min)(values)
            held, sign = (v <= limit, "<=") if at_most else (v >= limit, ">=")
            lines.append(f"{'ok  ' if held else 'MISS'} {title}: {number(v)} ({where}), wanted {sign} {limit}")

    def of(row, profile, key, t=most):
        return row["gsnav"][f"{profile} {t}"][key]

    for p in PROFILES:
        worst(f"{p}, times the floor", lambda r: of(r, p, "floor_ratio"), 1.5, True)
    worst("fast, PSNR", lambda r: of(r, "fast", "rgb_psnr"), 60, False)
    worst("exact over fast", lambda r: of(r, "exact", "median_ms") / of(r, "fast", "median_ms"), 1.6, True)
    worst(f"{threads[0]} to {most} threads, fast", lambda r: of(r, "fast", "median_ms", threads[0]) /
          of(r, "fast", "median_ms"), 1.8, False)
    for b in baselines:
        if b in BASELINES:
            worst(f"{b} over fast", lambda r: r["baselines"][b]["ms"] / of(r, "fast", "median_ms"),
                  BASELINES[b].least_gain, False)
    worst("batch of 64, frames per second", lambda r: r["gsnav"].get("batch", {}).get("gain"), 1.3, False)
    worst("batch of 64, bits that differ", lambda r: r["gsnav"].get("batch", {}).get("bits_differ"), 0, True)
    for size in dict.fromkeys(r["size"] for r in rows):
        unit = [f"{r['scene']} {1e6 * of(r, 'fast', 'median_ms') / of(r, 'fast', 'visible+fragments'):.3f}"
                for r in rows if r["size"] == size]
        lines.append(f"ns per visible Gaussian or evaluated fragment at {size}: {', '.join(unit)}")
    return "\n".join(lines)


def parse_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True,
                        help="build folder with bench_render, gsnav-convert and gsnav-scene")
    parser.add_argument("--scene", action="append", default=[], metavar="NAME=PATH:CAMERAS.json")
    parser.add_argument("--only", default="", metavar="TEXT", help="only scenes with this in their name")
    parser.add_argument("--baseline", action="append", default=[], metavar="NAME=BINARY",
                        help="baseline; NAME=SOURCE.cpp compiles it")
    parser.add_argument("--baselines", type=pathlib.Path, metavar="FOLDER",
                        help="folder of the baselines' sources: " + ", ".join(b.source for b in BASELINES.values()))
    parser.add_argument("--sizes", default="256x256,640x480,1920x1080", help="sizes that bench_render has")
    parser.add_argument("--threads", default="1,2", help="thread counts that bench_render has")
    parser.add_argument("--repeats", type=int, default=1, help="frames per view")
    parser.add_argument("--rounds", type=int, default=2, help="turns of each renderer; the fastest counts")
    parser.add_argument("--quiet", type=float, default=30, metavar="S",
                        help="seconds to wait for an idle machine before each size")
    parser.add_argument("--cache", type=pathlib.Path,
                        help="folder for scenes, binaries and references (default: BUILD/cpu_table)")
    parser.add_argument("--out", type=pathlib.Path,
                        help="Markdown file, with JSON next to it (default: CACHE/table.md)")
    options = parser.parse_args()
    options.build = options.build.resolve()
    if not (options.build / "CMakeCache.txt").exists():
        stop(f"--build {options.build}: no build folder")
    options.cache = (options.cache or options.build / "cpu_table").resolve()
    options.cache.mkdir(parents=True, exist_ok=True)
    options.out = options.out or options.cache / "table.md"
    if not options.out.absolute().parent.is_dir():
        stop(f"--out {options.out}: there is no folder {options.out.parent}")
    options.threads = sorted(int(t) for t in options.threads.split(","))
    options.sizes = [tuple(int(n) for n in s.split("x")) for s in options.sizes.split(",")]
    return options


def write(path, text):
    """Writes a file beside its place and renames it. After an error, nothing of it is left."""
    part = path.with_name(f".part-{path.name}")
    try:
        part.write_text(text)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def main():
    options = parse_options()
    scenes = [parse_scene(s) for s in options.scene] or default_scenes(options.build, options.cache)
    scenes = [s for s in scenes if options.only in s[0]]
    if not scenes:
        stop(f"no scene has {options.only} in its name; name some by --scene")
    named = list(options.baseline)
    if options.baselines:
        named += [f"{n}={options.baselines / b.source}" for n, b in BASELINES.items()]
    baselines = [parse_baseline(b, options.cache) for b in named]
    rows = measure(options, scenes, baselines)
    names = [b[0] for b in baselines]
    text = caption(options, names) + "\n\n" + table(rows, options.threads, names)
    write(options.out, text + "\n")
    write(options.out.with_suffix(".json"), json.dumps(rows, indent=1) + "\n")
    print(text + "\n\n" + summary(rows, options.threads, names))


if __name__ == "__main__":
    main()
