"""`planner smooth` on the real programs: lines that go, the distance as certified, and what controls make of it.

    python -m benchmarks.controls.fewer [--only PART_OF_NAME ...]

Programs are those of ../shared/nc that the machine peers.toml (100 mm/s and 2000 mm/s2 per axis) can run and that have at
least 500 straight moves at a feed; those that compute are written out first. Each is written with fewer lines within half of
20 um, half of 50 um and all of 50 um, read back and compared. Times are those of `planner time` for grbl and LinuxCNC, of the
program within half the tolerance and of the written one within the same: predictions, 2.6 ms a line at grbl's serial port
included. Where all of the tolerance is used none is left for the control, and no time is told.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.record import ROOT, markdown, write_results
from planner.base.errors import InputError
from planner.commands.smooth import ROOM, SHARE, compared
from planner.controls.export.fewer import fewer_lines
from planner.controls.timing.times import control_times
from planner.machine import Machine, load_machine
from planner.nc.program import Kind
from planner.nc.reader import parse_program
from planner.nc.reading import AS_USUAL
from planner.nc.writer import flat_program

SHARED = Path(os.environ.get("PLANNER_SHARED", ROOT.parent / "shared"))
ROOMS = (
    (0.02, SHARE),
    (0.05, SHARE),
    (0.05, 1.0),
)  # tolerances [mm], and the shares of them that are used [-]
MOVES_MIN = 500
TIMED = ("grbl", "linuxcnc")


def rows_of(file: Path, machine: Machine) -> list[dict[str, Any]]:
    """The rows of a program, one for each of `ROOMS`. Raises InputError for one that cannot be read or written anew."""
    data = file.read_bytes()
    expanded = flat_program(data, machine, AS_USUAL, source=file.name)
    if expanded is not None:
        data = expanded[0].encode()
    program = parse_program(data, machine, source=file.name)
    if np.count_nonzero(program.kind == Kind.LINE) < MOVES_MIN:
        return []
    rows = []
    for tolerance, share in ROOMS:
        allowed = share * tolerance
        row: dict[str, Any] = {
            "program": file.name.split("__")[-1],
            "tolerance_mm": tolerance,
            "share": share,
        }
        try:
            begin = time.process_time()
            made = fewer_lines(data, program, machine, ROOM * allowed)
            row["fit_s"] = time.process_time() - begin
            again = parse_program(made.text, machine, source=file.name)
            begin = time.process_time()
            found = compared(program, again, machine, allowed)
        except InputError as fault:
            row["refused"] = fault.message
            rows.append(row)
            continue
        row |= {"compare_s": time.process_time() - begin, "within_mm": found.within, "fault": found.fault}
        row |= {"before": made.before, "after": made.after, "arcs": made.arcs}
        for name in TIMED if share < 1.0 else ():
            for each, key in ((program, "before"), (again, "after")):
                row[f"{name}_{key}_s"] = control_times(each, machine, name, allowed).seconds
        rows.append(row)
    return rows


def main() -> None:
    """Measure, and write results/fewer-lines."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", default=[])
    options = parser.parse_args()
    machine = load_machine(SHARED / "machines" / "peers.toml")
    rows = []
    for file in sorted((SHARED / "nc").iterdir()):
        if file.suffix in (".csv", ".plt", ".hpgl") or not all(part in file.name for part in options.only):
            continue
        try:
            rows += rows_of(file, machine)
        except InputError as fault:
            print(f"{file.name}: {fault.message}", flush=True)
    columns = [
        "program",
        "tolerance [um]",
        "share",
        "moves",
        "fewer",
        "change",
        "arcs",
        "certified within [um]",
    ]
    columns += ["grbl [s]", "change", "LinuxCNC [s]", "change", "CPU [s]"]
    table = []
    for row in rows:
        head = [row["program"], f"{1e3 * row['tolerance_mm']:.0f}", f"{row['share']:g}"]
        if "refused" in row:
            table.append([*head, row["refused"], *[""] * (len(columns) - 4)])
            continue
        cells = [
            f"{row['before']:,}",
            f"{row['after']:,}",
            f"{100 * (row['after'] / row['before'] - 1):+.0f} %",
        ]
        cells += [f"{row['arcs']:,}", row["fault"] or f"{1e3 * row['within_mm']:.2f}"]
        for name in TIMED:
            before, after = row.get(f"{name}_before_s"), row.get(f"{name}_after_s")
            cells += [f"{before:.1f}", f"{100 * (after / before - 1):+.1f} %"] if before else ["", ""]
        table.append([*head, *cells, f"{row['fit_s'] + row['compare_s']:.1f}"])
    write_results("fewer-lines", {"rows": rows}, markdown(columns, table))


if __name__ == "__main__":
    main()
