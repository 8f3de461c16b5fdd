"""Whether an exported program passes the places that its program passes: other code than the exporter's.

Both are read once more, behind lines that set work offsets and a start of their own, by the reader, and for LinuxCNC by `rs274`. What
comes out are two polylines in machine coordinates. A walk along both at once, never back, must keep them within the tolerance (the
discrete Frechet distance of points that are close together), and dwells and stops must be equally many.
"""

from __future__ import annotations

import math
import os
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planner.base.arrays import FloatArray
from planner.base.kernels import njit
from planner.machine import Machine
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.reading import AS_USUAL, Reading

STEP = 0.05  # between the points of a polyline that is compared [mm]
STARTS = ((0.0, 0.0, 0.0), (150.0, 80.0, 40.0), (-33.5, 61.25, -7.0))  # machine positions [mm]
OFFSETS = ((0.0, 0.0, 0.0), (-210.5, -95.25, -60.0))  # of G54; each system has its own besides
ARC_STEP = 0.02  # [rad]


def prefix(start: tuple[float, ...], offset: tuple[float, ...]) -> str:
    """Lines that bring a machine to a start, with work offsets of its own; they leave the modes as they are at the start."""
    lines = ["G21 G90 G17 G94"]
    for number in range(1, 7):
        x, y, z = (value + 3.0 * (number - 1) * (value != 0.0) for value in offset)
        lines.append(f"G10 L2 P{number} X{x:g} Y{y:g} Z{z:g}")
    lines.append("G53 G0 X{:g} Y{:g} Z{:g}".format(*start))
    return "\n".join([*lines, "G80", ""])


def readable(text: str, control: str = "") -> str:
    """A program as the reader knows it: PAUSE is M0, milliseconds are seconds, but where M82 or M83 tell the reader that it is a
    printer's; without percent signs, and M400 at its end."""
    if control in MILLISECONDS and not re.search(r"^M8[23]\b", text, flags=re.MULTILINE):
        text = re.sub(
            r"^G4 P([\d.]+)", lambda found: f"G4 P{float(found[1]) / 1e3:g}", text, flags=re.MULTILINE
        )
    text = re.sub(r"^M400\s*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^PAUSE\b.*$", "M0", text, flags=re.MULTILINE)
    return re.sub(r"^\s*%.*$", "", text, flags=re.MULTILINE)


@dataclass(frozen=True, eq=False)
class Passed:
    """What a program does when it is read from a start, behind work offsets: the places (n, A) that it passes in machine coordinates
    [mm, rad], how often it dwells or stops, and how long it dwells in all [s]."""

    places: FloatArray
    rests: tuple[int, float]


def passed(
    text: str,
    machine: Machine,
    start: tuple[float, ...],
    offset: tuple[float, ...],
    reading: Reading = AS_USUAL,
) -> Passed:
    """What a program does behind the lines of `prefix`."""
    head = prefix(start, offset)
    return passed_by(parse_program(head + readable(text), machine, reading), head.count("\n"))


def path(
    text: str,
    machine: Machine,
    start: tuple[float, ...],
    offset: tuple[float, ...],
    reading: Reading = AS_USUAL,
) -> FloatArray:
    """The places (n, A) [mm, rad] that a program passes in machine coordinates."""
    return passed(text, machine, start, offset, reading).places


def passed_by(program: Program, skipped: int = 0) -> Passed:
    """What a program does after its first so many lines."""
    begun = int(np.searchsorted(program.line, skipped, side="right"))
    places = [program.end[begun - 1 : begun] if begun else program.start[None]]
    arcs = dict(zip(program.arc_block.tolist(), range(len(program.arc_block)), strict=True))
    for k in np.flatnonzero(np.isin(program.kind, (Kind.ARC, Kind.SPLINE))).tolist():
        if k < begun:
            continue
        straight = program.end[begun:k]
        places.append(straight)
        here = program.end[k - 1] if k else program.start
        bend = (
            _arc(program, arcs[k], here, program.end[k])
            if program.kind[k] == Kind.ARC
            else _curve(program, k)
        )
        places += [bend, program.end[k : k + 1]]
        begun = k + 1
    places.append(program.end[begun:])
    rests = int(np.isin(program.kind, (Kind.DWELL, Kind.STOP)).sum())
    return Passed(np.vstack(places), (rests, round(float(program.dwell.sum()), 6)))


def _arc(program: Program, row: int, start: FloatArray, end: FloatArray) -> FloatArray:
    centre, normal, sweep = (
        program.arc_center[row],
        int(program.arc_normal[row]),
        float(program.arc_sweep[row]),
    )
    a, b = {2: (0, 1), 1: (2, 0), 0: (1, 2)}[normal]
    begin = math.atan2(start[b] - centre[b], start[a] - centre[a])
    radius = math.hypot(start[a] - centre[a], start[b] - centre[b])
    share = np.linspace(0.0, 1.0, 2 + int(abs(sweep) / ARC_STEP))
    points = start + share[:, None] * (end - start)
    points[:, a] = centre[a] + radius * np.cos(begin + share * sweep)
    points[:, b] = centre[b] + radius * np.sin(begin + share * sweep)
    return points


def _curve(program: Program, block: int) -> FloatArray:
    found = []
    for row in np.flatnonzero(program.splines.block == block):
        points, weights = program.splines.points[row], program.splines.weights[row]
        u = np.linspace(0.0, 1.0, 65)[:, None]
        basis = np.hstack([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u * u * (1 - u), u**3]) * weights
        found.append(basis @ points / basis.sum(axis=1, keepdims=True))
    return np.vstack(found)


def alike(one: FloatArray, other: FloatArray, within: float, step: float = STEP) -> bool:
    """Whether two polylines (n, A), (m, A) are passed side by side within a distance, above the step between the points compared."""
    if one.shape[1] != other.shape[1]:
        wide = max(one.shape[1], other.shape[1])
        one, other = (np.pad(line, ((0, 0), (0, wide - line.shape[1]))) for line in (one, other))
    return bool(_walk(_dense(one, step), _dense(other, step), within + step))


def _dense(line: FloatArray, step: float) -> FloatArray:
    chord = np.diff(line, axis=0)
    count = np.maximum(1, np.ceil(np.linalg.norm(chord, axis=1) / step)).astype(np.int64)
    segment = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count) + 1
    inner: FloatArray = line[segment] + (number / count[segment])[:, None] * chord[segment]
    return np.ascontiguousarray(np.vstack([line[:1], inner]))


@njit(cache=True)
def _walk(one, other, within):  # pragma: no cover - compiled
    """Whether both can be walked from end to end, never back, within a distance: the rows of the table of reachable pairs, each only
    as wide as it is reached."""
    limit = within * within
    reached = np.zeros(len(other), dtype=np.bool_)
    low, high = 0, -1
    for i in range(len(one)):
        first, last = -1, -1
        left, corner = False, False
        j = low
        while j < len(other):
            above = j <= high and reached[j]
            d = 0.0
            for a in range(one.shape[1]):
                d += (one[i, a] - other[j, a]) ** 2
            now = d <= limit and (above or left or corner or (i == 0 and j == 0))
            if i == 0 and j > 0:
                now = d <= limit and left
            corner = above
            reached[j] = now
            left = now
            if now:
                first = j if first < 0 else first
                last = j
            elif j > high + 1:
                break
            j += 1
        if first < 0:
            return False
        for k in range(last + 1, min(max(high, last) + 3, len(other))):
            reached[k] = False
        low, high = first, last
    return high == len(other) - 1 and reached[len(other) - 1]


TOOLS = 99  # in the tool table that `rs274` is given
_CANON = re.compile(r"\d+ N\S* +(\w+)\((.*)\)")


def interpreted(text: str, start: tuple[float, ...], offset: tuple[float, ...]) -> FloatArray | str:
    """The places (n, 6) [mm, degrees] that LinuxCNC's interpreter (`rs274`) passes; its message where it refuses the program."""
    head = prefix(start, offset)
    body = re.sub(r"^\s*%.*$", "", text, flags=re.MULTILINE)
    body += "" if re.search(r"M0?2\b|M30\b", body) else "\nM2\n"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "program.ngc"
        file.write_text(head + body)
        (Path(folder) / "p.var").write_text("")
        tools = Path(folder) / "tool.tbl"  # of no length and no radius
        tools.write_text("".join(f"T{n} P{n} D0\n" for n in range(1, TOOLS + 1)))
        ran = subprocess.run(
            ["rs274", "-g", "-t", str(tools), "-v", str(Path(folder) / "p.var"), str(file)],
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "HOME": folder},  # where it shares its tool table with whatever else runs
        )
    if ran.returncode:
        return " ".join((ran.stdout + ran.stderr).strip().splitlines()[-2:]) or "refused"
    return _canonical(ran.stdout, start)


def _canonical(said: str, start: tuple[float, ...]) -> FloatArray:
    unit, plane, begun = 1.0, "XY", False
    g5x, g92, tool = np.zeros(6), np.zeros(6), np.zeros(6)
    here = np.zeros(6)
    found: list[FloatArray] = []

    def machine(numbers: list[float]) -> FloatArray:
        place = np.array(numbers[:6])
        place[:3] *= unit
        return place + g5x + g92 + tool

    def offset(numbers: list[float]) -> FloatArray:
        place = np.array(numbers[:6])
        place[:3] *= unit
        return place

    for line in said.splitlines():
        match = _CANON.search(line)
        if match is None:
            continue
        name, words = match.groups()
        numbers = [float(n) for n in re.findall(r"-?\d+\.?\d*", words)] if "CANON" not in words else []
        if name == "USE_LENGTH_UNITS":
            unit = 25.4 if "INCH" in words else 1.0
        elif name == "SELECT_PLANE":
            plane = words.rpartition("_")[2]
        elif name == "SET_G5X_OFFSET":
            g5x = offset(numbers[1:])
        elif name == "SET_G92_OFFSET":
            g92 = offset(numbers)
        elif name == "USE_TOOL_LENGTH_OFFSET":
            tool = np.array([*numbers[:3], 0.0, 0.0, 0.0])
            tool[:3] *= unit
        elif name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED"):
            here = machine(numbers)
            if not begun:  # the prefix leads to the start
                begun = bool(np.allclose(here[:3], start, atol=1e-3))
                found = [here] if begun else []
                continue
            found.append(here)
        elif name == "ARC_FEED":
            found += _canonical_arc(numbers, plane, unit, machine, here)
            here = found[-1]
    return np.array(found)


def _canonical_arc(numbers, plane, unit, machine, here):  # type: ignore[no-untyped-def]
    first, second, c1, c2, turns, axial = numbers[:6]
    a, b, n = {"XY": (0, 1, 2), "YZ": (1, 2, 0), "XZ": (2, 0, 1)}[plane]
    end, centre = [0.0] * 6, [0.0] * 6
    end[a], end[b], end[n] = first, second, axial
    centre[a], centre[b] = c1, c2
    end[3:6] = numbers[6:9]
    stop, middle = machine(end), machine(centre)
    begin = math.atan2(here[b] - middle[b], here[a] - middle[a])
    sweep = math.atan2(stop[b] - middle[b], stop[a] - middle[a]) - begin
    turn = 2.0 * math.pi
    sweep = sweep % turn if turns > 0 else -((-sweep) % turn)
    if abs(sweep) < 1e-3:  # four decimals of an end point
        sweep = math.copysign(turn, turns)
    sweep += math.copysign(turn * (abs(turns) - 1), turns)
    radius = math.hypot(here[a] - middle[a], here[b] - middle[b])
    share = np.linspace(0.0, 1.0, 2 + int(abs(sweep) / ARC_STEP))
    points = here + share[:, None] * (stop - here)
    points[:, a] = middle[a] + radius * np.cos(begin + share * sweep)
    points[:, b] = middle[b] + radius * np.sin(begin + share * sweep)
    return list(points)


# What each control may be given, as lines: written by hand from the controls' own lists, beside the exporter's tables.
_CODES_OF_GRBL = frozenset((
    *(f"G{code}" for code in (0, 1, 2, 3, 4, 10, 17, 18, 19, 20, 21, 28, 28.1, 30, 30.1, 40, 43.1, 49, 53, 54, 55, 56, 57, 58, 59)),
    *(f"G{code}" for code in (61, 80, 90, 91, 91.1, 92, 92.1, 93, 94)),
    *(f"M{code}" for code in (0, 1, 2, 30, 3, 4, 5, 7, 8, 9)),
))  # fmt: skip
_PRINTERS = (
    r"M400|G1[01]|G21|G90|G91|G28|G4 P[\d.]+|G92( [XYZE]-?[\d.]+)+|G[01]( [XYZEF]-?[\d.]+)+|"
    r"M(18|84)|M(8[23]|10[4-79]|11[4-9]|140|190|204|22[01])\b.*"
)
_LINES = {
    "klipper": re.compile(f"PAUSE|{_PRINTERS}"),
    "marlin": re.compile(
        r"G[23]( [XYZIJREF]-?[\d.]+)+|M[01]|M(7[567]|155|20[135]|30[12]|420|900)\b.*|"
        rf"M[34]( S[\d.]+)?|M[5789]|M(17|18|84)\b.*|{_PRINTERS}"
    ),
}
MILLISECONDS = frozenset(_LINES)  # controls whose G4 P counts them


def unknown_words(text: str, control: str) -> str:
    """The first line of an exported program that its control does not know; "" for none, and for LinuxCNC, which `rs274` speaks for."""
    for given in text.splitlines():
        line = re.sub(r"\([^)]*\)" if control == "grbl" else r";.*", "", given).split(";")[0].strip().upper()
        if not line or control == "linuxcnc":
            continue
        if control in _LINES:
            if not _LINES[control].fullmatch(line):
                return given
            continue
        left = re.sub(r"[A-Z]\s*[-+]?[\d.]+|\s", "", line)
        words = re.findall(r"([A-Z])\s*([-+]?[\d.]+)", line)
        codes = [f"{letter}{float(number):g}" for letter, number in words if letter in "GM"]
        others = {letter for letter, _ in words} - set("GMFIJKLNPRSTXYZ")
        if (left and not re.fullmatch(r"\$[HX]", line)) or others or not _CODES_OF_GRBL.issuperset(codes):
            return given
    return ""
