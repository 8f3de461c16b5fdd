"""What became of a program for each control: planned, exported, read back, as rows.

Random programs are exported as each candidate that the exporter has; programs of a folder as they would be. What the program itself
passes from a start with offsets is found once, and held against all of its exports.
"""

from __future__ import annotations

import shutil
import signal
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import planner
from benchmarks.controls.export_judge import (
    OFFSETS,
    STARTS,
    Passed,
    alike,
    interpreted,
    passed,
    passed_by,
    readable,
    unknown_words,
)
from benchmarks.controls.export_programs import TOLERANCE, random_program
from planner.base.arrays import FloatArray
from planner.base.errors import InputError
from planner.controls.export.controls import CONTROLS
from planner.controls.export.program import AS_IT_IS, OWN_PATH, Candidate, Candidates, write_program
from planner.machine import Axis, Machine
from planner.nc.program import Program
from planner.nc.reading import AS_USUAL, Reading
from planner.planning.job.plan import Plan

SHARE = 0.25  # of the room, for the chords of the random programs
DEFAULT_EVERY = (
    10  # of the random programs is planned with the default method; the others by one of closed form
)
CLOSED_FORM = "kinematic"
ROUNDING = 0.01  # that rs274 prints lengths with, in inches at worst [mm]
HAS_RS274 = shutil.which("rs274") is not None
# Sizes of a folder's programs [bytes], above which less work and a coarser period of the setpoints [s] make them cheap enough.
CLOSED_ABOVE = 5_000
COARSE_ABOVE, COARSE_DT = 250_000, 0.004
ONE_PLACE_ABOVE = 250_000  # bytes; smaller ones are read back from all starts
TURN = Axis(
    velocity=360.0, acceleration=3600.0, jerk=72000.0
)  # for programs that turn a rotary axis [deg/s ...]
Place = tuple[tuple[float, ...], tuple[float, ...]]
# From each start, in turn with one and the other of the offsets.
ALL_PLACES: tuple[Place, ...] = tuple((start, OFFSETS[k % len(OFFSETS)]) for k, start in enumerate(STARTS))


@dataclass(frozen=True)
class Row:
    """What became of a program for a control.

    outcome : "as it is", "own path", "chords", "refused", "not read", "not planned" or "not tried"
    why     : the reason of a refusal, with its line, or of a program that is not as it is
    broken  : how the law is broken, "" where it holds
    method  : how it was planned
    places  : starts and offsets from which it was read back
    """

    program: str
    control: str
    outcome: str
    why: str = ""
    broken: str = ""
    method: str = ""
    places: int = 0


@dataclass
class Original:
    """A program that exports are held against; what it passes is found once for each place.

    program : as it was planned, where its text is none that lines can be put before: then it is compared from its own start
    """

    text: str
    machine: Machine
    reading: Reading = AS_USUAL
    program: Program | None = None
    _passed: dict[Place, Passed] = field(default_factory=dict)
    _interpreted: dict[Place, FloatArray | str] = field(default_factory=dict)

    def passed(self, place: Place) -> Passed:
        """What it does from a start with offsets."""
        if place not in self._passed:
            self._passed[place] = (
                passed(self.text, self.machine, *place, self.reading)
                if self.program is None
                else passed_by(self.program)
            )
        return self._passed[place]

    def interpreted(self, place: Place) -> FloatArray | str:
        """What LinuxCNC's interpreter makes of it."""
        if place not in self._interpreted:
            self._interpreted[place] = interpreted(self.text, *place)
        return self._interpreted[place]

    def broken(self, out: str, control: str, places: Sequence[Place]) -> str:
        """How an export of it breaks the law; "" where it does not."""
        words = unknown_words(out, control)
        if words:
            return f"words that {control} does not know: {words}"
        linuxcnc = control == "linuxcnc" and HAS_RS274 and self.program is None
        if out == self.text:
            return _refused(self.interpreted(places[0])) if linuxcnc else ""
        out = readable(out, control)
        try:
            for place in places:
                one, other = self.passed(place), passed(out, self.machine, *place, self.reading)
                if one.rests != other.rests:
                    return f"other dwells or stops: {one.rests}, {other.rests}"
                if not alike(one.places, other.places, TOLERANCE):
                    return f"other places from {place[0]} with {place[1]}"
        except InputError as fault:
            return f"does not read back: {fault}"
        return self._broken_for_linuxcnc(out, places) if linuxcnc else ""

    def _broken_for_linuxcnc(self, out: str, places: Sequence[Place]) -> str:
        for place in places[-2:]:  # a process each
            found, before = interpreted(out, *place), self.interpreted(place)
            if isinstance(found, str):
                return _refused(found)
            if not isinstance(before, str) and not alike(before, found, TOLERANCE + ROUNDING):
                return f"rs274: other places from {place[0]} with {place[1]}"
        return ""


def _refused(said: FloatArray | str) -> str:
    """What rs274 refuses."""
    return f"rs274: {said}" if isinstance(said, str) else ""


def judged(seed: int, *, starts: int = len(STARTS)) -> list[Row]:
    """The exports of a random program; none where the reader refuses it."""
    text, machine = random_program(seed)
    method = "optimal" if seed % DEFAULT_EVERY == 0 else CLOSED_FORM
    try:
        plan = planner.plan(planner.read_program(text=text, machine=machine), machine, method=method)
    except InputError:
        return []
    if _is_unplanned(plan):
        return []
    places = ALL_PLACES[:starts]
    original = Original(text, machine)
    return [row for control in CONTROLS for row in _of_control(seed, original, plan, control, places, method)]


def _is_unplanned(plan: Plan) -> bool:
    return plan.trajectory is None or plan.verdict is None or plan.verdict.contour_error_mm is None


def _of_control(
    seed: int, original: Original, plan: Plan, control: str, places: Sequence[Place], method: str
) -> list[Row]:
    job = Candidates(plan, CONTROLS[control], TOLERANCE)
    rows: list[Row] = []

    def refused(fault: InputError) -> Row:
        broken = "" if fault.line else "without a line"
        return Row(str(seed), control, "refused", fault.message, broken, method)

    try:
        found = job.own(SHARE * TOLERANCE)
        found += job.chords(SHARE * job.room) if job.room else []
    except InputError as fault:
        return [refused(fault)]
    for one in found:
        try:
            data, _ = job.written(one)
        except InputError as fault:
            rows.append(refused(fault))
            continue
        broken = original.broken(data.decode(), control, places)
        rows.append(Row(str(seed), control, _outcome(one), job.why_not, broken, method, len(places)))
    return rows


def _outcome(one: Candidate) -> str:
    if one.replaced is None:
        return "as it is"
    return "own path" if one.name == OWN_PATH else "chords"


def of_file_within(file: Path, machine: Machine, seconds: float) -> list[Row]:
    """`of_file`, given up after so many CPU seconds."""

    def too_long(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return of_file(file, machine)
    except TimeoutError:
        return unmade(file, "not tried", f"takes longer than {seconds:g} CPU s")
    except MemoryError:
        return unmade(file, "not tried", "takes more memory than there is")
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def unmade(file: Path, outcome: str, why: str) -> list[Row]:
    """The rows of a program without exports."""
    return [Row(file.name, control, outcome, why) for control in CONTROLS]


def of_file(file: Path, machine: Machine) -> list[Row]:
    """The exports of a program of a folder: what each control would be given."""
    reading = Reading(extruder="ignore")
    try:
        program, machine = _read(file, machine, reading)
        settings, said, dt = _work(file.stat().st_size)
        machine = machine.model_copy(update={"dt": max(machine.dt, dt)})
        plan = planner.plan(program, machine, tolerance=0.9 * TOLERANCE, **settings)
    except InputError as fault:
        return unmade(
            file, "not read", f"line {fault.line}: {fault.message}" if fault.line else fault.message
        )
    if _is_unplanned(plan):
        return unmade(file, "not planned", plan.sentence)
    text = file.read_bytes().decode("utf-8", "replace")
    original = Original(text, machine, reading, program if _stands_alone(program) else None)
    return [_exported(file, plan, original, control, said) for control in CONTROLS]


def _read(file: Path, machine: Machine, reading: Reading) -> tuple[Program, Machine]:
    """The program, and the machine: with rotary axes for a program that turns them."""
    try:
        return planner.read_program(file, machine, reading), machine
    except InputError as fault:
        turning = machine.model_copy(update={"axes": machine.axes | dict.fromkeys("abc", TURN)})
        try:
            return planner.read_program(file, turning, reading), turning
        except InputError:
            raise fault from None


def _work(size: int) -> tuple[dict[str, Any], str, float]:
    """Settings of `plan` for a program of so many bytes, what the table says of them, and the least period of the setpoints [s]."""
    if size > COARSE_ABOVE:
        return {"method": CLOSED_FORM}, f"{CLOSED_FORM}, {COARSE_DT * 1e3:g} ms", COARSE_DT
    return ({"method": CLOSED_FORM}, CLOSED_FORM, 0.0) if size > CLOSED_ABOVE else ({}, "optimal", 0.0)


def _stands_alone(program: Program) -> bool:
    """Whether no lines of RS274NGC can be put before a program: plotter files, other languages."""
    return program.pen or (
        program.expansion is not None and program.expansion.dialect in ("heidenhain", "siemens")
    )


def _exported(file: Path, plan: Plan, original: Original, control: str, method: str) -> Row:
    with tempfile.TemporaryDirectory() as folder:
        try:
            made = write_program(Path(folder), plan, control, TOLERANCE)
        except InputError as fault:
            where = f"line {fault.line}: " if fault.line else ""
            return Row(file.name, control, "refused", where + fault.message, "", method)
        out = (Path(folder) / made.file).read_bytes()
    names = {AS_IT_IS: "as it is", OWN_PATH: "own path"}
    outcome = next((said for name, said in names.items() if made.sentence.startswith(name)), "chords")
    if original.program is not None:
        places: tuple[Place, ...] = ((tuple(plan.program.start[:3].tolist()), OFFSETS[0]),)
    else:
        places = ALL_PLACES[1:2] if file.stat().st_size > ONE_PLACE_ABOVE else ALL_PLACES
    broken = original.broken(out.decode("utf-8", "replace"), control, places)
    why = next((note for note in made.notes if "as it is is no" in note), "")
    return Row(file.name, control, outcome, why, broken, method, len(places))
