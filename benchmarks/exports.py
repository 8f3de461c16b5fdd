"""Exports judged: does an exported program pass the places that its program passes, wherever the machine stands and its zeros are?

    python -m benchmarks.exports [--jobs N] [--first SEED] [--programs FOLDER] [--largest BYTES] [--processes N] [--name RESULT]

Random programs (export_programs.py) are planned with `kinematic` and exported to the four controls, as each candidate that the exporter
has: the program as it is, its own path in the control's words, the planned path as chords. Each is read back from three starts and with
two sets of work offsets, for LinuxCNC also by `rs274` where it is installed (export_judge.py). With `--programs`, the programs of a
folder are exported as they would be, and read back from one start and offset; results/RESULT.md says what became of each.
"""

from __future__ import annotations

import argparse
import shutil
import signal
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import planner
from benchmarks.export_judge import OFFSETS, STARTS, alike, interpreted, path, readable, stands, unknown_words
from benchmarks.export_programs import TOLERANCE, random_program
from benchmarks.record import markdown, write_results
from planner.base.errors import InputError
from planner.control_files.candidates import AS_IT_IS, Candidate, Candidates
from planner.control_files.controls import CONTROLS
from planner.control_files.program import write_program
from planner.job.plan import Plan
from planner.machine import Machine, load_machine
from planner.nc.reading import AS_USUAL, Reading

SHARE = 0.25  # of the room, for the chords of the random programs
ROUNDING = 0.01  # that rs274 prints lengths with, in inches at worst [mm]
KEEP_OUT = (".csv", ".md", ".txt")


@dataclass(frozen=True)
class Row:
    """What became of a program for a control: `outcome` is "as it is", "own path", "chords" or "refused"; `broken` says how the law is
    broken, "" where it holds."""

    program: str
    control: str
    outcome: str
    why: str = ""
    broken: str = ""


def judged(seed: int, *, starts: int = len(STARTS)) -> list[Row]:
    """The exports of a random program; none where the reader refuses it."""
    text, machine = random_program(seed)
    try:
        plan = planner.plan(planner.read_program(text=text, machine=machine), machine, method="kinematic")
    except InputError:
        return []
    if plan.trajectory is None or plan.verdict is None or plan.verdict.contour_error_mm is None:
        return []
    places = list(product(STARTS[:starts], OFFSETS))
    return [
        row for control in CONTROLS for row in _of_control(f"{seed}", text, plan, machine, control, places)
    ]


def _of_control(name, text, plan, machine, control, places) -> Iterator[Row]:  # type: ignore[no-untyped-def]
    job = Candidates(plan, CONTROLS[control], TOLERANCE)
    try:
        found = job.own(SHARE * TOLERANCE)
        found += job.chords(SHARE * job.room, "chords") if job.room else []
    except InputError as fault:
        yield Row(name, control, "refused", fault.message, "" if fault.line else "without a line")
        return
    for one in found:
        outcome = _outcome(one)
        try:
            data, _ = job.written(one)
        except InputError as fault:
            yield Row(name, control, "refused", fault.message, "" if fault.line else "without a line")
            continue
        yield Row(
            name,
            control,
            outcome,
            job.why_not,
            _broken(text, data.decode(), machine, control, places, AS_USUAL),
        )


def _outcome(one: Candidate) -> str:
    if one.replaced is None:
        return "as it is"
    return "chords" if one.name == "chords" else "own path"


def _broken(text, out, machine, control, places, reading) -> str:  # type: ignore[no-untyped-def]
    """How an export breaks the law; "" where it does not."""
    words = unknown_words(out, control)
    if words:
        return f"words that {control} does not know: {words}"
    if out == text:
        said = interpreted(out, *places[0]) if control == "linuxcnc" and shutil.which("rs274") else ""
        return f"rs274: {said}" if isinstance(said, str) and said else ""
    out = readable(out, control)
    try:
        if stands(text, machine, reading) != stands(out, machine, reading):
            return "other dwells or stops"
        for start, offset in places:
            if not alike(
                path(text, machine, start, offset, reading),
                path(out, machine, start, offset, reading),
                TOLERANCE,
            ):
                return f"other places from {start} with {offset}"
    except InputError as fault:
        return f"does not read back: {fault}"
    return _broken_for_linuxcnc(text, out, places) if control == "linuxcnc" and shutil.which("rs274") else ""


def _broken_for_linuxcnc(text, out, places) -> str:  # type: ignore[no-untyped-def]
    for start, offset in places[1::4]:  # a process each
        found, before = interpreted(out, start, offset), interpreted(text, start, offset)
        if isinstance(found, str):
            return f"rs274: {found}"
        if not isinstance(before, str) and not alike(before, found, TOLERANCE + ROUNDING):
            return f"rs274: other places from {start} with {offset}"
    return ""


def of_file_within(file: Path, machine: Machine, seconds: float) -> list[Row]:
    """`of_file`, given up after so many CPU seconds."""

    def too_long(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return of_file(file, machine)
    except TimeoutError:
        return [
            Row(file.name, control, "not tried", f"takes longer than {seconds:g} CPU s")
            for control in CONTROLS
        ]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def of_file(file: Path, machine: Machine) -> list[Row]:
    """The exports of a program of a folder, by the cheapest method."""
    reading = Reading(extruder="ignore")
    try:
        program = planner.read_program(file, machine, reading)
        plan = planner.plan(program, machine, method="kinematic", tolerance=0.9 * TOLERANCE)
    except InputError as fault:
        return [Row(file.name, control, "not read", str(fault.message)) for control in CONTROLS]
    if plan.trajectory is None or plan.verdict is None or plan.verdict.contour_error_mm is None:
        return [Row(file.name, control, "not planned", plan.sentence) for control in CONTROLS]
    return [_exported(file, plan, machine, control, reading) for control in CONTROLS]


def _exported(file: Path, plan: Plan, machine: Machine, control: str, reading: Reading) -> Row:
    with tempfile.TemporaryDirectory() as folder:
        try:
            made = write_program(Path(folder), plan, control, TOLERANCE)
        except InputError as fault:
            where = f"line {fault.line}: " if fault.line else ""
            return Row(file.name, control, "refused", where + fault.message)
        out = (Path(folder) / made.file).read_bytes()
    text = file.read_bytes()
    outcome = "as it is" if made.sentence.startswith(AS_IT_IS) else "rewritten"
    why = made.sentence
    if out == text or (outcome == "as it is" and out.endswith(text)):
        return Row(file.name, control, outcome, why, "")
    expanded = plan.program.expansion is not None or plan.program.pen
    if expanded:
        return Row(file.name, control, outcome, f"{why}; expanded, compared by its words alone", "")
    broken = _broken(
        text.decode("utf-8", "replace"), out.decode(), machine, control, [(STARTS[1], OFFSETS[1])], reading
    )
    return Row(file.name, control, outcome, why, broken)


def main() -> None:
    """Judge random programs and those of a folder, and write the result."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--programs", type=Path)
    parser.add_argument("--largest", type=int, default=10**9, help="bytes of a program of the folder")
    parser.add_argument("--limit", type=float, default=60.0, help="CPU seconds of a program of the folder")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--name", default="exports")
    options = parser.parse_args()
    rows: list[Row] = []
    seeds = range(options.first, options.first + options.jobs)
    with ProcessPoolExecutor(options.processes) as pool:
        for found in pool.map(judged, seeds, chunksize=8):
            rows += found
            for row in found:
                if row.broken:
                    print(row, flush=True)
    files: list[Row] = []
    if options.programs is not None:
        machine = load_machine("mill")
        for file in sorted(options.programs.iterdir()):
            if file.suffix not in KEEP_OUT and file.stat().st_size <= options.largest:
                files += of_file_within(file, machine, options.limit)
                print(*files[-len(CONTROLS) :], sep="\n", flush=True)
    data = {
        "jobs": options.jobs,
        "random": [asdict(row) for row in rows if row.broken],
        "programs": [asdict(row) for row in files],
    }
    write_results(options.name, data, _table(rows, files, len({row.program for row in rows})))


def _table(rows: list[Row], files: list[Row], programs: int) -> str:
    count = Counter((row.control, row.outcome) for row in rows)
    broken = Counter(row.control for row in rows if row.broken)
    outcomes = ("as it is", "own path", "chords", "refused")
    table = markdown(
        ["control", *outcomes, "law broken"],
        [
            [control, *(f"{count[control, outcome]:,}" for outcome in outcomes), f"{broken[control]:,}"]
            for control in CONTROLS
        ],
    )
    said = [
        f"Exports of {programs:,} random programs, each as every candidate that the exporter has for it, read back from "
        f"{len(STARTS)} starts with {len(OFFSETS)} sets of work offsets:\n",
        table,
    ]
    if files:
        names = sorted({row.program for row in files})
        of = {(row.program, row.control): row for row in files}
        said += [
            "\nPrograms of a folder:\n",
            markdown(
                ["program", *CONTROLS],
                [[name, *(_cell(of[name, control]) for control in CONTROLS)] for name in names],
            ),
        ]
    return "\n".join(said)


def _cell(row: Row) -> str:
    why = row.why.split(";")[0] if row.outcome in ("refused", "not read", "not tried", "not planned") else ""
    text = f"{row.outcome}: {why}" if why else row.outcome
    return (f"**broken: {row.broken}** {text}" if row.broken else text).replace("|", "/")


if __name__ == "__main__":
    main()
