"""What long jobs cost: real programs and generated ones of 4,000 to 250,000 blocks, each planned in a process of its own.

    python -m benchmarks.cost.long_jobs [JOB ...] [--threads N ...] [--corner NAME] [--nc DIR] [--machines DIR] [--again]

Real programs are those of `--nc`, left out where that is absent. Generated are

    contour   chords of 0.05 to 0.2 mm along a wavy contour
    carving   chords of 1 to 20 um along the strokes of a carved text: arcs with kinks between them, deeper where a stroke is wider
    lettering strokes of 5 to 80 legs of 0.1 to 15 um, a lift between them: short runs, nearly all of them held by the feed
    drawing   strokes of 3 to 30 lines of 0.3 to 3 mm, a lift between them, as a pen plotter has them
    relief    rows of a milled relief (benchmarks/cost/growth.py)

Processor and wall seconds are of planning alone, on compiled kernels; memory is the largest resident set of the process. On several
threads the CPU seconds of a stage stand before those of the thread that plans. A second core makes a job at most
CPU / (alone + (CPU - alone) / 2) times as fast.

A row stays in the results until the same job is run again with as many threads and the same corner. A run that was cut off goes on
where it ended: rows of the same commit (the last one that changed the planner) are not run again, unless `--again` is given.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.cost.growth import Clock, planner_commit, relief
from benchmarks.record import markdown, write_results

RESULTS = Path(__file__).parents[1] / "results" / "long-jobs.json"
WARM_UP = 200  # blocks of a relief that are planned first
CHORD, CHORD_FEED = (0.05, 0.2), 3000  # of the contour: [mm], [mm/min]
WAVES = ((20.0, 0.005), (5.0, 0.05), (0.5, 0.4))  # of the contour: height [mm], 1/mm
STEP, STEP_FEED, STROKE = (0.001, 0.02), 1800, (0.4, 6.0)  # of the carving: [mm], [mm/min], radii [mm]
DEPTH = (0.2, 0.15)  # of the carving, and by how much it changes along a stroke [mm]
# Strokes of the lettering and the drawing: legs of each, their length [mm], feed [mm/min], turn from leg to leg [rad], and how far
# from the end of one the next one begins at most, in x and y [mm].
LETTERING = ((5, 80), (0.0001, 0.015), 1200, 0.35, 0.4)
DRAWING = ((3, 30), (0.3, 3.0), 3000, 0.5, 50.0)


def contour(blocks: int, seed: int = 5) -> str:
    """An NC program of a wavy contour."""
    x = np.cumsum(np.random.default_rng(seed).uniform(*CHORD, blocks))
    y = sum(height * np.sin(rate * x) for height, rate in WAVES)
    z = 0.3 * np.sin(0.02 * x)
    return _program(CHORD_FEED, np.stack([x, np.asarray(y), z], axis=1), 4)


def carving(blocks: int, seed: int = 7) -> str:
    """An NC program of the strokes of a carved text."""
    rng = np.random.default_rng(seed)
    point, heading, points = np.zeros(2), 0.0, []
    count = 0
    while count < blocks:
        radius, turn = rng.uniform(*STROKE), rng.uniform(0.5, np.pi) * rng.choice([-1.0, 1.0])
        length = radius * abs(turn)
        at = np.cumsum(rng.uniform(*STEP, int(length / np.mean(STEP))))
        angle = heading + np.sign(turn) * at / radius
        side = np.array([-np.sin(heading), np.cos(heading)]) * np.sign(turn)
        center = point + radius * side
        xy = center + np.sign(turn) * radius * np.stack([np.sin(angle), -np.cos(angle)], axis=1)
        z = -DEPTH[0] - DEPTH[1] * np.sin(np.pi * at / at[-1])
        points.append(np.column_stack([xy, z]))
        point, heading, count = xy[-1], angle[-1] + rng.uniform(-1.5, 1.5), count + len(xy)
    return _program(STEP_FEED, np.concatenate(points)[:blocks], 5)


def strokes(
    blocks: int,
    kind: tuple[tuple[int, int], tuple[float, float], int, float, float],
    seed: int = 1,
) -> str:
    """An NC program of strokes of one kind, lifted between them."""
    (least, most), length, feed, bend, far = kind
    rng, point, lines = np.random.default_rng(seed), np.zeros(2), list[str]()
    while len(lines) < blocks:
        point = point + rng.uniform(-far, far, 2)
        lines += ["G0 Z0.5", f"G0 X{point[0]:.5f} Y{point[1]:.5f}", "G1 Z-0.05"]
        legs = int(rng.integers(least, most))
        heading = rng.uniform(0.0, 2.0 * np.pi) + np.cumsum(rng.normal(0.0, bend, legs))
        step = rng.uniform(*length, (legs, 1)) * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        along = point + np.cumsum(step, axis=0)
        lines += [f"G1 X{x:.5f} Y{y:.5f}" for x, y in along]
        point = along[-1]
    return "\n".join([f"G21 G90 G17 G94 F{feed}", *lines, "G0 Z0.5", "M2", ""])


def _program(feed: int, points: np.ndarray, digits: int) -> str:
    lines = [f"G1 X{x:.{digits}f} Y{y:.{digits}f} Z{z:.{digits}f}" for x, y, z in points]
    return "\n".join([f"G21 G90 G17 G94 F{feed}", *lines, "M2", ""])


class Job(NamedTuple):
    """A program, made or in a file of the folder `--nc`, and its machine, built in or in the folder `--machines`."""

    program: Callable[[], str] | str
    machine: str


JOBS = {
    "Spiral": Job("vilemduha__blendercam__Spiral.gcode", "peers.toml"),
    "tiger": Job("CauldronDevelopmentLLC__CAMotics__tiger.nc", "peers.toml"),
    "stellabee1": Job("LinuxCNC__linuxcnc__stellabee1.ngc", "peers.toml"),
    "vcarve": Job("CauldronDevelopmentLLC__CAMotics__vcarve.ngc", "peers.toml"),
    "SheepTile": Job("Sienci-Labs__gsender__SheepTile-v2.nc", "mill"),
    "mmount": Job("LinuxCNC__linuxcnc__mmount.ngc", "mill"),
    "contour, 50,000 blocks": Job(lambda: contour(50_000), "mill"),
    "carving, 120,000 blocks": Job(lambda: carving(120_000), "mill"),
    "lettering, 12,400 blocks": Job(lambda: strokes(12_400, LETTERING), "peers.toml"),
    "drawing, 9,600 blocks": Job(lambda: strokes(9_600, DRAWING), "peers.toml"),
    "relief, 50,000 blocks": Job(lambda: relief(50_000), "mill"),
    "relief, 50,000 blocks, peers": Job(lambda: relief(50_000), "peers.toml"),
}


def one(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Plan one job in this process."""
    import planner
    from planner.base.threads import use_threads

    use_threads(options.threads[0])
    job = JOBS[name]
    machine = str(options.machines / job.machine) if job.machine.endswith(".toml") else job.machine
    with tempfile.TemporaryDirectory() as scratch:
        program = Path(scratch) / "job.ngc"
        program.write_text(relief(WARM_UP))
        planner.plan(program, "mill")
        if isinstance(job.program, str):
            program = options.nc / job.program
        else:
            program.write_text(job.program())
        clock, wall, cpu = Clock(), time.perf_counter(), time.process_time()
        plan = planner.plan(program, machine, progress=clock, corner=options.corner)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    found = plan.trajectory
    return {
        "job": name,
        "machine": job.machine.removesuffix(".toml"),
        "corner": options.corner,
        "threads": options.threads[0],
        "blocks": len(plan.program),
        "cycle_s": math.nan if found is None else found.cycle_time,
        "cpu_s": cpu,
        "wall_s": wall,
        "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "points": plan.grid_points,
        "samples": 0 if found is None else len(found),
        "passed": plan.verdict is not None and plan.verdict.passed,
        "stages_s": clock.took,
        "alone_s": clock.alone,
        "load": os.getloadavg()[0],
    }


def main() -> None:
    """Run what is asked for and write the results."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("jobs", nargs="*", default=list(JOBS), metavar="JOB", help=", ".join(JOBS))
    parser.add_argument("--threads", nargs="*", type=int, default=[1, 2])
    parser.add_argument("--corner", default="auto")
    parser.add_argument("--nc", type=Path, default=Path("../shared/nc"))
    parser.add_argument("--machines", type=Path, default=Path("../shared/machines"))
    parser.add_argument("--one", action="store_true", help="print the result of the first as JSON")
    parser.add_argument("--again", action="store_true", help="also what the results hold of this commit")
    options = parser.parse_args()
    unknown = [name for name in options.jobs if name not in JOBS]
    if unknown:
        parser.error(f"no job {unknown[0]!r}; there are {', '.join(JOBS)}")
    if options.one:
        print(json.dumps(one(options.jobs[0], options)))
        return
    commit = planner_commit()
    for name in options.jobs:
        program = JOBS[name].program
        if isinstance(program, str) and not (options.nc / program).exists():
            print(f"{name}: {options.nc / program} is absent", flush=True)
            continue
        for threads in options.threads:
            known = {"job": name, "corner": options.corner, "threads": threads, "commit": commit}
            if not options.again and any(known.items() <= row.items() for row in _before()):
                continue
            command = [
                sys.executable,
                "-m",
                "benchmarks.cost.long_jobs",
                name,
                "--one",
                "--threads",
                str(threads),
            ]
            command += ["--corner", options.corner, "--nc", str(options.nc)]
            command += ["--machines", str(options.machines)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                print(f"{name}: {done.stderr.strip().splitlines()[-1:] or done.returncode}", flush=True)
                continue
            row = {**json.loads(done.stdout.splitlines()[-1]), "commit": commit}
            print(
                {key: value for key, value in row.items() if key not in ("stages_s", "alone_s")}, flush=True
            )
            rows = _with(row)
            write_results("long-jobs", {"rows": rows}, _table(rows))


def _before() -> list[dict[str, Any]]:
    """The rows of the results so far."""
    return list(json.loads(RESULTS.read_text())["rows"]) if RESULTS.exists() else []


def _with(row: dict[str, Any]) -> list[dict[str, Any]]:
    """The rows of the results so far with another one, in the order of the jobs."""

    def key(one: dict[str, Any]) -> tuple[Any, ...]:
        return list(JOBS).index(one["job"]), one["corner"], one["threads"]

    kept = [one for one in _before() if one["job"] in JOBS and key(one) != key(row)]
    return sorted([*kept, row], key=key)


def _stage(row: dict[str, Any], name: str) -> str:
    """CPU seconds of a stage; where more than one thread was allowed, those of the thread that plans behind them."""
    took = f"{row['stages_s'].get(name, 0.0):.3g}"
    return f"{took}, {row['alone_s'].get(name, 0.0):.3g}" if row["threads"] > 1 and "alone_s" in row else took


def _table(rows: list[dict[str, Any]]) -> str:
    stages = list(dict.fromkeys(name for row in rows for name in row["stages_s"]))
    columns = [
        "job",
        "machine",
        "corner",
        "blocks",
        "threads",
        "motion [s]",
        "CPU [s]",
        "wall [s]",
        "blocks/CPU s",
    ]
    columns += [
        "peak [GB]",
        "grid points",
        "samples",
        "passed",
        *(f"{name} [CPU s, of them alone]" for name in stages),
        "load",
        "commit",
    ]
    lines = [
        [
            row["job"],
            row["machine"],
            row["corner"],
            f"{row['blocks']:,}",
            str(row["threads"]),
            f"{row['cycle_s']:.6g}",
            f"{row['cpu_s']:.3g}",
            f"{row['wall_s']:.3g}",
            f"{row['blocks'] / row['cpu_s']:,.0f}",
            f"{row['peak_gb']:.2f}",
            f"{row['points']:,}",
            f"{row['samples']:,}",
            "yes" if row["passed"] else "no",
            *(_stage(row, name) for name in stages),
            f"{row['load']:.1f}",
            row.get("commit", ""),
        ]
        for row in rows
    ]
    return (
        markdown(columns, lines)
        + "\n\nLoad is the number of processes that wanted a processor in the last minute, this one among them.\n"
    )


if __name__ == "__main__":
    main()
