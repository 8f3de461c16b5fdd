"""From what the readings of a motion showed to checks and to faults in sentences."""

import itertools
from functools import partial

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.geometry.toolpath import Toolpath
from planner.motion.trajectory import in_degrees
from planner.verifier import limits as rows
from planner.verifier.excess import FAULTS_OF_A_KIND, Excess, Fault, Kind, first_of, of_check, placed
from planner.verifier.matching import HELD, LAST, LOST_AFTER, NOT_LOST, STUCK_AT
from planner.verifier.pieces import CONTOUR_ROUNDING, RATIO_ROUNDING, ProgramPieces
from planner.verifier.stream import Observed
from planner.verifier.verdict import LimitCheck
from planner.verifier.worst import BACK, DIFFERENCE, Limits, Worst

# A stop between two samples shows as speed and distance just at what the acceleration allows, and hours into
# a motion times are good to 1e-12 s only; a motion that does not stop exceeds it by far more.
STOP_ROUNDING = 1e-3


def joint_times(reading: Observed, pieces: ProgramPieces) -> FloatArray:
    """(M+1,) times at which the motion passes the joints of M segments [s], in order: each when it is nearest, and no
    earlier than the joint before, the time of one that is not reached. A late time hides no fault: a joint is compared
    with the chords run while the piece before it is possible, within the tolerance of that piece."""
    near: FloatArray = reading.match.passed["near_time"][np.flatnonzero(pieces.joint["real"])]
    return np.maximum.accumulate(near)


def measured(readings: list[Observed], group: int) -> FloatArray:
    """Largest ratio per axis (A,) of a group of rows, over all readings."""
    axes = readings[0].worst.at.shape[1]
    ratios = [reading.worst.row[group * axes : (group + 1) * axes, 0] for reading in readings]
    return np.array(ratios).max(axis=0)


def excesses(
    readings: list[Observed], checks: dict[str, LimitCheck], not_limited: tuple[str, ...]
) -> list[Excess]:
    """Where limits are exceeded: wherever columns show it, else at the worst place of the check."""
    found = [each for reading in readings for each in reading.worst.over.excesses(not_limited)]
    shown = {each.name for each in found}
    broken = [check for name, check in checks.items() if check.broken and name.partition(".")[0] not in shown]
    back = BACK * readings[0].gap_max  # a difference of positions is of what lies so far behind it
    return found + [of_check(check.name, (check.time - back, check.time), check.ratio) for check in broken]


# ---- limits and columns


def limit_checks(
    readings: list[Observed], toolpath: Toolpath, pieces: ProgramPieces, not_limited: tuple[str, ...]
) -> dict[str, LimitCheck]:
    """The worst of every limit that bounds anything, by name."""
    checks = {}
    for row, (name, _) in enumerate(readings[0].worst.names):
        bounded = name == "feed" or any(np.isfinite(reading.worst.least[row]) for reading in readings)
        if name and bounded:
            reading = max(readings, key=lambda each: each.worst.row[row, 0])
            line = line_of(toolpath, pieces, int(reading.worst.piece[row]))
            checks[name] = check_of(reading.worst, row, toolpath, line, not_limited, reading.note)
    return checks


def check_of(
    worst: Worst, row: int, toolpath: Toolpath, line: int, not_limited: tuple[str, ...], note: str = ""
) -> LimitCheck:
    """The worst of one quantity, rotary axes in degrees; `note` says of which reading it is."""
    name, unit = worst.names[row]
    ratio, value, limit, how = worst.row[row].tolist()
    degrees = in_degrees(toolpath.axes, toolpath.radius)
    letter = name.rpartition(".")[2]
    per = float(degrees[toolpath.axes.index(letter)]) if letter in toolpath.axes else 1.0
    seen = "differences of position" if how == DIFFERENCE else "column"
    return LimitCheck(
        name=name,
        unit=unit,
        ratio=ratio,
        value=value * per,
        limit=(limit if ratio > 0 else float(worst.least[row])) * per,
        time=float(worst.time[row]),
        position=worst.at[row] * degrees,
        line=line,
        limited=name.partition(".")[0] not in not_limited,
        note=", ".join(filter(None, (seen, note))) if ratio > 0 else "",
    )


def column_faults(
    readings: list[Observed], limits: Limits, toolpath: Toolpath, pieces: ProgramPieces
) -> list[Fault]:
    """Columns that do not belong to the positions (formulas in `limits`)."""
    acceleration = np.maximum(1.0, measured(readings, rows.ACCELERATION)) * (1.0 + RATIO_ROUNDING)
    jerk = np.maximum(1.0, measured(readings, rows.JERK)) * (1.0 + RATIO_ROUNDING)
    tests = [("velocity", "the positions", rows.GAP_BY_ACCELERATION, acceleration)]
    if limits.jerk_limited:
        tests.append(("velocity", "the positions", rows.GAP_BY_JERK, jerk))
        tests.append(("acceleration", "the velocity column", rows.GAP_OF_ACCELERATION, jerk))
    said, axes = [], len(toolpath.axes)
    for reading, (column, against, group, bound) in itertools.product(readings, tests):
        worst = reading.worst
        ratios = worst.row[group * axes : (group + 1) * axes, 0]
        for axis in np.flatnonzero(ratios > bound):
            row, ratio = group * axes + axis, float(ratios[axis])
            time, line = float(worst.time[row]), line_of(toolpath, pieces, int(worst.piece[row]))
            name = f"{column}.{toolpath.axes[axis]}"
            found = f"{name} does not agree with {against} at t = {time:.6g} s, line {line}: "
            found += reading.noted(f"{ratio:.6g} of the difference that the limits allow")
            said.append(Fault(Kind.SAMPLES, "columns", found, ratio=ratio, time=time, line=line))
    return said


# ---- ends, order, stops


def end_error(
    readings: list[Observed], toolpath: Toolpath, rounding: FloatArray
) -> tuple[float, list[Fault]]:
    """Distance of the first and last sample from where the program starts and ends [mm], and the faults; rounding (A,):
    largest error of a position by its digits [mm]."""
    worst, said = 0.0, []
    allowed = CONTOUR_ROUNDING + float(np.linalg.norm(rounding))
    for reading in readings:
        for name, place, wanted, time, line in (
            ("start", reading.first, toolpath.start[0], reading.t_first, toolpath.line[0]),
            ("end", reading.last, toolpath.end[-1], reading.t_last, toolpath.line[-1]),
        ):
            distance = float(np.linalg.norm(place - wanted))
            worst, ratio = max(worst, distance), distance / allowed
            if distance > allowed:
                text = f"the motion's {name} at t = {time:.6g} s is {distance:.6g} mm from the program's, "
                text += reading.noted(f"{allowed:.2g} mm allowed, line {line}")
                said.append(Fault(Kind.ORDER, name, text, ratio=ratio, time=time, line=int(line)))
    return worst, said


def unvisited(
    readings: list[Observed], toolpath: Toolpath, pieces: ProgramPieces
) -> tuple[bool, list[Fault]]:
    """Whether every segment is visited, and faults of blocks that are left out or not followed."""
    complete, said = True, []
    end_within = pieces.joint["budget"][-1] * (1.0 + RATIO_ROUNDING) + CONTOUR_ROUNDING
    for reading in readings:
        match = reading.match
        left_out = match.track["lost"].copy()
        left_out[match.tally[LAST] + 1 :] = True
        left_out[-1] |= not match.passed["near"][-1] <= end_within
        here = np.unique(pieces.piece["segment"][left_out])
        if len(here):
            complete = False
            lines = list(dict.fromkeys(toolpath.line[here].tolist()))
            shown = ", ".join(map(str, lines[:FAULTS_OF_A_KIND])) + " ..." * (len(lines) > FAULTS_OF_A_KIND)
            left = f"{len(here)} blocks are not run to their end, line {shown}"
            said.append(_order(reading.noted(left), lines[0]))
        if match.tally[HELD]:
            line = line_of(toolpath, pieces, int(match.tally[LOST_AFTER]))
            held = f"lost after line {line}: {match.tally[HELD]} places looked at are far from where the program should be"
            said.append(_order(reading.noted(held), line))
    return complete, said


def _order(found: str, line: int) -> Fault:
    return Fault(Kind.ORDER, "order", found, line=line)


def out_of_order(readings: list[Observed], toolpath: Toolpath, pieces: ProgramPieces) -> list[Fault]:
    """The fault of a motion that is near enough to all of the path, but comes near to a vertex before it has been at the
    one before. To be asked of a motion that has no other fault of the contour, the vertices or the order."""
    for reading in readings:
        at = int(reading.match.tally[STUCK_AT])
        if at != NOT_LOST:
            line = line_of(toolpath, pieces, at - 1)
            said = f"near enough to all of the path, but not in its order, at the end of line {line}"
            return [_order("the motion is " + reading.noted(said), line)]
    return []


def stop_faults(
    readings: list[Observed], toolpath: Toolpath, pieces: ProgramPieces, limits: Limits
) -> list[Fault]:
    """Full stops that are run through, and dwells cut short."""
    joint = np.flatnonzero(pieces.joint["real"])
    # A motion above its limits leaves a rest faster than they say: it is not called short by that, too.
    over = np.sqrt(measured(readings, rows.ACCELERATION).max())
    if limits.jerk_limited:
        over = max(over, np.cbrt(measured(readings, rows.JERK).max()))
    hurry = 2.0 * (1.0 - (1.0 - STOP_ROUNDING) / max(over, 1.0))
    said = []
    for reading in readings:
        passed = reading.match.passed[joint]
        ratio, rest = passed["stop_ratio"], passed["rest"]
        visited = np.isfinite(ratio)  # the others belong to blocks that are not run, which `order` names
        through = (pieces.joint["stop"][joint] == 1) & visited & (ratio > 1.0 + STOP_ROUNDING)
        # n periods are summed with one rounding each; the two beside the rest are known as well as a stop
        unknown = RATIO_ROUNDING * toolpath.dwell + hurry * reading.gap_max + 2.0 * limits.time_rounding
        short = toolpath.dwell - rest > unknown

        def fault(stop: bool, i: int, reading: Observed = reading, passed: Array = passed) -> Fault:
            ratio, rest, line = (
                float(passed["stop_ratio"][i]),
                passed["rest"][i],
                int(toolpath.line[max(i - 1, 0)]),
            )
            by = f"{rest:.6g} s at most, {toolpath.dwell[i]:.6g} s programmed"
            by = f"{ratio:.6g} of the speed or distance that a sample next to it can have" if stop else by
            where = placed(toolpath.axes, toolpath.start[i] if i < len(toolpath) else toolpath.end[-1])
            text = f"{'no full stop' if stop else 'too short'} at the {'end' if i else 'start'} of line {line}, {where}: "
            name, of = ("stop", ratio) if stop else ("dwell", None)
            return Fault(Kind.STOP, name, text + reading.noted(by), ratio=of, line=line)

        said += first_of(np.flatnonzero(through), partial(fault, True), "such places")
        said += first_of(np.flatnonzero(short), partial(fault, False), "such places")
    return said


def line_of(toolpath: Toolpath, pieces: ProgramPieces, piece: int) -> int:
    """The source line of a piece of the program; for a negative one that of the first piece."""
    return int(toolpath.line[pieces.piece["segment"][max(piece, 0)]])
