"""Words of Fanuc's and Haas' mills that set a frame, and patterns and pockets of Haas: their statements, and
the makers of their rows.

A programmed point p is at R S M p: M is the mirror image (G51.1; G101 of Haas), S the scale (G51), R the
rotation (G68), each about its centre, that of the rotation mirrored and scaled as the points are. After G16
the words of the plane are a radius and an angle about the work zero, after G91 G16 about where the tool is; a
radius after G91 is always about where the tool is.

    G12 G13    (Haas) a round pocket about where the tool is: to Z at F, on a half circle out to I less the tool's radius and once
               round, with K on by Q until K, and on a half circle back. L times after G91, each Z deeper
    G70 G71 G72 (Haas) L holes of the cycle in force on a circle of radius I from the angle J, on an arc with K between two, on a line
               in the direction J, I apart

Sources: Fanuc Series 0i and 30i user's manuals (scaling, rotation, mirror image, polar coordinates); Haas mill
operator's manual 2017. The half circles of G12 are this reader's: manuals show them in a picture only.
"""

import cmath
import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from planner.nc.arcs import IN_PLANE, in_plane
from planner.nc.language import swivel, tree
from planner.nc.language.making import Given, Maker, Making, Row, around, equal_steps
from planner.nc.language.rows import require
from planner.nc.language.source import SourceLine

AXES = "XYZ"
# Their own words, by code; those that have none end something, and come before the rest of their line.
WORDS = {
    "G68": "XYZABRIJK", "G68.2": "XYZIJKPQR", "G53.1": "PR", "G51": "XYZPIJK", "G51.1": "XYZIJK", "G101": "XYZ",
    "G50.1": "XYZ", "G100": "XYZ", "G69": "", "G50": "", "G15": "", "G16": "",
    "G12": "XYZIKQDLF", "G13": "XYZIKQDLF", "G70": "IJL", "G71": "IJL", "G72": "IJKL",
}  # fmt: skip
PATTERNS = ("G70", "G71", "G72")  # on lathes these are others
_THOUSANDTHS = 100.0  # a scale without a point from here on is in thousandths
_HOLES_MAX = 10_000  # of a pattern
_MIRRORS = ("G51.1", "G101")


def statements(code: str, words: tree.Words, line: SourceLine) -> tuple[list[tree.Statement], tree.Words]:
    """The statements of such a code, and the words of its line that are not its own. Raises ProgramFault."""
    own = {word.letter: word for word in words if word.letter in WORDS[code]}
    rest = tuple(word for word in words if word.code != code and word.letter not in own)
    given = {letter: _scale(word, line) if code == "G51" else word.value for letter, word in own.items()}
    else_set = "else by a setting of the control; write the"
    if code == "G51" and not own.keys() & set("PIJK"):
        raise line.fault(f"scaling is by a factor P, or I, J and K, {else_set} scaled coordinates out")
    what = "rotating the coordinate system is by an angle R"
    line.require(code != "G68" or "R" in own, f"{what}, {else_set} rotated coordinates out")
    if code == "G68" and own.keys() & set("IJK"):
        raise line.fault("G68 with I J K turns about an axis in space, and tilts the plane; write moves out")
    return [tree.made(line.place, MAKERS[code], **given)], rest


def _scale(word: tree.Word, line: SourceLine) -> tree.Expression:
    """P, I, J, K of G51: without a point they are in thousandths, as Fanuc has it."""
    value = word.value
    if word.letter in AXES or not isinstance(value, tree.Number) or abs(value.value) < _THOUSANDTHS:
        return value
    text = line.text[word.at - line.start + 1 :].lstrip(" +-0123456789")
    return value if text[:1] == "." else tree.Number(value.value / 1000.0)


def _set(making: Making, code: str, given: Given) -> None:
    travel, state = making.travel, making.interpreter.state
    parts, here, plane = travel.parts, travel.position(), IN_PLANE[state.normal]
    centre, absolute = here.copy(), making.absolute
    named = [axis for axis, letter in enumerate(AXES) if letter in given]
    for axis in named:
        centre[axis] = given[AXES[axis]] * making.unit + (0.0 if absolute else here[axis])
    if code == "G68":
        for axis, letter in zip(plane, "AB", strict=True):
            centre[axis] = given[letter] * making.unit if letter in given else centre[axis]
        parts.about = centre
        parts.rotation = given["R"] + (0.0 if absolute else parts.rotation)
        parts.normal = state.normal
    elif code == "G69":
        parts.rotation = 0.0
    elif code == "G51":
        factors = [given.get(letter, given.get("P", 1.0)) for letter in "IJK"]
        require(0.0 not in factors, "a scale of 0 makes a point of everything")
        parts.scale, parts.centre = np.array(factors), centre
    elif code == "G50":
        parts.scale = np.ones(3)
    elif code in _MIRRORS:
        require(named, f"{code} needs the axes that it mirrors, and where: {code} X0")
        parts.mirror[named], parts.mirrored_at[named] = -1.0, centre[named]
    else:
        parts.mirror[named or slice(None)] = 1.0


def _frame(making: Making, given: Given, *, code: str) -> None:
    """G68 and the others. Raises ValueError."""
    travel = making.travel
    if making.interpreter.cutter is not None:
        raise ValueError(f"{code} while cutter radius compensation is on; write G40 before it")
    if code == "G69" and not swivel.is_level(travel):
        swivel.tilt(making, np.eye(3), np.zeros(3), swivel.NO_MOVE, 0)
    _set(making, code, given)
    parts = travel.parts
    if parts.rotation % 360.0 and (parts.mirror < 0.0).any():
        making.assume("a mirror image together with a rotation: the rotation is that of the mirrored points")
    matrix, shift = parts.affine()
    if travel.active or not (matrix == np.eye(3)).all():
        travel.set_frame(matrix, shift)


def _tilted(making: Making, given: Given) -> None:
    """G68.2: the plane, at X Y Z, turned by I about z, J about its x and K about its z. Raises ValueError."""
    if given.get("P", 0.0):
        raise ValueError(f"G68.2 P{given['P']:g} is another way to write a plane; write its angles I J K")
    shift, angles = ([given.get(c, 0.0) for c in letters] for letters in ("XYZ", "IJK"))
    swivel.plane(making, swivel.euler(*angles), np.array(shift) * making.unit, swivel.WAYS["STAY"], 0)


def _to_plane(making: Making, given: Given) -> None:
    """G53.1: the rotary axes turn to the plane. P1, P2: the tilting axis positive, negative."""
    side = {0: 0, 1: 1, 2: -1}.get(round(given.get("P", 0.0)))
    if side is None:
        raise ValueError("P of G53.1 is 0, 1 or 2")
    swivel.tilt(making, *making.travel.swivelled, swivel.WAYS["TURN"], side)


def _polar(making: Making, given: Given) -> None:
    """G16."""
    here = in_plane(making.travel.position(), making.interpreter.state.normal)
    making.travel.set_polar(0j if making.absolute else here)


def _round_pocket(making: Making, given: Given, *, turning: int) -> Iterator[Row]:
    """G12 (turning -1) and G13. Raises ValueError."""
    name = "G13" if turning > 0 else "G12"
    if making.interpreter.state.normal != 2 or not given.keys() >= {"I", "Z"}:
        raise ValueError(f"{name} needs G17, its depth as Z and a radius as I")
    tool = round(given.get("D", 0.0))
    known = making.interpreter.state.tools.get(tool)
    if tool and (known is None or not known.diameter):
        raise ValueError(f"{name} needs the diameter of tool {tool}; write it into the machine's [tools]")
    radius = known.diameter / 2.0 / making.unit if tool and known is not None else 0.0
    first, last = given["I"] - radius, given.get("K", given["I"]) - radius
    if not 0.0 < first <= last or ("K" in given and not given.get("Q", 0.0) > 0.0):
        raise ValueError(f"{name}: I is more than the tool's radius, K than I, with Q from circle to circle")
    count = equal_steps(last - first, given["Q"]) if last > first else 0
    sizes = [*(first + n * given["Q"] for n in range(count)), last]
    return around(making, _circles(making, given, sizes, turning), feed=False)


def _circles(making: Making, given: Given, sizes: list[float], turning: int) -> Iterator[Row]:
    absolute, (x, y, z) = making.absolute, making.here()
    if "X" in given or "Y" in given:
        x, y = (given[c] + (0.0 if absolute else v) if c in given else v for c, v in (("X", x), ("Y", y)))
        yield [("G", 0.0), ("X", x), ("Y", y)]
    code, feed = 3.0 if turning > 0 else 2.0, [("F", given["F"])] if "F" in given else []
    for n in range(1, round(given.get("L", 1.0)) + 1 if not absolute else 2):
        yield [("G", 1.0), *feed, ("Z", given["Z"] if absolute else z + n * given["Z"])]
        yield [("G", code), ("X", x + sizes[0]), ("Y", y), ("I", sizes[0] / 2.0), ("J", 0.0)]
        for k, size in enumerate(sizes):
            if k:
                yield [("G", 1.0), ("X", x + size)]
            yield [("G", code), ("X", x + size), ("Y", y), ("I", -size), ("J", 0.0)]
        yield [("G", code), ("X", x), ("Y", y), ("I", -sizes[-1] / 2.0), ("J", 0.0)]


def _pattern(making: Making, given: Given, *, code: str) -> Iterator[Row]:
    """G70, G71, G72 of Haas' mills: the places of holes. Raises ValueError."""
    state, count = making.interpreter.state, round(given.get("L", 0.0))
    if state.series is None or not 0 < count <= _HOLES_MAX or "I" not in given:
        raise ValueError(f"{code} needs a drilling cycle in force, I, and the number of holes as L")
    x, y, _ = making.here()
    begin, step = math.radians(given.get("J", 0.0)), math.radians(given.get("K", 360.0 / count))
    for n in range(count):
        size, angle = (n * given["I"], begin) if code == "G72" else (given["I"], begin + n * step)
        place = cmath.rect(size, angle)
        yield [("X", x + place.real), ("Y", y + place.imag)]


MAKERS: dict[str, Maker] = {
    **{code: partial(_frame, code=code) for code in WORDS},
    "G15": lambda making, given: making.travel.set_polar(None),
    "G16": _polar,
    "G68.2": _tilted,
    "G53.1": _to_plane,
    "G12": partial(_round_pocket, turning=-1),
    "G13": partial(_round_pocket, turning=1),
    **{code: partial(_pattern, code=code) for code in PATTERNS},
}
