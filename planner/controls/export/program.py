"""A program that a control's own planner runs best: the program as it is, or the planned path as straight moves at
the planned feeds, if that is faster.

The program as it is is the input, byte for byte; where the control cannot read it so (source.py), its lines
are written in the control's words (translate.py). Chords of the planned path replace only lines whose place
the program's own words tell (rows.py).

grbl, Klipper and Marlin stay on the path and slow down at its corners, so a smooth path inside the tolerance
can let them go faster, with F words that keep the axes within their limits in its bends; how far apart its
points should be depends on how they look ahead and on the time of a line. Their times are predicted by short
models (controls/timing), for the program as it is and for the planned path with chords of several widths; the
fastest is written.

LinuxCNC rounds corners itself (benchmarks/results/controls.md says how all did), and is given the program's own
words or the planned path, whichever a model of its planner finds faster: the program as it is, with G64 P of the
whole tolerance, or with half of it for P and half for Q, which joins short moves; and the planned path as chords,
with G64 P for the room that they leave. The model (timing/linuxcnc.py) was off by -2.1 to +0.9 % on programs like
these, so another candidate than the first is taken only where it is predicted to be faster by more than `MARGIN`.
A program that says its path mode keeps it, and its own path.

Plan and chords share the tolerance: what the verdict found of the plan's errors, the chords, and the corners
of LinuxCNC add up to it at most. A plan that uses all of it leaves no room; one with a tenth less does.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError
from planner.base.units import MICROMETRE
from planner.controls.export import chords
from planner.controls.export.chords import Polyline, programmed_polyline
from planner.controls.export.controls import CONTROLS, Control, takes_move
from planner.controls.export.output import FIRST_RUN, assumptions, head_of
from planner.controls.export.rows import Row, Source
from planner.controls.export.source import source_of, text_of, why_not
from planner.controls.export.translate import Translator
from planner.controls.timing.linuxcnc import joined_moves, linuxcnc_times
from planner.controls.timing.models import CONTROLS as MODELS
from planner.controls.timing.models import predicted_times
from planner.controls.timing.times import LINUXCNC, feed_in_force, standing
from planner.motion.trajectory import require_rest
from planner.planning.job.plan import Plan

ROUNDING = 2.0 * 10.0**-chords.DECIMALS  # room that coordinates need [mm]
LESS = 0.9  # of the tolerance: what a plan should take that leaves room for chords
LITTLE = 0.05  # of the tolerance: room below this is worth a note
AS_IT_IS = "program as it is"
PLANNED = "planned path"
OWN_PATH = "program's own path, in the control's words"
# Of the room, for chords: wider ones are fewer lines, narrower ones turn less at each.
SHARES = (1.0, 0.5, 0.25, 0.1)
# The same for LinuxCNC; the rest is P.
LINUXCNC_SHARES = (0.6, 0.3, 0.1, 0.02)
FINEST = 2e-4  # chords closer than this [mm] are held up by the rounding of coordinates: 0.1 um of them made it 10 % slower
ROUND_MIN = 1e-3  # P below this [mm]: the model was up to 9 % too fast
OWN_CHORDS = 0.02  # share of the tolerance for chords on arcs of the program, for LinuxCNC's model
SHOWN = 4  # decimals of a predicted time [s]
MARGIN = 0.02  # of the predicted time: its error, see above
PATH_MODE = re.compile(rb"G\s*6\s*[14]", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A program that the control might be given."""

    name: str  # as printed
    line: Polyline  # its moves, for the model
    replaced: Array | None  # (R,) the rows that chords replace; None for the program as it is
    mode: str = ""  # LinuxCNC's G64, or ""
    time: float = np.nan  # predicted [s]


class Candidates:
    """A plan that is exported for a control within a tolerance of the path [mm]."""

    def __init__(self, plan: Plan, control: Control, tolerance: float):
        self.plan, self.control, self.tolerance = plan, control, tolerance

    @cached_property
    def source(self) -> Source:
        """The rows that are written. Raises InputError as `source_of` does."""
        return source_of(self.plan)

    @cached_property
    def why_not(self) -> str:
        """Why the control cannot be given the program as it is; "" if it can."""
        if self.text is None:
            return "it is no NC program"
        return why_not(self.source, self.text, self.control, self.plan.machine)

    @cached_property
    def text(self) -> bytes | None:
        """The program as it is; None for points and plotter files."""
        return text_of(self.plan.program)

    @cached_property
    def room(self) -> float | None:
        """How far chords may miss the planned motion [mm], None if that is nothing. Raises as `used` does."""
        left = self.tolerance - self.used
        return None if left < 2.0 * ROUNDING else left - ROUNDING

    @cached_property
    def used(self) -> float:
        """What the plan uses of the tolerance [mm]. Raises InputError if the motion leaves the program."""
        verdict = self.plan.verdict
        assert verdict is not None
        if verdict.contour_error_mm is None or verdict.vertex_error_mm is None:
            said = (
                "the motion leaves the program, so there is no telling what chords may add; see its verdict"
            )
            raise InputError(said)
        return max(verdict.contour_error_mm, verdict.vertex_error_mm)

    def own(self, within: float) -> list[Candidate]:
        """The program as it is, or its own moves in the control's words, with chords within so much [mm] for
        arcs and curves that it does not know."""
        line = programmed_polyline(self.plan, within)
        if not self.why_not:
            return [Candidate(name=AS_IT_IS, line=line, replaced=None)]
        return [Candidate(name=OWN_PATH, line=line, replaced=self._replaced(planned=False))]

    def chords(self, within: float) -> list[Candidate]:
        """The planned path with chords that miss it by so much at most [mm], if any line can be replaced."""
        replaced, rows = self._replaced(planned=True), self.source.rows
        if not replaced.any():
            return []
        parts = chords.groups(rows, replaced)
        planned = chords.planned_polyline(self.plan, within, chords.breaks(rows, replaced))
        own = programmed_polyline(self.plan, within)
        line = chords.spliced(planned, own, self.source.program, parts)
        if chords.off_the_path(line, self.plan, parts) > self.tolerance:
            return []
        name = f"{PLANNED}, chords within {within / MICROMETRE:.3g} µm"
        return [Candidate(name=name, line=line, replaced=replaced)]

    def _replaced(self, *, planned: bool) -> Array:
        """(R,) the rows that are written as chords: all that can be, or those that have no words there."""
        control, program = self.control, self.source.program

        def is_replaced(row: Row) -> bool:
            if row.radius:  # which the control would reckon with once more
                return not control.cycles
            own = row.value("E") is not None  # an extruder's moves stay, where the control knows them
            return (planned and row.motion <= 30 and not own) or not takes_move(row, control, program)

        return np.array([row.plain and is_replaced(row) for row in self.source.rows], dtype=bool)

    def written(self, chosen: Candidate) -> tuple[bytes, tuple[str, ...]]:
        """The file of a candidate, and notes on it. Raises InputError for a line without words there."""
        if chosen.replaced is None:  # the path mode stands on a line of its own, behind a percent sign
            assert self.text is not None
            percent = re.match(rb"\s*%[^\n]*\n", self.text)
            cut = percent.end() if percent else 0
            mode = b"G21 %b\n" % chosen.mode.encode("ascii") if chosen.mode else b""
            return self.text[:cut] + mode + self.text[cut:], ()
        machine, line = self.plan.machine, chosen.line
        step = np.abs(np.diff(line.points, axis=0))
        size = np.linalg.norm(step, axis=1, keepdims=True)
        most = machine.limits("velocity", self.plan.toolpath.axes) * size
        rapid = np.divide(most, step, out=np.full_like(step, np.inf), where=step > 0.0).min(axis=1)
        writer = Translator(self.source, self.control, machine, chosen.replaced, line, rapid)
        lines, notes = writer.translated()
        head = head_of(self.source, self.control, self.plan, self.tolerance, chosen.name)
        text = "\n".join([*head, *[chosen.mode] * bool(chosen.mode), *lines, ""])
        return text.encode("ascii", "replace"), notes

    def room_notes(self) -> tuple[str, ...]:
        """That the plan leaves no room for chords, or little."""
        if self.room is not None and self.room > LITTLE * self.tolerance:
            return ()
        tolerance, less = self.tolerance, LESS * self.tolerance
        uses = f"the plan uses {self.used / MICROMETRE:.3f} of {tolerance / MICROMETRE:g} µm, which leaves"
        if self.room is None:
            said = f"no room for chords: plan with --tolerance {less:.4g}, and export with --tolerance {tolerance:g}"
        else:
            said = f"little room for chords: a plan with --tolerance {less:.4g}, exported with --tolerance {tolerance:g}, "
            said += "may be faster on the control"
        return (f"{uses} {said}",)


def candidates(job: Candidates) -> list[Candidate]:
    """The candidates for a control, with their predicted times."""
    room = job.room
    if job.control.name != LINUXCNC:
        found = [one for share in SHARES if room is not None for one in job.chords(share * room)]
        return [_timed(job, one) for one in (*found, *job.own(room or job.tolerance))]
    tolerance, room = job.tolerance, room or 0.0
    (own,) = job.own(OWN_CHORDS * tolerance)
    if job.text is not None and PATH_MODE.search(job.text):
        return [replace(own, name=f"{own.name}, with its own path mode")]
    exact = own.replaced is None or not own.replaced.any() or own.line.miss == 0.0
    left = 0.0 if exact else OWN_CHORDS * tolerance
    joined = replace(own, name=f"{own.name}, short moves joined")
    found = [_timed(job, own, tolerance - left), _timed(job, joined, 0.5 * tolerance - left, 0.5 * tolerance)]
    for share in LINUXCNC_SHARES:
        p = (1.0 - share) * room
        if share * room >= FINEST and p >= ROUND_MIN:
            found += [_timed(job, one, p) for one in job.chords(share * room)]
    return found


def best_first(job: Candidates, found: list[Candidate]) -> list[Candidate]:
    """The candidates as they are tried: the fastest first, of equal ones the program's own, which is the last; for
    LinuxCNC the first one of them, unless another is faster by more than the model's error."""
    if job.control.name != LINUXCNC:
        return sorted([found[-1], *found[:-1]], key=lambda one: round(one.time, SHOWN))
    fastest = min(found, key=lambda one: one.time)
    first = fastest if fastest.time < (1.0 - MARGIN) * found[0].time else found[0]
    return [first, *(one for one in found if one is not first)]


def _timed(job: Candidates, one: Candidate, p: float = 0.0, q: float = 0.0) -> Candidate:
    """A candidate with its predicted time, dwells included; for LinuxCNC with G64 P and Q [mm]."""
    plan, line, name = job.plan, one.line, job.control.name
    stands = standing(plan.program, line.block, switches=name != "klipper")
    feed: FloatArray = np.where(line.rapid, np.inf, line.feed)
    mode = ""
    if name == LINUXCNC:
        kept = joined_moves(line.points, feed, line.rapid, stands, q)
        moves = line.points[kept], feed[kept[:-1]], stands[kept]
        moving = linuxcnc_times(*moves, plan.machine, plan.toolpath.axes, p)
        mode = "G64 P{:.4f} Q{:.4f}".format(*(np.floor(value * 1e4 + 1e-6) / 1e4 for value in (p, q)))
    else:
        if one.name == AS_IT_IS and job.control.rapid_feed:
            feed = np.where(line.rapid, feed_in_force(plan.program, job.text or b"")[line.block], feed)
        moving = predicted_times(line.points, feed, stands, plan.machine, plan.toolpath.axes, MODELS[name])
    return replace(one, mode=mode, time=float(moving.sum()) + float(plan.toolpath.dwell.sum()))


NO_JERK = "has no limit of the jerk, which the plan keeps: so it can be faster than the plan"


@dataclass(frozen=True, kw_only=True)
class Exported:
    """The program as written."""

    file: str  # its name
    sentence: str  # what it holds
    planned: bool  # whether it holds the planned path
    # predicted times by candidate [s]; empty for a program that LinuxCNC gets as it is, with its own path
    # mode
    predicted: dict[str, float]
    assumptions: tuple[str, ...] = ()  # where coordinates and start are, and how a first run goes
    # what was left out or written another way, what the control needs, and what would leave the chords more
    # room
    notes: tuple[str, ...] = ()


def write_program(directory: Path, plan: Plan, control: str, tolerance: float) -> Exported:
    """Write a program for a control into an existing directory.

    control   : "grbl", "klipper", "marlin" or "linuxcnc"
    tolerance : of the path [mm], which plan and chords share

    Where the plan leaves no room for chords the program's own path is written, and a note says so. Raises
    InputError if the motion leaves the program or is not from rest to rest, for a program with the tool centre point on, and with its
    line for what the control has no words for.
    """
    if plan.joints is not None:
        raise InputError(
            "a program with the tool centre point on: chords and corners are reckoned in the axes, not at the tip; planned.ngc has its "
            "planned feeds, and --for linuxcnc-stream and --for pvt play the setpoints of its joints",
            source=plan.program.source,
        )
    require_rest(plan.trajectory is None or plan.trajectory.from_rest_to_rest)
    job = Candidates(plan, CONTROLS[control], tolerance)
    found = candidates(job)
    chosen, data, notes = _first_written(job, best_first(job, found))
    file = f"{control}.ngc" if control == LINUXCNC else f"{control}.gcode"
    (directory / file).write_bytes(data)
    if chosen.replaced is not None and job.why_not:
        notes = (f"the program as it is is no {control} program: {job.why_not}", *notes)
    if len(found) > 1 or job.room is None:
        notes = (*notes, *job.room_notes())
    if chosen.replaced is None:
        sentence = f"{chosen.name}, byte for byte" + f" behind a line G21 {chosen.mode}" * bool(chosen.mode)
    else:
        sentence = ", ".join(filter(None, (chosen.name, f"{len(chosen.line.feed):,} moves", chosen.mode)))
    return Exported(
        file=file,
        sentence=sentence,
        planned=chosen.name.startswith(PLANNED),
        predicted={one.name: one.time for one in found if np.isfinite(one.time)},
        assumptions=(*assumptions(job.source, as_it_is=chosen.replaced is None), FIRST_RUN),
        notes=notes,
    )


def _first_written(job: Candidates, order: list[Candidate]) -> tuple[Candidate, bytes, tuple[str, ...]]:
    """The first candidate for which the control has the words. Raises InputError if there is none."""
    refused: InputError | None = None
    for one in order:
        try:
            return one, *job.written(one)
        except InputError as fault:
            refused = refused or fault
    assert refused is not None
    raise refused
