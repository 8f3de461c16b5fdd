"""How true the time left is that the progress bar shows: plans of jobs of several kinds, and at 200 moments of each what was said and
what was so.

    python -m benchmarks.progress [--name FILE]

Each plan is made in a process of its own, on one thread, by the clock of its processor, so that other work on the machine does not
count; kernels are loaded before. "Within two" is the share of the moments from 20 % of the plan on at which what was said is at most
twice, and at least half, of what was left, or within a second of it; "worst" is the largest factor among those more than a second off.
The constants of the estimator were read off the first group of jobs, those of searches (commands/search_left.py) off both groups.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks import record

ROOT = Path(__file__).resolve().parents[1]
NC = ROOT.parent / "shared" / "nc"
BOARD = NC / "pcb2gcode__pcb2gcode__multivibrator-extra-passes-two-isolators-tiles-milldrill.ngc"
TURTLE = NC / "winder__Universal-G-Code-Sender__electric_turtle.nc"
SHAPEOKO = NC / "winder__Universal-G-Code-Sender__ShapeOko_Calibration_Pattern_01b.ngc"
SPIRAL = NC / "vilemduha__blendercam__Spiral.gcode"
MOMENTS, FROM, CLOSE = (
    200,
    0.2,
    1.0,
)  # moments; share of the plan from which on they count; [s] that nobody minds
# Name, file, machine, effort, method, lines of the file.
Job = tuple[str, Path, str, str, str, int | None]
FITTED: list[Job] = [
    ("bracket", ROOT / "planner" / "examples" / "bracket.ngc", "mill", "normal", "optimal", None),
    ("Spiral, 30,000 lines", SPIRAL, "mill", "normal", "optimal", 30_000),
    ("Spiral, 8,000 lines", SPIRAL, "router", "normal", "optimal", 8_000),
    ("ShapeOko pattern", SHAPEOKO, "router", "normal", "optimal", None),
    (
        "tight corners",
        NC / "LinuxCNC__linuxcnc__tight-corner-tolerance.ngc",
        "mill",
        "normal",
        "optimal",
        None,
    ),
]
NEW: list[Job] = [
    ("circuit board, milling", BOARD, "router", "normal", "optimal", None),
    ("electric turtle, kinematic", TURTLE, "mill", "normal", "kinematic", None),
    (
        "circuit board",
        NC / "pcb2gcode__pcb2gcode__KNoT-Gateway_Mini_Starter_Board-back.ngc",
        "router",
        "quick",
        "optimal",
        None,
    ),
    (
        "mold, 4,000 lines",
        NC / "CauldronDevelopmentLLC__CAMotics__flower_mold.nc",
        "mill",
        "normal",
        "optimal",
        4_000,
    ),
    ("electric turtle", TURTLE, "router", "normal", "optimal", None),
]

CHILD = """
import json, sys, time
from planner.base.threads import use_threads
from planner.commands.time_left import TimeLeft
from planner.base.names import METHODS
from planner.nc.reader import parse_program
from planner.machine import load_machine
import planner
path, machine, effort, method, lines, moments = sys.argv[1:]
use_threads(1)
text = open(path, encoding="utf-8", errors="replace").readlines()
text = "".join(text if lines == "all" else [*text[: int(lines)], "M2\\n"])
shapes = METHODS[method].shapes
began = time.process_time()
told = []
def clock(): return time.process_time() - began
program = parse_program(text, load_machine(machine), source=path)
planner.plan(program, machine, method=method, **({"effort": effort} if shapes else {}),
    progress=lambda stage, fraction: told.append((clock(), stage, fraction)),
    log=lambda step: told.append((clock(), step)))
end = clock()
left, seen, found = TimeLeft(solves=shapes, effort=effort, searched=method == "optimal"), 0, []
for k in range(int(moments)):
    now = end * k / int(moments)
    while seen < len(told) and told[seen][0] <= now:
        left.stage(*told[seen]) if len(told[seen]) == 3 else left.step(*told[seen])
        seen += 1
    found.append((now, end - now, left.left(now)))
print(json.dumps({"seconds": end, "blocks": len(program), "moments": found}))
"""


def measured(job: Job) -> dict[str, Any]:
    """What was said while a job was planned, and how true it was."""
    name, path, machine, effort, method, lines = job
    arguments = [str(path), machine, effort, method, str(lines or "all"), str(MOMENTS)]
    done = subprocess.run(
        [sys.executable, "-c", CHILD, *arguments],
        cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    said = json.loads(done.stdout.splitlines()[-1])
    counted = [(left, told) for now, left, told in said["moments"] if now >= FROM * said["seconds"]]
    off = [
        float("inf") if told is None else max(told / left, left / max(told, 1e-9))
        for left, told in counted
        if told is None or abs(told - left) > CLOSE
    ]
    return {
        "job": name,
        "machine": machine,
        "method": method,
        "effort": effort,
        "blocks": said["blocks"],
        "planning_cpu_s": said["seconds"],
        "said_nothing": sum(told is None for _, told in counted) / len(counted),
        "within_two": 1.0 - sum(factor > 2.0 for factor in off) / len(counted),
        "worst": max([factor for factor in off if factor < float("inf")], default=1.0),
        "moments": said["moments"][::10],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--name", default="progress")
    given = parser.parse_args()
    rows = []
    for group, jobs in (("fitted", FITTED), ("new", NEW)):
        for job in jobs:
            if not job[1].exists():
                print(f"{job[0]}: {job[1]} is not there", file=sys.stderr)
                continue
            rows.append({"group": group, **measured(job)})
            print(
                json.dumps({k: v for k, v in rows[-1].items() if k != "moments"}), file=sys.stderr, flush=True
            )
    columns = [
        "group",
        "job",
        "machine, method, effort",
        "blocks",
        "planning, CPU s",
        "within two",
        "worst factor",
    ]
    table = record.markdown(
        columns,
        [
            [
                row["group"],
                row["job"],
                f"{row['machine']}, {row['method']}, {row['effort']}",
                f"{row['blocks']:,}",
                f"{row['planning_cpu_s']:.1f}",
                f"{row['within_two']:.0%}",
                f"{row['worst']:.1f}",
            ]
            for row in rows
        ],
    )
    record.write_results(given.name, {"rows": rows}, table)


if __name__ == "__main__":
    main()
