"""G5, G5.1, G5.2 with G5.3, and G6.2 (docs/language.md, "Curves"): words to rational Bezier cubics
(nc/bezier.py), exactly.

A curve of several lines is one block, at the line where it begins. The knots of G5.2 are even, with the ends'
repeated, as LinuxCNC has them; those of G6.2 stand in its lines, as Fanuc has it.
"""

from dataclasses import dataclass, field

import numpy as np

from planner.base.arrays import FloatArray
from planner.nc.bezier import cubic_pieces, homogeneous, raised
from planner.nc.codes import CUBIC, NURBS, NURBS_END, NURBS_WITH_KNOTS, QUADRATIC
from planner.nc.lexer import Words
from planner.nc.moves import Block, WordFault, target
from planner.nc.state import State

ORDERS = (2, 3, 4)  # of G5.2 and G6.2: degree + 1, at most that of cubic pieces
SAME_PLACE = 1e-3  # a first control point this near is where the machine stands [mm]
Pieces = tuple[FloatArray, FloatArray]  # (K, 4, 3) control points [mm] and (K, 4) weights
_CODES = {NURBS: (NURBS, NURBS_END), NURBS_WITH_KNOTS: (NURBS_WITH_KNOTS,)}  # that do not leave a curve


@dataclass(slots=True)
class OpenSpline:
    """A curve of several lines, as far as it was read."""

    line: int  # where it begins, as `word`
    word: int
    code: int  # NURBS or NURBS_WITH_KNOTS
    order: int  # degree plus one
    blocks: int  # of the program before it
    points: list[FloatArray] = field(default_factory=list)  # control points (3,) [mm]
    weights: list[float] = field(default_factory=list)  # of each [-]
    knots: list[float] = field(default_factory=list)  # of G6.2

    @property
    def ended(self) -> bool:
        """True if a G6.2 curve has all of its knots."""
        return self.code == NURBS_WITH_KNOTS and len(self.knots) >= len(self.points) + self.order

    @property
    def unfinished(self) -> str:
        """The message for a curve that is left before its end."""
        if self.code == NURBS:
            return f"the spline of line {self.line} does not end; write G5.3 after its last control point"
        return (
            f"the spline of line {self.line} has {len(self.points)} control points and {len(self.knots)} knots; order P{self.order} "
            f"needs {len(self.points) + self.order} knots, the last {self.order} in lines of their own"
        )


def _fault(block: Block, message: str) -> WordFault:
    return WordFault(min(block.at.values()), message)


class SplineReader:
    """Reads the lines of splines; `open` is the curve that is not at its end."""

    def __init__(self) -> None:
        self.open: OpenSpline | None = None
        self._words: Words | None = None  # that hold the word of the open curve, if they were executed before
        self._reflected: tuple[int, FloatArray] | None = None  # blocks after the last G5, and its -(P, Q)

    def read(self, state: State, block: Block, blocks: int) -> tuple[Pieces, int] | None:
        """The pieces of the curve that ends on this line, and the line where it begins; None where none ends.
        `blocks` of the program were read before. Raises WordFault for words that are missing or contradict
        each other; an open curve is then given up."""
        code = state.motion
        try:
            if self.open is not None and self.open.blocks != blocks:
                text = f"a dwell, a stop or a move stands inside the spline of line {self.open.line}"
                raise _fault(block, text)
            if self.open is not None and block.g.get("motion") not in (None, *_CODES[self.open.code]):
                raise _fault(block, self.open.unfinished)
            if code in (CUBIC, QUADRATIC):
                return (self._cubic if code == CUBIC else _quadratic)(state, block, blocks), block.line
            if code == NURBS_WITH_KNOTS:
                return self._fanuc(state, block, blocks)
            return self._nurbs(state, block, blocks)
        except WordFault:
            self.open = None
            raise

    def keep(self, words: Words) -> None:
        """Keep the chunk that was executed, if the curve that is open begins in it: its fault names a word."""
        if self.open is None:
            self._words = None
        elif self._words is None:
            self._words = words

    def faults(self) -> list[tuple[Words, int, str]]:
        """The fault of a curve that is open where the program ends."""
        if self.open is None or self._words is None:
            return []
        return [(self._words, self.open.word, self.open.unfinished)]

    def _cubic(self, state: State, block: Block, blocks: int) -> Pieces:
        end = _end_in_plane(state, block, "G5")
        text = "G5 needs P and Q: its second control point, from its end"
        block.require("P" in block.value and "Q" in block.value, text)
        near, far = _offset(state, block, "IJ"), _offset(state, block, "PQ")
        if not block.has("IJ"):
            if self._reflected is None or self._reflected[0] != blocks:
                raise block.fault("G5 needs I and J, its first control point from its start, or a G5 before")
            near = self._reflected[1]
        else:
            block.require("I" in block.value and "J" in block.value, "G5 needs both I and J, or neither")
        self._reflected = blocks + 1, -far
        start = state.position[:3].copy()
        return np.stack([start, start + near, end + far, end])[None], np.ones((1, 4))

    def _nurbs(self, state: State, block: Block, blocks: int) -> tuple[Pieces, int] | None:
        opened, now = self.open, block.g.get("motion")
        if now == NURBS_END:
            if opened is None:
                raise block.fault("G5.3, and none is open; write G5.2 and points before it", "motion")
            self.open = None
            return _even_knots(opened, block), opened.line
        if opened is None:
            if now != NURBS:
                what = "control points of a spline after its G5.3"
                raise _fault(block, f"{what}; write G5.2, or another motion code")
            start = [state.position[:3].copy()]
            opened = self.open = OpenSpline(block.line, block.at["motion"], NURBS, 3, blocks, start, [1.0])
            if not block.has("XY"):
                opened.weights[0] = _weight(block, "P")
        else:
            text = "a weight without a control point; write X and Y beside it"
            block.require("P" not in block.value or block.has("XY"), text, "P")
        if "L" in block.value:
            opened.order = _order(block, "L")
        if block.has("XYZ"):
            both = "X" in block.value and "Y" in block.value
            block.require(both, "a control point of G5.2 needs both X and Y", "XYZ")
            opened.points.append(_end_in_plane(state, block, "G5.2"))
            opened.weights.append(_weight(block, "P"))
        return None

    def _fanuc(self, state: State, block: Block, blocks: int) -> tuple[Pieces, int] | None:
        opened = self.open
        if opened is None:
            if block.g.get("motion") != NURBS_WITH_KNOTS:
                what = "words of a spline after its last knot"
                raise _fault(block, f"{what}; write G6.2, or another motion code")
            order = _order(block, "P") if "P" in block.value else 4
            opened = self.open = OpenSpline(block.line, block.at["motion"], NURBS_WITH_KNOTS, order, blocks)
        else:
            block.require("P" not in block.value, "the order P of a spline stands in its first line", "P")
        if not opened.points or block.has("XYZ"):
            text = "a control point after a line with a knot only; write it before"
            block.require(len(opened.knots) <= len(opened.points), text, "XYZ")
            opened.points.append(_control_point(state, block, opened))
            opened.weights.append(_weight(block, "R"))
        else:
            text = "a weight without a control point; write X, Y or Z beside it"
            block.require("R" not in block.value, text, "R")
        if "K" not in block.value:
            raise _fault(block, "a line of G6.2 needs its knot K")
        knot = block.value["K"]
        good = not opened.knots or knot >= opened.knots[-1]
        block.require(good, f"knots must not decrease, as to K{knot:g} here", "K")
        opened.knots.append(knot)
        if not opened.ended:
            return None
        self.open = None
        return _given_knots(opened, block), opened.line


def is_spline_line(block: Block) -> bool:
    """True if a line under a spline's motion code has words of the spline."""
    return "motion" in block.g or bool(block.value.keys() & set("XYZIJKLRPQ") - block.uses)


def _quadratic(state: State, block: Block, blocks: int) -> Pieces:
    end = _end_in_plane(state, block, "G5.1")
    near = _offset(state, block, "IJ")
    good = "I" in block.value and "J" in block.value and bool(near.any())
    block.require(good, "G5.1 needs I and J, its control point from its start, not both 0")
    start = state.position[:3].copy()
    return _split(raised(homogeneous(np.stack([start, start + near, end])[None], np.ones((1, 3)))))


def _split(pieces: FloatArray) -> Pieces:
    return pieces[..., :-1] / pieces[..., -1:], pieces[..., -1].copy()


def _end_in_plane(state: State, block: Block, name: str) -> FloatArray:
    """(3,) where X and Y lead [mm]."""
    curve = f"{name} is a curve in the X Y plane"
    block.require(state.normal == 2, f"{curve}; write G17 before it")
    block.require("Z" not in block.value, f"{curve}; Z does not move along it", "Z")
    block.require(block.has("XY"), f"{name} needs an end point; write X and Y")
    text = "control points of G5.2 with G91 are relative to what? write G90 before it"
    block.require(state.absolute or name != "G5.2", text, "XY")
    return target(state, block)[:3]


def _offset(state: State, block: Block, letters: str) -> FloatArray:
    given = np.array([block.value.get(letter, 0.0) * state.unit for letter in letters] + [0.0])
    return state.work_system().turn(given)


def _weight(block: Block, letter: str) -> float:
    weight = block.value.get(letter, 1.0)
    block.require(weight > 0.0, "a weight must be positive", letter)
    return weight


def _order(block: Block, letter: str) -> int:
    order = round(block.value[letter])
    good = order in ORDERS and abs(order - block.value[letter]) <= 1e-3
    block.require(good, "splines of order 2, 3 and 4 are read (degree 1, 2 and 3)", letter)
    return order


def _control_point(state: State, block: Block, opened: OpenSpline) -> FloatArray:
    """(3,) control point of a line of G6.2 [mm], with the coordinates of the one before where not named."""
    if not state.absolute:
        raise _fault(block, "control points of G6.2 with G91 are not read; write G90 before it")
    here = state.position
    state.position = np.append(opened.points[-1], here[3:]) if opened.points else here
    point = target(state, block)[:3]
    state.position = here
    if opened.points:
        return point
    away = float(np.linalg.norm(point - here[:3]))
    text = f"the first control point of G6.2 is {away:.6g} mm from where the machine stands; move there before it"
    block.require(away <= SAME_PLACE, text, "XYZ")
    return here[:3].copy()


def _curve(opened: OpenSpline, knots: FloatArray) -> Pieces:
    control = homogeneous(np.array(opened.points), np.array(opened.weights))
    return _split(cubic_pieces(control, knots, opened.order - 1))


def _check_count(opened: OpenSpline, block: Block, at: str) -> None:
    count, order = len(opened.points), opened.order
    text = f"a spline of order {order} needs {order} control points or more; {count} are given"
    block.require(count >= order, text, at)


def _even_knots(opened: OpenSpline, block: Block) -> Pieces:
    """The curve of G5.2: knots 0 (L times), 1, 2 ... n - L, and n - L + 1 (L times) for n points."""
    _check_count(opened, block, "motion")
    count, order = len(opened.points), opened.order
    return _curve(opened, np.clip(np.arange(count + order) - order + 1, 0, count - order + 1).astype(float))


def _given_knots(opened: OpenSpline, block: Block) -> Pieces:
    """The curve of G6.2, which ends with the knot of this block."""
    _check_count(opened, block, "K")
    knots, order = np.array(opened.knots), opened.order
    good = knots[order - 1] == knots[0] != knots[-1] == knots[-order]
    block.require(good, f"first {order} knots of order {order} must be equal, and the last {order}", "K")
    inner = knots[order:-order]
    times = np.unique(inner, return_counts=True)[1].max(initial=0)
    often = f"a knot inside a spline of order {order} may occur {order - 1} times at most"
    good = times < order and inner.min(initial=np.inf) != knots[0]
    block.require(good, f"{often}: more break the curve", "K")
    good = inner.max(initial=-np.inf) != knots[-1]
    block.require(good, f"the last {order} knots must be larger than those before: more break it", "K")
    return _curve(opened, knots)
