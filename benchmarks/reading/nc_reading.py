"""Which programs of a folder are read, and why the others are not: one line for each.

    python -m benchmarks.reading.nc_reading FOLDER [-m MACHINE.toml] [--extruder ignore] [--strict] [--name RESULT] [--before FILE.json]

`--before` is an earlier result, whose outcome is put beside this one's. Reading only; `benchmarks.reading.nc_programs` plans and
verifies.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from benchmarks.record import markdown, write_results

KEEP_OUT = (".csv", ".md", ".txt")
REASON_SHOWN = 160  # characters of a reason in the table


def main() -> None:
    """Read all programs and write results/RESULT.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("-m", "--machine", default="mill")
    parser.add_argument("--extruder", default="refuse", choices=("refuse", "ignore"))
    parser.add_argument("--strict", action="store_true")
    parser.add_argument("--name", default="nc-reading")
    parser.add_argument("--before", type=Path, help="an earlier result to compare with")
    options = parser.parse_args()
    from planner.machine import load_machine
    from planner.nc.reading import Reading

    reading = Reading(strict=options.strict, extruder=options.extruder)
    machine = load_machine(options.machine)
    files = sorted(file for file in options.folder.iterdir() if file.suffix not in KEEP_OUT)
    rows = [read(file, machine, reading) for file in files]
    before: dict[str, Any] = {}
    if options.before:
        saved = json.loads(options.before.read_text(encoding="utf-8"))["programs"]
        before = {row["program"]: row["outcome"] for row in saved}
    for row in rows:
        row["before"] = before.get(row["program"], "")
    write_results(options.name, {"reading": repr(reading), "programs": rows}, table(rows))
    print(table(rows))


def read(file: Path, machine: Any, reading: Any) -> dict[str, Any]:
    """What comes of a program: read, or refused with the first reason."""
    from planner.base.errors import InputError
    from planner.nc.reader import interpret, load

    try:
        program, faults = interpret(load(file), machine, reading, source=file.name)
    except InputError as fault:
        return {
            "program": file.name,
            "outcome": "refused",
            "blocks": 0,
            "places": 1,
            "reason": fault.message,
            "notes": [],
        }
    first = f"line {faults[0].line}: {faults[0]}" if faults else ""
    return {
        "program": file.name,
        "outcome": "refused" if faults else "read",
        "blocks": len(program),
        "places": len(faults),
        "reason": first,
        "notes": list(program.notes),
    }


def table(rows: list[dict[str, Any]]) -> str:
    """One line for each program, and how many are read."""
    lines = [
        [
            row["program"],
            row["before"],
            row["outcome"],
            f"{row['blocks']:,}" if row["outcome"] == "read" else "",
            (row["reason"] or "; ".join(row["notes"]))[:REASON_SHOWN],
        ]
        for row in rows
    ]
    good = sum(row["outcome"] == "read" for row in rows)
    head = ["program", "before", "now", "blocks", "first reason, or what was assumed"]
    return markdown(head, lines) + f"\n{good} of {len(rows)} programs are read.\n"


if __name__ == "__main__":
    main()
