"""Exports judged: does an exported program pass the places that its program passes, wherever the machine stands and its zeros are?

    python -m benchmarks.controls.exports [--jobs N] [--first SEED] [--programs FOLDER] [--limit SECONDS] [--rows FILE [--kept]]
    [--name RESULT]

Random programs (export_programs.py) are planned, a tenth of them with the default method, and exported to the four controls as each
candidate that the exporter has: the program as it is, its own path in the control's words, the planned path as chords. Each is read
back from three starts, in turn with two sets of work offsets, for LinuxCNC also by `rs274` where it is installed (export_judge.py).
With `--programs`, the programs of a folder are exported as they would be; large ones are planned with less work and read back from one
start (export_rows.py), as results/RESULT.md says of each. `--rows` keeps the rows of every job in a file, so that a run that is cut off
goes on where it ended; rows of another state of the planner are made anew. `--kept` writes the result of those rows alone.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from benchmarks.controls.export_judge import OFFSETS, STARTS
from benchmarks.controls.export_rows import HAS_RS274, Row, judged, of_file_within, unmade
from benchmarks.record import markdown, planner_state, write_results
from planner.controls.export.controls import CONTROLS
from planner.machine import load_machine

KEEP_OUT = (".csv", ".md", ".txt")
OUTCOMES = ("as it is", "own path", "chords", "refused")
REASONS = 12  # of refusals that the table names


class Kept:
    """Rows by job, in a file of which each line is one job; without a file they are only remembered."""

    def __init__(self, file: Path | None, *, all_states: bool):
        self.file, self.state, self.rows = file, planner_state(), {}  # type: Path | None, str, dict[str, list[Row]]
        self.seconds, self.states = 0.0, Counter[str]()
        if file is not None and file.is_file():
            for line in file.read_text(encoding="utf-8").splitlines():
                job = json.loads(line)
                if all_states or job["planner"] == self.state:
                    self._keep(job)

    def _keep(self, job: dict) -> None:  # type: ignore[type-arg]
        self.rows[job["job"]] = [Row(**row) for row in job["rows"]]
        self.seconds += job["cpu"]
        self.states[job["planner"]] += 1

    def made(self, name: str, make: Callable[[], list[Row]]) -> list[Row]:
        """The rows of a job, as they were kept or are made now."""
        if name not in self.rows:
            began = time.process_time()
            rows = [asdict(row) for row in make()]
            job = {
                "job": name,
                "planner": self.state,
                "cpu": round(time.process_time() - began, 3),
                "rows": rows,
            }
            self._keep(job)
            if self.file is not None:
                with self.file.open("a", encoding="utf-8") as out:
                    out.write(json.dumps(job) + "\n")
            for row in self.rows[name]:
                if row.broken:
                    print(row, flush=True)
        return self.rows[name]


def main() -> None:
    """Judge random programs and those of a folder, and write the result."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--programs", type=Path)
    parser.add_argument("--limit", type=float, default=600.0, help="CPU seconds of a program of the folder")
    parser.add_argument("--rows", type=Path, help="file in which the rows of the jobs are kept")
    parser.add_argument("--kept", action="store_true", help="the rows that are kept there alone; make none")
    parser.add_argument("--name", default="exports")
    options = parser.parse_args()
    kept = Kept(options.rows, all_states=options.kept)
    random: list[Row] = []
    seeds = range(options.first, options.first + options.jobs)
    for seed in sorted(int(name) for name in kept.rows if name.isdigit()) if options.kept else seeds:
        random += kept.made(f"{seed}", lambda seed=seed: judged(seed))  # type: ignore[misc]
    files: list[Row] = []
    if options.programs is not None:
        machine = load_machine("mill")
        given = [file for file in options.programs.iterdir() if file.suffix not in KEEP_OUT]
        for file in sorted(given, key=lambda file: (file.stat().st_size, file.name)):
            if options.kept and file.name not in kept.rows:
                files += unmade(file, "not tried", "not reached yet")
                continue
            files += kept.made(
                file.name,
                lambda file=file: of_file_within(file, machine, options.limit),  # type: ignore[misc]
            )
            print(
                file.name, *(f"{row.control}: {row.outcome}" for row in files[-len(CONTROLS) :]), flush=True
            )
    data = {
        "jobs": len({row.program for row in random}),
        "cpu": round(kept.seconds, 1),
        "random": [asdict(row) for row in random if row.broken],
        "programs": [asdict(row) for row in files],
    }
    said = [*(_of_random(random) if random else []), *(_of_files(files) if files else [])]
    write_results(
        options.name,
        data,
        "\n".join([*said, f"\n{kept.seconds:,.0f} CPU s in all; {_made_at(kept.states)}.\n"]),
    )


def _of_random(rows: list[Row]) -> list[str]:
    by_method = {row.program: row.method for row in rows}
    methods = Counter(by_method.values())
    planned = ", ".join(f"{count:,} planned with `{name}`" for name, count in methods.most_common())
    return [
        f"Exports of {len(by_method):,} random programs ({planned}), each as every candidate that the exporter has for it, read "
        f"back from {len(STARTS)} starts, in turn with {len(OFFSETS)} sets of work offsets{_by_rs274()}:\n",
        _counts(rows),
        "Refused, by the first reason:\n",
        _reasons(rows),
    ]


def _made_at(states: Counter[str]) -> str:
    return ", ".join(f"{count:,} programs at planner {state}" for state, count in states.most_common())


def _by_rs274() -> str:
    return ", for LinuxCNC also by its interpreter `rs274`" if HAS_RS274 else ""


def _counts(rows: list[Row]) -> str:
    count = Counter((row.control, row.outcome) for row in rows)
    broken = Counter(row.control for row in rows if row.broken)
    others = [name for name in dict.fromkeys(row.outcome for row in rows) if name not in OUTCOMES]
    return markdown(
        ["control", *OUTCOMES, *others, "law broken"],
        [
            [control, *(f"{count[control, name]:,}" for name in (*OUTCOMES, *others)), f"{broken[control]:,}"]
            for control in CONTROLS
        ],
    )


def _reasons(rows: list[Row]) -> str:
    """The commonest reasons of refusals, by control; a program that is refused twice is counted once."""
    refused = {(row.program, row.control): row.why.split(":")[0] for row in rows if row.outcome == "refused"}
    count = Counter((control, why) for (_, control), why in refused.items())
    named = count.most_common(REASONS)
    return markdown(
        ["control", "programs", "word or reason"],
        [[control, f"{number:,}", _clean(why)] for (control, why), number in named],
    )


def _of_files(files: list[Row]) -> list[str]:
    names = list(dict.fromkeys(row.program for row in files))
    of = {(row.program, row.control): row for row in files}
    table = []
    for name in names:
        rows = [of[name, control] for control in CONTROLS]
        one = next((row for row in rows if row.places), rows[0])
        table.append([name, one.method or rows[0].method, f"{one.places}", *map(_cell, rows)])
    return [
        f"{len(names)} programs of a folder, planned for `mill` and exported to four controls, read back{_by_rs274()}:\n",
        _counts(files),
        "Each program, the smallest first; places: starts and offsets from which it was read back. `rs274` has a tool table "
        "of tools without length and radius.\n",
        markdown(["program", "method", "places", *CONTROLS], table),
    ]


def _cell(row: Row) -> str:
    why = row.why.split(";")[0] if row.outcome not in OUTCOMES[:3] else ""
    text = f"{row.outcome}: {why}" if why else row.outcome
    return _clean(f"**broken: {row.broken}** {text}" if row.broken else text)


def _clean(text: str) -> str:
    return " ".join(text.replace("|", "/").split())


if __name__ == "__main__":
    main()
