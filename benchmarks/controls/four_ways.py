"""One job on LinuxCNC four ways, same limits: the program, `planned.ngc`, the exported program, and the plan's setpoints played.

    python -m benchmarks.controls.four_ways --peers FOLDER [--real] [--only PART_OF_NAME ...]

Needs LinuxCNC (Debian's package linuxcnc-uspace) and FOLDER, a copy of ../shared/peers with the compiled `tp_harness` that an ordinary
user may read. Programs run through LinuxCNC's own interpreter and its own planner (tpmod.so), which `lcnc_fast.py` there steps one
servo period at a time, whatever else the computer does; with --real they run in LinuxCNC itself, in real time, which on a busy computer
starves its queue. Setpoints always run in real time, on HAL, as the user `lcnc`: LinuxCNC refuses root.

The machine is peers.toml: 100 mm/s and 2000 mm/s2 per axis, tolerance 0.05 mm; the plan keeps a jerk of 2e5 mm/s3 besides, which
LinuxCNC 2.9 does not know. Programs get G64 P0.05 Q0; the exported one has a G64 of its own, and is made of a plan with nine tenths of
the tolerance where that is predicted to be the faster one. Times are counted in servo periods of the motion, from the first to the
last that moves; the errors are what the verifier finds of it.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import planner
from benchmarks.record import markdown, write_results
from planner.controls.export.program import write_program
from planner.controls.export.tables import write_stream
from planner.machine import Machine, load_machine
from planner.nc.program import Program

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("PLANNER_SHARED", ROOT.parent / "shared"))
JOBS = ("a_pentagon", "b_zigzag", "c_circle", "d_starspiral", "e_chips")
WAYS = ("program", "planned.ngc", "exported", "streamed")
USER = "lcnc"


def on_linuxcnc(peers: Path, file: Path, work: Path, real: bool) -> tuple[np.ndarray, np.ndarray]:
    """Times and positions of a program on LinuxCNC; a program with a G64 of its own keeps it."""
    own = re.search(r"G64 P([\d.]+) Q([\d.]+)", file.read_text())
    tolerance, joined = own.groups() if own else ("0.05", "0")
    out = work / f"{file.stem}.npz"
    script = "linuxcnc_run.py" if real else "lcnc_fast.py"
    command = [
        "/usr/bin/python3",
        str(peers / script),
        str(file),
        "--tol",
        tolerance,
        "--q",
        joined,
        "--out",
        str(out),
    ]
    command += ["--vmax", "100", "--amax", "2000"] + ([] if real else ["--joint"])
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr[-500:])
    recorded = np.load(out)
    return recorded["t"], recorded["xyz"]


def streamed(plan: planner.Plan, work: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times and positions of a plan's setpoints as LinuxCNC's HAL put them out."""
    folder = work / "stream"
    folder.mkdir()
    assert plan.trajectory is not None
    write_stream(folder, plan.trajectory)
    subprocess.run(["chown", "-R", USER, str(folder)], check=True)
    command = ["runuser", "-u", USER, "--", "env", f"HOME={folder}", "halrun", "-f", "try.hal"]
    for again in (True, True, False):  # HAL is one for the whole computer: another session may be ending
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
        if done.returncode == 0:
            break
        if not again:
            raise RuntimeError(done.stderr[-500:])
        time.sleep(5.0)
    played = np.loadtxt(folder / "played.txt")
    rows = played[played[:, -1] == 0, :3]
    return np.arange(len(rows)) * plan.machine.dt, rows


def row_of(
    name: str, t: np.ndarray, position: np.ndarray, program: Program, machine: Machine
) -> dict[str, Any]:
    """Cycle time, error and largest share of a limit of a recorded motion."""
    moving = np.flatnonzero((np.abs(np.diff(position, axis=0)) > 1e-9).any(axis=1))
    first, last = int(moving[0]), int(moving[-1]) + 1
    keep = slice(max(first - 3, 0), min(last + 4, len(t)))
    free = ("velocity", "acceleration", "jerk", "feed")
    verdict = planner.verify(t[keep], position[keep], program, machine, not_limited=free)
    ratios = {limit: float(check.ratio) for limit, check in verdict.limits.items()}
    return {
        "way": name,
        "cycle_time": (last - first) * machine.dt,
        "contour_error_um": None if verdict.contour_error_mm is None else 1e3 * verdict.contour_error_mm,
        "vertex_error_um": None if verdict.vertex_error_mm is None else 1e3 * verdict.vertex_error_mm,
        "acceleration": max(r for limit, r in ratios.items() if limit.startswith("acceleration")),
        "jerk": max(r for limit, r in ratios.items() if limit.startswith("jerk")),
    }


def measure(job: str, machine: Machine, peers: Path, real: bool) -> list[dict[str, Any]]:
    """The four rows of a job; that of the exported program says what was exported and what the model predicted."""
    source = SHARED / "peers" / "programs" / f"{job}.ngc"
    program = planner.read_program(source, machine)
    plan = planner.plan(program, machine)
    narrower = planner.plan(program, machine, tolerance=0.9 * machine.tolerance)
    with tempfile.TemporaryDirectory() as place:
        work = Path(place)
        work.chmod(0o755)
        plan.save(work / "plan")
        made = write_program(work, narrower, "linuxcnc", machine.tolerance)
        files = {
            "program": source,
            "planned.ngc": work / "plan" / "planned.ngc",
            "exported": work / made.file,
        }
        rows = [
            row_of(way, *on_linuxcnc(peers, file, work, real), program, machine)
            for way, file in files.items()
        ]
        rows[2] |= {"exported": made.sentence, "predicted": made.predicted}
        rows.append(row_of("streamed", *streamed(plan, work), program, machine))
    return [{"job": job, "planned_time": plan.cycle_time, **row} for row in rows]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", type=Path, required=True)
    parser.add_argument("--real", action="store_true")
    parser.add_argument("--only", nargs="*", default=[""])
    asked = parser.parse_args()
    machine = load_machine(SHARED / "machines" / "peers.toml")
    rows: list[dict[str, Any]] = []
    for job in JOBS:
        if any(part in job for part in asked.only):
            rows += measure(job, machine, asked.peers, asked.real)
            print(*rows[-4:], sep="\n", flush=True)
    shown = [
        [
            row["job"],
            row["way"] + (f": {row['exported']}" if "exported" in row else ""),
            f"{row['cycle_time']:.3f}",
            "-" if row["contour_error_um"] is None else f"{row['contour_error_um']:.1f}",
            "-" if row["vertex_error_um"] is None else f"{row['vertex_error_um']:.1f}",
            f"{row['acceleration']:.2f}",
            f"{row['jerk']:.2f}",
        ]
        for row in rows
    ]
    columns = [
        "job",
        "on LinuxCNC 2.9",
        "time [s]",
        "contour error [um]",
        "vertices missed by [um]",
        "acceleration / limit",
        "jerk / 2e5 mm/s3",
    ]
    write_results("controls", {"rows": rows}, markdown(columns, shown))


if __name__ == "__main__":
    main()
