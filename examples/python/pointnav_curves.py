# SPDX-License-Identifier: Apache-2.0
"""Draws the curves of several training runs into one picture. Needs matplotlib.

    pointnav_curves.py meshes/log.csv gaussians/log.csv both/log.csv --metrics success spl --out curves.png

A run is named after the folder of its log, or after the log where the folder has several. Runs whose names would be
equal have the paths of their logs.
"""

from __future__ import annotations

import argparse
import csv
import pathlib
import sys
from collections.abc import Mapping, Sequence

from pointnav_files import aside, line_of

Run = Sequence[Mapping[str, float]]  # rows of log.csv


def read_run(log: pathlib.Path) -> list[dict[str, float]]:
    """Rows of a log.csv."""
    rows: list[dict[str, float]] = []
    try:
        with open(log, newline="") as file:
            lines = list(csv.DictReader(file))
    except (UnicodeError, csv.Error) as e:
        raise ValueError(f"{log}: no table of numbers: {e}") from None
    for line in lines:
        rows.append({})
        for name, value in line.items():
            try:
                rows[-1][name] = float(value)
            except (TypeError, ValueError):
                raise ValueError(f"{log}, row {len(rows)}: {name} is {value!r}, not a number") from None
    if not rows:
        raise ValueError(f"{log} has no rows")
    return rows


def plot(runs: Mapping[str, Run], axes: Sequence[Sequence[str]], out: pathlib.Path, mean: int = 1) -> None:
    """Writes a picture with a plot per group of metrics, over environment steps.

    runs: by name. A curve bears the name of its run, or of its metric if that is empty
    mean: number of updates of which a point of a curve is the mean
    """
    import matplotlib
    matplotlib.use("agg")
    from matplotlib import pyplot
    from matplotlib.backend_bases import FigureCanvasBase
    endings = [f".{name}" for name in sorted(FigureCanvasBase.get_supported_filetypes())]
    if out.suffix.lower() not in endings:
        raise ValueError(f"{out}: the name must end in {', '.join(endings[:-1])} or {endings[-1]}")
    figure, drawn = pyplot.subplots(1, len(axes), figsize=(5 * len(axes), 4), squeeze=False)
    for axis, metrics in zip(drawn[0], axes):
        for run, rows in runs.items():
            for metric in metrics:
                last = range(mean, len(rows) + 1)
                axis.plot([rows[i - 1]["frames"] for i in last],
                          [sum(row[metric] for row in rows[i - mean:i]) / mean for i in last], label=run or metric)
        axis.set_xlabel("environment steps")
        axis.set_ylabel(metrics[0] if len(metrics) == 1 else "")
        axis.grid(True)
        axis.legend()
    figure.tight_layout()
    try:
        with aside(out) as part:
            figure.savefig(part, dpi=100)
    finally:
        pyplot.close(figure)


def main() -> None:
    p = argparse.ArgumentParser(description="Draws the curves of training runs into one picture.")
    p.add_argument("logs", type=pathlib.Path, nargs="+", help="files log.csv of train_pointnav.py")
    p.add_argument("--metrics", nargs="+", default=["success", "spl"], help="columns of the logs, a plot each")
    p.add_argument("--mean", type=int, default=10, help="updates of which a point of a curve is the mean")
    p.add_argument("--out", type=pathlib.Path, default=pathlib.Path("curves.png"), help="picture to write")
    args = p.parse_args()
    try:
        logs = {log.resolve(): read_run(log) for log in args.logs}
    except (OSError, ValueError) as e:
        sys.exit(f"pointnav_curves.py: {e}")
    folders = [log.parent for log in logs]
    names = [log.parent.name if folders.count(log.parent) == 1 else log.stem for log in logs]
    runs = {name if names.count(name) == 1 else str(log): rows for name, (log, rows) in zip(names, logs.items())}
    for log, rows in logs.items():
        missing = [m for m in ("frames", *args.metrics) if m not in rows[0]]
        if missing:
            sys.exit(f"pointnav_curves.py: {log} has no column {missing[0]}; it has {', '.join(rows[0])}")
        if not 1 <= args.mean <= len(rows):
            sys.exit(f"pointnav_curves.py: --mean is {args.mean}, and {log} has {len(rows)} updates")
    try:
        plot(runs, [[metric] for metric in args.metrics], args.out, args.mean)
    except ImportError:
        sys.exit("pointnav_curves.py needs matplotlib: pip install matplotlib")
    except (OSError, RuntimeError, ValueError) as e:  # RuntimeError: .pgf needs LaTeX
        sys.exit(f"pointnav_curves.py: --out {line_of(e)}")


if __name__ == "__main__":
    main()
