"""What `planned.ngc` takes where it is run: LinuxCNC's own trajectory planner, off-line, and this planner once more.

    python -m benchmarks.controls.planned_ngc [--peers FOLDER] [--programs FOLDER] [--only PART_OF_NAME ...] [--name RESULT]

FOLDER of --peers holds `lcnc_fast.py`, `lcnc_canon.py` and the compiled `tp_harness` (../shared/peers says how; or the environment
variable PLANNER_PEERS). The machine is peers.toml: 100 mm/s and 2000 mm/s2 per axis, tolerance 0.05 mm, jerk 2e5 mm/s3, which
LinuxCNC does not limit. Its naive CAM detector joins moves within the tolerance. Dwells are left out of all times.

Plans are made on splines: what is looked at are the F words. A program without M2 gets one.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import planner
from benchmarks.record import markdown, write_results
from planner.machine import Machine, load_machine
from planner.report.planned import planned_program

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("PLANNER_SHARED", ROOT.parent / "shared"))
PROGRAMS = (
    "LinuxCNC__linuxcnc__tight-corner-tolerance.ngc",
    "LinuxCNC__linuxcnc__zigzag_0.002_0.0005.ngc",
    "LinuxCNC__linuxcnc__circle_small_segments_ncd.ngc",
    "winder__Universal-G-Code-Sender__arc_rword_test.gcode",
    "pcb2gcode__pcb2gcode__multivibrator-extra-passes-two-isolators-tiles-milldrill.ngc",
    "LinuxCNC__linuxcnc__lathe_pawn.ngc",
    "winder__Universal-G-Code-Sender__no_spaces.gcode",
    "LinuxCNC__linuxcnc__arcspiral.ngc",
    "LinuxCNC__linuxcnc__cds.ngc",
    "LinuxCNC__linuxcnc__tort.ngc",
)
HEAD = "G21 G90 G17 G94 G64 P0.05\nG1 F6000\n"
TIMEOUT = 600.0  # [s] for one run of the harness


def loops(t: float) -> tuple[float, float]:
    """Loops of 0.3 mm that drift along x."""
    return 0.3 * math.sin(t) + 0.02 * t, 0.3 * math.cos(t)


def wave(t: float) -> tuple[float, float]:
    """A wave of 1 mm to each side, one every 2.1 mm."""
    return t, math.sin(3.0 * t)


def micro_blocks(curve: Callable[[float], tuple[float, float]], step: float, count: int) -> str:
    """A program of `count` blocks of about `step` [mm] along a curve."""
    start = before = curve(0.0)
    lines, t, run = [HEAD], 0.0, 0.0
    while len(lines) <= count:
        t += step / 10.0
        here = curve(t)
        run, before = run + math.dist(here, before), here
        if run >= step:
            run -= step
            lines.append(f"X{here[0] - start[0]:.5f} Y{here[1] - start[1]:.5f}\n")
    return "".join([*lines, "M2\n"])


def main() -> None:
    """Run all programs and write results/RESULT.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers", type=Path, default=Path(os.environ.get("PLANNER_PEERS", SHARED / "peers")))
    parser.add_argument("--programs", type=Path, default=SHARED / "nc")
    parser.add_argument("--only", nargs="*", default=[""])
    parser.add_argument("--name", default="planned-ngc")
    options = parser.parse_args()
    missing = [
        name
        for name in ("lcnc_fast.py", "lcnc_canon.py", "tp_harness")
        if not (options.peers / name).is_file()
    ]
    if missing:
        raise SystemExit(
            f"{options.peers} has no {', '.join(missing)}: give the folder with --peers or PLANNER_PEERS"
        )
    machine = load_machine(SHARED / "machines" / "peers.toml")
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        for file in _jobs(Path(folder), options.programs):
            if any(part in file.name for part in options.only):
                rows.append(_measured(file, machine, options.peers, Path(folder)))
                print(rows[-1], flush=True)
                write_results(options.name, {"programs": rows}, _table(rows))


def _jobs(folder: Path, programs: Path) -> list[Path]:
    made = {
        "4000 blocks of 1 um": micro_blocks(loops, 1e-3, 4_000),
        "12000 blocks of 10 um": micro_blocks(wave, 1e-2, 12_000),
    }
    for name, text in made.items():
        (folder / f"{name}.ngc").write_text(text)
    peers = sorted((SHARED / "peers" / "programs").glob("[a-e]_*.ngc"))
    return [*(folder / f"{name}.ngc" for name in made), *peers, *(programs / name for name in PROGRAMS)]


def _measured(file: Path, machine: Machine, peers: Path, folder: Path) -> dict[str, Any]:
    """Cycle times of one program [s], without dwells."""
    text = file.read_bytes()
    if not re.search(rb"M0?2\b|M30|%\s*$", text):
        text += b"\nM2\n"
    job, again = folder / "job.ngc", folder / "planned.ngc"
    job.write_bytes(text)
    plan = planner.plan(job, machine, geometry="spline").require()
    again.write_bytes(planned_program(plan)[0])
    replanned = planner.plan(again, machine, geometry="spline").require()
    assert plan.trajectory is not None
    assert replanned.trajectory is not None
    dwells = float(plan.toolpath.dwell.sum())
    return {
        "program": file.name,
        "blocks": len(plan.toolpath),
        "f_words": [_f_words(text), _f_words(again.read_bytes())],
        "planned_s": plan.trajectory.cycle_time - dwells,
        "replanned_s": replanned.trajectory.cycle_time - dwells,
        "linuxcnc_original_s": _linuxcnc(job, machine, peers),
        "linuxcnc_planned_s": _linuxcnc(again, machine, peers),
    }


def _f_words(text: bytes) -> int:
    return len(re.findall(rb"[Ff][ \t]*[\d.]", re.sub(rb"\([^)]*\)|;[^\n]*", b"", text)))


def _linuxcnc(program: Path, machine: Machine, peers: Path) -> float:
    """Cycle time of a program on LinuxCNC's planner [s]."""
    axis = machine.axes["x"]
    run = subprocess.run(
        [
            "/usr/bin/python3", str(peers / "lcnc_fast.py"), str(program), "--vmax", str(axis.velocity),
            "--amax", str(axis.acceleration), "--tol", str(machine.tolerance),
        ],
        capture_output=True, text=True, check=False, timeout=TIMEOUT,
    )  # fmt: skip
    if run.returncode:
        raise SystemExit(f"lcnc_fast.py on {program.name}: {run.stderr.strip()[-300:]}")
    return float(json.loads(run.stdout)["cycle_time"])


def _table(rows: list[dict[str, Any]]) -> str:
    columns = [
        "program", "blocks", "F words", "in planned.ngc", "planned [s]", "planned again", "LinuxCNC, original [s]",
        "LinuxCNC, planned.ngc [s]", "against original", "against the plan",
    ]  # fmt: skip
    lines = []
    for row in rows:
        plan, ours, theirs = row["planned_s"], row["linuxcnc_planned_s"], row["linuxcnc_original_s"]
        lines.append(
            [
                row["program"], f"{row['blocks']:,}", *(f"{count:,}" for count in row["f_words"]), f"{plan:.4g}",
                f"{row['replanned_s'] / plan - 1.0:+.2%}", f"{theirs:.4g}", f"{ours:.4g}", f"{ours / theirs - 1.0:+.1%}",
                f"{ours / plan - 1.0:+.1%}",
            ]
        )  # fmt: skip
    return markdown(columns, lines)


if __name__ == "__main__":
    main()
